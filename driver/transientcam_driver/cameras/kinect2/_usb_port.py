"""The port a Kinect v2 is at, by libusb: who may open it, and whether it is fast enough."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from transientcam_driver.cameras.kinect2._link import PRODUCT_IDS, VENDOR_ID
from transientcam_driver.errors import (
    CameraBusy,
    CameraError,
    CameraLost,
    LibusbMissing,
    PermissionDenied,
    TransferStalled,
)

UDEV_RULES: Final = "\n  ".join(
    f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{VENDOR_ID:04x}", '
    f'ATTR{{idProduct}}=="{product:04x}", MODE="0660", GROUP="plugdev", TAG+="uaccess"'
    for product in PRODUCT_IDS
)
TIMEOUT_MS: Final = 1000
DEPTH_ENDPOINT: Final = 0x84
PACKET_BYTES: Final = 33_792
"""Of one packet, which the endpoint has to allow (wBytesPerInterval of its companion)."""
_COMPANION: Final = struct.Struct("<BBBBH")  # USB 3.2, table 9-27
_COMPANION_TYPE: Final = 0x30
_SUPER_SPEED: Final = 4


def libusb() -> Any:
    """Return the package ``usb1``.

    Raises CameraError where it is not installed, or the system has no libusb.
    """
    try:
        import usb1
    except ModuleNotFoundError as error:
        raise CameraError(
            "the package libusb1 is not installed: pip install 'transientcam[kinect2]'"
        ) from error
    try:
        usb1.loadLibrary()
    except OSError as error:
        raise LibusbMissing from error
    return usb1


def node_of(device: Any) -> str:
    """Return the device node of a device of ``usb1``."""
    return f"/dev/bus/usb/{device.getBusNumber():03d}/{device.getDeviceAddress():03d}"


@contextmanager
def translated(action: str, node: str) -> Iterator[None]:
    """Translate every error of libusb into one of `transientcam_driver.errors`."""
    usb1 = libusb()
    try:
        yield
    except usb1.USBErrorTimeout as error:
        raise CameraLost(f"{action}: no answer within {TIMEOUT_MS / 1e3:g} s") from error
    except usb1.USBErrorAccess as error:
        raise PermissionDenied(node, UDEV_RULES) from error
    except usb1.USBErrorBusy as error:
        raise CameraBusy(node) from error
    except usb1.USBErrorPipe as error:
        raise TransferStalled from error
    except (usb1.USBErrorNoDevice, usb1.USBErrorNotFound, usb1.USBErrorIO) as error:
        raise CameraLost(f"{action}: {error}") from error
    except usb1.USBError as error:
        raise CameraError(f"{action} at {node}: {error}") from error


def bytes_per_interval(device: Any) -> int:
    """Return how much the depth endpoint may send every 125 us, by its companion descriptor."""
    for setting in device.iterSettings():
        for endpoint in setting:
            if endpoint.getAddress() == DEPTH_ENDPOINT:
                for extra in endpoint.getExtra():
                    if len(extra) >= _COMPANION.size and extra[1] == _COMPANION_TYPE:
                        return int(_COMPANION.unpack_from(bytes(extra))[4])
    return 0


def require_bandwidth(device: Any) -> None:
    """Refuse a port that is too slow.

    Raises CameraError where it is no USB 3 port, or its depth endpoint may send less than its
    images need.
    """
    if device.getDeviceSpeed() < _SUPER_SPEED:
        raise CameraError(f"the Kinect v2 at {node_of(device)} is on a port slower than USB 3")
    allowed = bytes_per_interval(device)
    if allowed < PACKET_BYTES:
        limit = f"{allowed} bytes an interval, and {PACKET_BYTES} are needed"
        raise CameraError(f"the depth endpoint of the Kinect v2 may send {limit}")
