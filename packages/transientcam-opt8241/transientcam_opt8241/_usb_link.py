"""A link to an OPT8241-CDK on USB, by pyusb."""

import array
from dataclasses import replace
from typing import Any

from transientcam_driver.camera import FoundCamera, Plugged, SameDevice, listed
from transientcam_driver.cameras.open_usb import (
    VENDOR_IN,
    VENDOR_OUT,
    claim,
    give_back,
    node_of,
    plugged,
    read_bulk,
    translated,
    udev_rule,
)
from transientcam_opt8241._device import PRODUCT
from transientcam_opt8241._link import FRAME_ENDPOINT, PRODUCT_ID, TIMEOUT_MS, VENDOR_ID, Request

UDEV_RULE = udev_rule(VENDOR_ID, PRODUCT_ID)
_PACKET_BYTES = 512  # of USB 2; reads are multiples of it, so that none overflows


class UsbLink:
    """A camera that this process has claimed."""

    def __init__(self, device: Any, serial: str) -> None:
        self._device = device
        self.node = node_of(device)
        self.serial = serial
        self._buffer = array.array("B")
        claim(device, UDEV_RULE)

    def control_in(self, request: Request, value: int, index: int, length: int) -> bytes:
        """Send a request and return the answer."""
        with translated(request.name, self.node, UDEV_RULE):
            return bytes(
                self._device.ctrl_transfer(VENDOR_IN, request, value, index, length, TIMEOUT_MS)
            )

    def control_out(self, request: Request, value: int, index: int, data: bytes) -> None:
        """Send a request."""
        with translated(request.name, self.node, UDEV_RULE):
            self._device.ctrl_transfer(VENDOR_OUT, request, value, index, data, TIMEOUT_MS)

    def read(self, most_bytes: int, *, timeout_s: float) -> bytes | None:
        """Return the next frame."""
        whole = -(-most_bytes // _PACKET_BYTES) * _PACKET_BYTES
        if len(self._buffer) != whole:
            self._buffer = array.array("B", bytes(whole))
        timeout_ms = max(1, round(timeout_s * 1e3))
        with translated("reading a frame", self.node, UDEV_RULE):
            count = read_bulk(self._device, FRAME_ENDPOINT, self._buffer, timeout_ms)
        return self._buffer[:count].tobytes() or None

    def clear_halt(self) -> None:
        """Let the endpoint of the frames begin anew."""
        with translated("clearing a halt", self.node, UDEV_RULE):
            self._device.clear_halt(FRAME_ENDPOINT)

    def close(self) -> None:
        """Give the camera back; no error if it is gone already."""
        give_back(self._device)


class SameCamera(SameDevice[UsbLink]):
    """Opens a camera by its name, and once that is lost no other."""

    def __init__(self, name: str | None = None) -> None:
        super().__init__(
            "opt8241",
            name,
            _plugged,
            lambda each, suffix: UsbLink(each.device, each.serial + suffix),
        )


def list_cameras() -> tuple[FoundCamera, ...]:
    """List the cameras that are plugged in; none is claimed.

    Raises
    ------
    LibusbMissing
    """
    return listed("opt8241", [replace(each, product=PRODUCT) for each in _plugged()])


def _plugged() -> list[Plugged]:
    return plugged(VENDOR_ID, PRODUCT_ID, rule=UDEV_RULE)
