"""An emulated OPT8241-CDK on an emulated bus, below the libusb of another process."""

import struct

from tests.driver.cameras.open_usb.usbfs.usbfs import Model, UsbfsMount
from transientcam_driver.errors import CameraError, TransferStalled
from transientcam_opt8241._link import FRAME_ENDPOINT, PRODUCT_ID, VENDOR_ID
from transientcam_opt8241.emulated import EmulatedOpt8241
from transientcam_opt8241.emulated._device import EmulatedLink
from transientcam_simulation.emulated._open_usb.descriptors import string_descriptors
from transientcam_simulation.emulated._open_usb.usb_device import Stall, Unplugged

_FROM_DEVICE, _VENDOR = 0x80, 0x40
_GET_DESCRIPTOR, _STRING = 6, 3


def _chain() -> bytes:
    device = struct.pack(
        "<BBHBBBBHHHBBBB", 18, 1, 0x0200, 0, 0, 0, 64, VENDOR_ID, PRODUCT_ID, 0x0100, 1, 2, 3, 1
    )
    below = struct.pack("<9B", 9, 4, 0, 0, 1, 255, 0, 0, 0)
    below += struct.pack("<BBBBHB", 7, 5, FRAME_ENDPOINT, 2, 512, 0)
    return device + struct.pack("<BBHBBBBB", 9, 2, 9 + len(below), 1, 1, 0, 0x80, 250) + below


class OnBus:
    """The camera as a mount has it."""

    def __init__(self, camera: EmulatedOpt8241) -> None:
        self.camera = camera
        self.changed, self.clock = camera.changed, camera._clock
        self.bus, self.address = 1, 1
        self.requests_to_stall = 0
        self.strings = string_descriptors(product="OPT8241-CDK", serial=camera.serial)
        self._link: EmulatedLink | None = None

    @property
    def plugged(self) -> bool:
        return self.camera.plugged

    @property
    def lit(self) -> bool:
        return self.camera.lit

    def unplug(self) -> None:
        self.camera.unplug()

    def replug(self) -> None:
        self.camera.replug()
        self.address += 1

    def reset(self) -> None:
        """Nothing that is known of it: its sensor runs on."""

    def clear_halt(self) -> None:
        """Nothing that a program would see."""

    def control(
        self, request_type: int, request: int, value: int, index: int, length: int, data: bytes
    ) -> bytes:
        if request == _GET_DESCRIPTOR and value >> 8 == _STRING:
            return self.strings[value & 0xFF][:length]
        if not request_type & _VENDOR:
            return b""
        with self.changed:
            if self.requests_to_stall:
                self.requests_to_stall -= 1
                raise Stall
            if not self.plugged:
                raise Unplugged
            registers = self.camera.registers
            try:
                if request_type & _FROM_DEVICE:
                    return registers.read(request, value, index, length)
                self.camera.write(request, value, index, data)
            except TransferStalled:
                raise Stall from None
            return b""

    def take(self, most: int) -> memoryview | None:
        """Return the next frame, where one is due; the lock is held."""
        try:
            frame = self.camera.frame(self._linked(), 0.0)
        except CameraError:
            raise Unplugged from None
        return None if frame is None else memoryview(frame)[:most]

    def due_s(self) -> float | None:
        return self.camera._due_s

    def _linked(self) -> EmulatedLink:
        if self._link is None or not self.camera.is_at(self._link):
            self._link = self.camera.connect()
        return self._link


class Usb2Mount(UsbfsMount):
    """The camera's node."""

    model = Model(VENDOR_ID, PRODUCT_ID, chain=_chain())
