"""Find Kinects v2 on USB, and open one of them."""

from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any, Final

from transientcam_driver.camera import FoundCamera, Plugged, SameDevice, listed, place_on
from transientcam_driver.cameras.kinect2._device import Kinect2
from transientcam_driver.cameras.kinect2._link import PRODUCT_IDS, VENDOR_ID
from transientcam_driver.cameras.kinect2._parameters import DepthParameters
from transientcam_driver.cameras.kinect2._usb_link import TRANSFERS, UsbLink
from transientcam_driver.cameras.kinect2._usb_port import (
    libusb,
    node_of,
    require_bandwidth,
    translated,
)
from transientcam_driver.errors import CameraError, CameraLost, CameraNotFound

PRODUCT: Final = "Microsoft Kinect v2"
_RETURNS_S: Final = 1.0
"""What libfreenect2 waits for a camera that a reset let appear anew (``src/libfreenect2.cpp``)."""


class SameKinect(SameDevice[Kinect2]):
    """Opens a camera by its name, and once that is lost no other.

    ``name``: serial number or place; None for the first that can be opened.
    ``pause``: sleeps for so many seconds.
    ``transfers``: isochronous transfers in flight.
    """

    def __init__(
        self, name: str | None, *, pause: Callable[[float], None], transfers: int = TRANSFERS
    ) -> None:
        def claim(each: Plugged, _suffix: str) -> Kinect2:
            try:
                return Kinect2(_link(each, transfers), pause=pause, serial=each.serial or None)
            except CameraLost:  # the reset let it appear anew, under another address
                pause(_RETURNS_S)
                return Kinect2(_link(each, transfers), pause=pause, serial=each.serial or None)

        super().__init__("kinect2", name, _look, claim)


def list_kinects() -> tuple[FoundCamera, ...]:
    """List the cameras that are plugged in; none is claimed.

    Raises CameraError where there is no libusb.
    """
    return listed("kinect2", _look())


def facts(kinect: Kinect2) -> Iterator[tuple[str, str]]:
    """Return what a report of a fault should hold."""
    identity = kinect.identity
    yield "firmware", identity.firmware
    yield "serial number", identity.serial
    yield "lens", str(DepthParameters.unpack(identity.parameters))
    yield "P0 tables", f"{len(identity.p0)} bytes, header {identity.p0[:32].hex(' ', 4)}"


def _look() -> list[Plugged]:
    with closing(_opened_context()) as context:
        return [_described(device) for device in _kinects(context)]


def _described(device: Any) -> Plugged:
    node, place, serial = node_of(device), _place_of(device), ""
    try:
        with translated("reading its serial number", node):
            serial = str(device.getSerialNumber() or "")
        require_bandwidth(device)
    except CameraError as error:
        return Plugged(place, serial, node, product=PRODUCT, problem=error)
    return Plugged(place, serial, node, product=PRODUCT)


def _place_of(device: Any) -> str:
    ports = device.getPortNumberList()
    return place_on(device.getBusNumber(), ports, device.getDeviceAddress())


def _link(camera: Plugged, transfers: int) -> UsbLink:
    """Claim a camera, with a context of its own."""
    context = _opened_context()
    for device in _kinects(context):
        if _place_of(device) == camera.place:
            return UsbLink(context, device, transfers=transfers)
    context.close()
    raise CameraNotFound


def _opened_context() -> Any:
    context = libusb().USBContext()
    with translated("looking for cameras", "/dev/bus/usb"):  # a container may have no USB at all
        context.open()
    return context


def _kinects(context: Any) -> list[Any]:
    found = context.getDeviceIterator(skip_on_error=True)
    return [
        each
        for each in found
        if each.getVendorID() == VENDOR_ID and each.getProductID() in PRODUCT_IDS
    ]
