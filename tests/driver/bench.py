"""A small camera whose images hold their own numbers, so that any mix-up shows in the pixels."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Capabilities, ImageLabel, RawFrame, Sequence
from transientcam_driver.camera import Status
from transientcam_driver.cameras.open_usb import UsbCamera, open_transport
from transientcam_driver.cameras.open_usb.protocol import (
    STATUS_BYTES,
    Request,
    pack_capabilities,
    unpack_status,
)
from transientcam_driver.clock import VirtualClock
from transientcam_simulation.emulated._open_usb.bus import SimulatedBus
from transientcam_simulation.emulated._open_usb.firmware import Firmware
from transientcam_simulation.emulated._open_usb.prototype import prototype
from transientcam_simulation.emulated._open_usb.usb_device import EmulatedDevice

WIDTH, HEIGHT = 12, 5
CAPABILITIES = replace(
    prototype(serial="BENCH-1", width=WIDTH, height=HEIGHT, bits=16),
    fifo_bytes=32 * (64 + 2 * WIDTH * HEIGHT),
)


class NumberedImages:
    """Pixels are drawn from the image's number; the first four hold the number itself."""

    def __init__(self) -> None:
        self.labels: dict[int, ImageLabel] = {}

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        pass

    def prepare(self) -> None:
        pass

    def image(self, label: ImageLabel, *, number: int, device_time_s: float) -> NDArray[np.uint16]:
        self.labels[number] = label
        return numbered_pixels(number)

    def temperature_c(self, device_time_s: float) -> float:
        return 30.0


def numbered_pixels(number: int) -> NDArray[np.uint16]:
    pixels = np.random.default_rng(number).integers(0, 2**16, (HEIGHT, WIDTH), np.uint16)
    pixels.flat[:4] = np.array([number], "<u8").view("<u2")
    return pixels


def number_of(image: NDArray[np.uint16]) -> int:
    return int(image.ravel()[:4].copy().view("<u8")[0])


class _Firmware(Firmware):
    """A firmware that may announce other capabilities than it has."""

    def __init__(self, *arguments: Any, announced: Capabilities, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._announced = announced

    def control_in(self, request: int, value: int, index: int, *, now_s: float) -> bytes:
        if request == Request.GET_CAPS:
            return pack_capabilities(self._announced)
        return super().control_in(request, value, index, now_s=now_s)


class Bench:
    """A small camera, its cable and its clock."""

    def __init__(
        self, capabilities: Capabilities = CAPABILITIES, *, announced: Capabilities | None = None
    ) -> None:
        """``announced`` are those in the device's answer, where they are wrong on purpose."""
        self.clock = VirtualClock(start_s=1000.0, unix_s=1.7e9)
        self.images = NumberedImages()

        def power_on(now_s: float) -> Firmware:
            return _Firmware(
                capabilities, self.images, power_on_s=now_s, announced=announced or capabilities
            )

        self.device = EmulatedDevice(capabilities, power_on, clock=self.clock)
        self.bus = SimulatedBus([self.device])

    def open(self, sequence: Sequence | None = None) -> UsbCamera:
        return UsbCamera(
            lambda serial: open_transport(serial, backend=self.bus),
            clock=self.clock,
            sequence=sequence,
        )

    @property
    def lit(self) -> bool:
        """Whether the light is on, read from the device, not by the camera."""
        return self.device._firmware._status(self.clock.now_s()).light_on

    def status(self) -> Status:
        answer = self.device.control(0xC0, Request.GET_STATUS, 0, 0, STATUS_BYTES, b"")
        return unpack_status(answer)

    def require_whole_and_right(self, frame: RawFrame) -> None:
        """Hold every byte of a frame against what the device sent."""
        numbers = [number_of(image) for image in frame.images]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        assert [self.images.labels[number] for number in numbers] == list(frame.labels)
        for number, image in zip(numbers, frame.images, strict=True):
            assert image.tobytes() == numbered_pixels(number).tobytes()
