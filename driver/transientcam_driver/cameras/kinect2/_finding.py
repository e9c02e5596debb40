"""Find Kinects v2 on USB, and open one of them."""

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from typing import Any, Final

from transientcam_driver.camera import FoundCamera
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


def open_kinect2(
    serial: str | None, *, pause: Callable[[float], None], transfers: int = TRANSFERS
) -> Kinect2:
    """Open a camera, by its serial number or the first that can be opened.

    Parameters
    ----------
    pause
        Sleeps for so many seconds.
    transfers
        Isochronous transfers in flight.

    Raises
    ------
    CameraError
        None can be opened.
    """
    try:
        return _opened(serial, pause, transfers)
    except CameraLost:  # the reset let it appear anew, under another address
        pause(_RETURNS_S)
        return _opened(serial, pause, transfers)


def list_kinects() -> Iterator[FoundCamera]:
    """List the cameras that are plugged in; none is claimed.

    Raises
    ------
    CameraError
        There is no libusb.
    """
    with _context() as context:
        for device in _kinects(context):
            node = node_of(device)
            try:
                with translated("reading its serial number", node):
                    serial = str(device.getSerialNumber())
                require_bandwidth(device)
            except CameraError as error:
                yield FoundCamera("kinect2", None, PRODUCT, node, str(error))
            else:
                yield FoundCamera(f"kinect2:{serial}", serial, PRODUCT, node)


def facts(kinect: Kinect2) -> Iterator[tuple[str, str]]:
    """Return what a report of a fault should hold."""
    identity = kinect.identity
    yield "firmware", identity.firmware
    yield "serial number", identity.serial
    yield "lens", str(DepthParameters.unpack(identity.parameters))
    yield "P0 tables", f"{len(identity.p0)} bytes, header {identity.p0[:32].hex(' ', 4)}"


def _opened(serial: str | None, pause: Callable[[float], None], transfers: int) -> Kinect2:
    with _context() as context:
        nodes = [node_of(device) for device in _kinects(context)]
    trouble: CameraError = CameraNotFound(serial)
    for node in nodes:
        try:
            return Kinect2(_link(node, transfers), pause=pause, serial=serial)
        except CameraNotFound:  # another one, or unplugged meanwhile
            continue
        except CameraError as error:
            trouble = error
    raise trouble


def _link(node: str, transfers: int) -> UsbLink:
    """Claim the camera at a node, with a context of its own."""
    context = _opened_context()
    for device in _kinects(context):
        if node_of(device) == node:
            return UsbLink(context, device, transfers=transfers)
    context.close()
    raise CameraNotFound


@contextmanager
def _context() -> Iterator[Any]:
    with closing(_opened_context()) as context:
        yield context


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
