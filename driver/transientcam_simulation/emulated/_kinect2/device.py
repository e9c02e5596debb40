"""The cable of an emulated Kinect v2: a link at a time, its packets, faults, and a plug."""

import threading
from collections.abc import Callable, Iterator
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.kinect2 import (
    FRAME_RATE_HZ,
    MEASURED,
    TICK_S,
    FailureTaker,
    PacketTaker,
    encoder,
)
from transientcam_driver.clock import Clock
from transientcam_driver.errors import CameraLost
from transientcam_simulation.emulated._kinect2.firmware import EmulatedFirmware
from transientcam_simulation.emulated._open_usb import Fault
from transientcam_simulation.emulated._plugged_camera import PluggedCamera

PERIOD_S: Final = 1 / FRAME_RATE_HZ
_NUMBERS: Final = 1 << 32
_CORRUPT_PACKET: Final = 3  # of a sub-image


class Pixels(Protocol):
    """What the sensor sees."""

    def sub_images(self, number: int, *, device_time_s: float) -> NDArray[np.uint8]:
        """Return the sub-images (9 or 10, bytes) of a frame, numbered from 0."""
        ...


class EmulatedKinect2(PluggedCamera["EmulatedLink"]):
    """An emulated camera, and its cable; a fault loses or shortens a packet of an image.

    ``power_on``: makes the firmware, at the start and when the cable is plugged in again.
    ``pixels``: what its frames show.
    ``clock``: paces its frames. Where they take longer to make than 1/30 s, they come later.
    """

    def __init__(
        self, power_on: Callable[[], EmulatedFirmware], pixels: Pixels, *, clock: Clock
    ) -> None:
        super().__init__("kinect2:emulated", "Kinect v2")
        self._firmware_of_power_on = power_on
        self._pixels = pixels
        self._clock = clock
        self._since_s = clock.now_s()
        self._frame = 0
        self._power_on()

    def _power_on(self) -> None:
        self.firmware = self._firmware_of_power_on()

    def _new_link(self) -> "EmulatedLink":
        return EmulatedLink(self)

    @property
    def lit(self) -> bool:
        """Whether the light is on."""
        return self.plugged and self.firmware.lit

    # --- images ------------------------------------------------------------------------------

    def wait_for_frame(self, due_s: float | None, wanted: Callable[[], bool]) -> float | None:
        """Wait until a frame is due, now without a time; return when the next one is.

        None if none is wanted any more.
        """
        with self.changed:
            while wanted():
                now_s = self._clock.now_s()
                begin_s = now_s if due_s is None else due_s
                if now_s >= begin_s:
                    late = now_s - begin_s > PERIOD_S / 2
                    return PERIOD_S + (now_s if late else begin_s)
                self._clock.wait(self.changed, begin_s - now_s)
            return None

    def frame(self) -> Iterator[bytes]:
        """Return the packets of the next frame, some of them lost or shortened."""
        with self.changed:
            number, self._frame = self._frame, self._frame + 1
        time_s = self._clock.now_s() - self._since_s
        sub_images = self._pixels.sub_images(number, device_time_s=time_s)
        timestamp = round(time_s / TICK_S) % _NUMBERS
        packets = encoder.packets(sub_images, sequence=number % _NUMBERS, timestamp=timestamp)
        image = place = 0
        for packet in packets:
            corrupt = place == _CORRUPT_PACKET and image < MEASURED
            if corrupt and self._takes(Fault.CORRUPT_PIXELS):
                yield packet[: len(packet) // 2]
            elif not (corrupt and self._takes(Fault.DROP)):
                yield packet
            image, place = (image, place + 1) if packet else (image + 1, 0)

    def _takes(self, fault: Fault) -> bool:
        with self.changed:
            return self._faults.take(fault)


class EmulatedLink:
    """One opening of an emulated camera; it stays dead once the cable was pulled."""

    node = ""

    def __init__(self, plug: EmulatedKinect2) -> None:
        self._plug = plug
        self._enabled = False
        self._thread: threading.Thread | None = None

    def write(self, data: bytes) -> None:
        """Send a request."""
        with self._plug.changed:
            self._plug.require(self)
            self._plug.firmware.write(data)
            self._plug.changed.notify_all()  # it may have been to start or to stop

    def read(self, most_bytes: int) -> bytes:
        """Return the next transfer of the answer endpoint."""
        with self._plug.changed:
            self._plug.require(self)
            return self._plug.firmware.read(most_bytes)

    def set_suspended(self, suspended: bool) -> None:
        """Suspend the function of the depth camera, or wake it up."""
        with self._plug.changed:
            self._plug.require(self)
            self._plug.firmware.suspended = suspended

    def set_stream_enabled(self, enabled: bool) -> None:
        """Give the stream its bandwidth, or take it away."""
        with self._plug.changed:
            self._plug.require(self)
            self._enabled = enabled

    def start_images(self, received: PacketTaker, failed: FailureTaker) -> None:
        """Hand over packets on a thread, until `stop_images`."""
        with self._plug.changed:
            self._plug.require(self)
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
