"""A link to an emulated Kinect v2: `kinect2.link.Link` without a cable."""

import threading
from collections.abc import Callable, Iterator
from typing import Protocol

from transientcam_driver.cameras.kinect2 import FailureTaker, PacketTaker
from transientcam_driver.errors import CameraLost
from transientcam_simulation.emulated._kinect2.firmware import EmulatedFirmware


class Plug(Protocol):
    """The camera's end of a link."""

    firmware: EmulatedFirmware
    changed: threading.Condition

    def is_at(self, link: "EmulatedLink") -> bool:
        """Whether a link leads to this camera still."""
        ...

    def release(self, link: "EmulatedLink") -> None:
        """Take note that a link was closed."""
        ...

    def wait_for_frame(self, due_s: float | None, wanted: Callable[[], bool]) -> float | None:
        """Wait until a frame is due, now without a time; return when the next one is."""
        ...

    def frame(self) -> Iterator[bytes]:
        """Return the packets of the next frame."""
        ...


class EmulatedLink:
    """One opening of an emulated camera; it stays dead once the cable was pulled."""

    node = ""

    def __init__(self, plug: Plug) -> None:
        self._plug = plug
        self._enabled = False
        self._thread: threading.Thread | None = None

    def write(self, data: bytes) -> None:
        """Send a request."""
        with self._plug.changed:
            self._require_plugged()
            self._plug.firmware.write(data)
            self._plug.changed.notify_all()  # it may have been to start or to stop

    def read(self, most_bytes: int) -> bytes:
        """Return the next transfer of the answer endpoint."""
        with self._plug.changed:
            self._require_plugged()
            return self._plug.firmware.read(most_bytes)

    def set_suspended(self, suspended: bool) -> None:
        """Suspend the function of the depth camera, or wake it up."""
        with self._plug.changed:
            self._require_plugged()
            self._plug.firmware.suspended = suspended

    def set_stream_enabled(self, enabled: bool) -> None:
        """Give the stream its bandwidth, or take it away."""
        with self._plug.changed:
            self._require_plugged()
            self._enabled = enabled

    def start_images(self, received: PacketTaker, failed: FailureTaker) -> None:
        """Hand over packets on a thread, until `stop_images`."""
        with self._plug.changed:
            self._require_plugged()
        thread = threading.Thread(
            target=self._stream, args=(received, failed), name="kinect2-packets", daemon=True
        )
        self._thread = thread
        thread.start()

    def stop_images(self) -> None:
        """Hand over nothing more once this returns."""
        with self._plug.changed:
            thread, self._thread = self._thread, None
            self._plug.changed.notify_all()
        if thread is not None:
            thread.join()

    def close(self) -> None:
        """Give the camera back."""
        self.stop_images()
        self._plug.release(self)

    def _stream(self, received: PacketTaker, failed: FailureTaker) -> None:
        own = threading.current_thread()

        def wanted() -> bool:
            return self._thread is own and self._plug.is_at(self)

        due_s: float | None = None
        while (due_s := self._plug.wait_for_frame(due_s, wanted)) is not None:
            if not (self._enabled and self._plug.firmware.lit):
                continue
            for packet in self._plug.frame():
                if not wanted():
                    break
                received(packet)
        if self._thread is own:
            failed(CameraLost("it was unplugged"))

    def _require_plugged(self) -> None:
        if not self._plug.is_at(self):
            raise CameraLost("it is not plugged in any more")
