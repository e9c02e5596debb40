"""Writes a camera's frames to standard output as ROS 2 messages in CDR; `node.py` publishes them.

It needs ``transientcam[server,convert]`` and no ROS. The node runs this in an environment of its
own, since ROS 2's Python and this package may need different versions of NumPy. Each message is a
line of JSON (topic, type, latched, bytes) and then so many bytes.
"""

import argparse
import json
import os
import sys
from collections.abc import Iterator
from typing import BinaryIO

from transientcam import Camera, Frame
from transientcam.robotics import Calibration, Message, Source, Transform, captured_s, messages_of
from transientcam_server.offline import ros2_message


class Messages:
    """Makes the messages of frames, as they come one product after the other."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._direct: Frame | None = None
        self._posed = False
        self._described: int | None = None

    def of(self, frame: Frame) -> Iterator[Message]:
        """Yield what a frame is: its pose once, its lens once a frame; points with intensity."""
        lens = self._source.lens_of(frame)
        same = self._direct is not None and self._direct.frame == frame.frame
        intensity = self._direct.array if self._direct is not None and same else None
        for message in messages_of({frame.product: frame.array}, lens, intensity=intensity):
            if isinstance(message, Transform):
                if self._posed:
                    continue
                self._posed = True
            if isinstance(message, Calibration):
                if self._described == frame.frame:
                    continue
                self._described = frame.frame
            yield message
        if frame.product == "direct":
            self._direct = frame


def write(message: Message, time_ns: int, to: BinaryIO) -> None:
    """Write one message."""
    encoded = ros2_message(message, time_ns)
    head = {
        "topic": message.topic,
        "type": encoded.schema.name,
        "latched": isinstance(message, Transform),
        "bytes": len(encoded.data),
    }
    to.write(json.dumps(head).encode() + b"\n" + encoded.data)


def main(arguments: list[str], to: BinaryIO) -> None:
    """Write the frames of a camera until what reads them ends."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("url")
    parser.add_argument("products", nargs="*", default=["range", "direct", "pointcloud"])
    parser.add_argument("--max-rate-hz", type=float, default=10.0)
    options = parser.parse_args(arguments)
    with Camera(options.url, token=os.environ.get("TRANSIENTCAM_TOKEN")) as camera:
        source = Source(camera, on_report=lambda each: sys.stderr.write(f"{each.text}\n"))
        messages = Messages(source)

        def follow() -> None:
            with source.stream(*options.products, max_rate_hz=options.max_rate_hz) as stream:
                for frame in stream:
                    time_ns = round(captured_s(frame) * 1e9)
                    for message in messages.of(frame):
                        write(message, time_ns, to)
                    to.flush()

        while True:
            source.attempt(follow, None)


if __name__ == "__main__":
    try:
        main(sys.argv[1:], sys.stdout.buffer)
    except (BrokenPipeError, KeyboardInterrupt):
        os._exit(0)  # nobody reads what is still to be written
