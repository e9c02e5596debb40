"""A process that owns cameras on behalf of a test: pickled requests in, pickled answers out.

``python client.py N`` keeps N descriptors open: umockdev names the socket of a monitor after its
descriptor, so that two processes with equal ones take the events of plugs from each other.
"""

import os
import pickle
import sys
from typing import Any

from transientcam_driver import Camera, DriverError, open_camera


def main() -> None:
    for _ in range(int(sys.argv[1])):
        os.open(os.devnull, os.O_RDONLY)
    cameras: dict[int, Camera] = {}
    while True:
        try:
            action, *arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer: tuple[str, Any] = "value", _answer(cameras, action, arguments)
        except DriverError as error:
            answer = "error", error
        pickle.dump(answer, sys.stdout.buffer)
        sys.stdout.buffer.flush()


def _answer(cameras: dict[int, Camera], action: str, arguments: list[Any]) -> Any:
    match action, arguments:
        case "open", [spec, sequence]:
            camera = open_camera(spec)
            number = max(cameras, default=0) + 1
            cameras[number] = camera
            if sequence is not None:
                camera.configure(sequence)
            return number
        case "get", [number, name]:
            return getattr(cameras[number], name)
        case "call", [number, name, positional, named]:
            return getattr(cameras[number], name)(*positional, **named)
    raise AssertionError(action)


if __name__ == "__main__":
    main()
