"""The USB transport: find a camera, send it requests, read its images.

Errors of pyusb are translated in ``_translated`` and nowhere else.
"""

import array
import errno
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Protocol

import usb.backend.libusb1
import usb.core
import usb.util

from transientcam_driver.errors import (
    CameraBusy,
    CameraError,
    CameraLost,
    CameraNotFound,
    LibusbMissing,
    PermissionDenied,
    TransferOverflow,
    TransferStalled,
)
from transientcam_driver.plugin import FoundCamera
from transientcam_driver.protocol import Request
from transientcam_driver.protocol.requests import IMAGE_ENDPOINT, PRODUCT_ID, VENDOR_ID

UDEV_RULE = (
    f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{VENDOR_ID:04x}", '
    f'ATTR{{idProduct}}=="{PRODUCT_ID:04x}", MODE="0660", GROUP="plugdev", TAG+="uaccess"'
)

_VENDOR_OUT, _VENDOR_IN = 0x40, 0xC0
_US_ENGLISH = 0x0409
_INTERFACE = 0
_CONTROL_TIMEOUT_MS = 1000
_PACKET_BYTES = 1024  # of the fastest bulk endpoint; reads are multiples of it, so none overflows
_SMALLEST_READ_BYTES = 16 * 1024

# usb-protocol 10.7; which one depends on the host controller, the kernel and the moment
_GONE = {errno.ENODEV, errno.EIO, errno.EPROTO, errno.ESHUTDOWN, errno.ENOENT, None}


class Transport(Protocol):
    """What a camera requires of its transport."""

    @property
    def serial(self) -> str:
        """Serial number of the device at the other end."""
        ...

    def control_in(self, request: Request, *, value: int = 0, length: int) -> bytes:
        """Send a request and return the answer."""
        ...

    def control_out(self, request: Request, data: bytes = b"") -> None:
        """Send a request."""
        ...

    def expect_transfers(self, transfer_bytes: int) -> None:
        """Prepare for transfers of this size."""
        ...

    def read(self, *, timeout_s: float) -> memoryview:
        """Wait for the next transfer; the view is empty when the time runs out."""
        ...

    def clear_halt(self) -> None:
        """Let the image endpoint run again after a stall."""
        ...

    def reset(self) -> None:
        """Reset the device's port."""
        ...

    def close(self) -> None:
        """Give the device back; never fails."""
        ...


class UsbTransport:
    """A camera that this process has claimed."""

    def __init__(self, device: Any, serial: str) -> None:
        self._device = device
        self._node = _node(device)
        self.serial = serial
        self._buffer = array.array("B", bytes(_SMALLEST_READ_BYTES))
        with self._translated("claiming the interface"):
            usb.util.claim_interface(device, _INTERFACE)

    def control_in(self, request: Request, *, value: int = 0, length: int) -> bytes:
        """Send a request and return the answer; ``value`` has 32 bits (wValue, wIndex)."""
        with self._translated(request.name):
            return bytes(
                self._device.ctrl_transfer(
                    _VENDOR_IN, request, value & 0xFFFF, value >> 16, length, _CONTROL_TIMEOUT_MS
                )
            )

    def control_out(self, request: Request, data: bytes = b"") -> None:
        """Send a request."""
        with self._translated(request.name):
            self._device.ctrl_transfer(_VENDOR_OUT, request, 0, 0, data, _CONTROL_TIMEOUT_MS)

    def expect_transfers(self, transfer_bytes: int) -> None:
        """Allocate a buffer that takes one transfer and the packet that ends it."""
        packets = transfer_bytes // _PACKET_BYTES + 1
        self._buffer = array.array("B", bytes(packets * _PACKET_BYTES))

    def read(self, *, timeout_s: float) -> memoryview:
        """Wait for the next transfer; the view is empty when the time ran out.

        It is a view of a buffer that the next call overwrites.
        """
        timeout_ms = max(1, round(timeout_s * 1e3))
        with self._translated("reading images"):
            try:
                count = self._device.read(IMAGE_ENDPOINT, self._buffer, timeout_ms)
            except usb.core.USBTimeoutError:
                count = 0
            except usb.core.USBError as error:
                half = len(self._buffer) // 2 // _PACKET_BYTES * _PACKET_BYTES
                if error.errno != errno.ENOMEM or half < _SMALLEST_READ_BYTES:
                    raise
                # usb-protocol 10.4: usbfs_memory_mb is exhausted; smaller reads from now on
                self._buffer = array.array("B", bytes(half))
                count = 0
        return memoryview(self._buffer)[:count]

    def clear_halt(self) -> None:
        """Let the image endpoint run again after a stall."""
        with self._translated("clearing a halt"):
            self._device.clear_halt(IMAGE_ENDPOINT)

    def reset(self) -> None:
        """Reset the device's port."""
        with self._translated("resetting the device"):
            self._device.reset()

    def close(self) -> None:
        """Give the device back; no error if it is gone already."""
        with suppress(usb.core.USBError, NotImplementedError):
            usb.util.release_interface(self._device, _INTERFACE)
        with suppress(usb.core.USBError, NotImplementedError):
            usb.util.dispose_resources(self._device)

    @contextmanager
    def _translated(self, action: str) -> Iterator[None]:
        with _translated(action, self._node):
            yield


def open_transport(serial: str | None = None, *, backend: Any = None) -> UsbTransport:
    """Find and claim a camera, by serial number or the first that can be opened.

    Parameters
    ----------
    serial
        Serial number of the camera to open.
    backend
        A pyusb backend; the system's libusb without one.

    Raises
    ------
    CameraNotFound, PermissionDenied, CameraBusy, LibusbMissing
    """
    trouble: CameraError = CameraNotFound(serial)
    for device in _cameras(backend):
        try:
            with _translated("reading the serial number", _node(device)):
                found = usb.util.get_string(device, device.iSerialNumber, _US_ENGLISH)
            if serial is None or found == serial:
                return UsbTransport(device, found or "")
        except CameraLost:
            pass  # it was unplugged meanwhile
        except CameraError as error:
            trouble = error
        usb.util.dispose_resources(device)
    raise trouble


def system_libusb() -> Any:
    """Return pyusb's backend for the libusb of this system; None where there is none."""
    return usb.backend.libusb1.get_backend()


def list_cameras(*, backend: Any = None) -> tuple[FoundCamera, ...]:
    """List the cameras that are plugged in; none is claimed, so that none is disturbed.

    Raises
    ------
    LibusbMissing
    """
    return tuple(map(_described, _cameras(backend)))


def _described(device: Any) -> FoundCamera:
    node = _node(device)
    try:
        with _translated("reading its strings", node):
            serial, product = (
                usb.util.get_string(device, index, _US_ENGLISH)
                for index in (device.iSerialNumber, device.iProduct)
            )
            return FoundCamera(_spec(serial), serial, product, node)
    except CameraError as error:
        return FoundCamera(_spec(None), node=node, problem=str(error))
    finally:
        usb.util.dispose_resources(device)


def _spec(serial: str | None) -> str:
    """Return the name by which `open_camera` opens it."""
    return "usb" if serial is None else f"usb:{serial}"


def _cameras(backend: Any) -> list[Any]:
    try:
        found: Any = usb.core.find(
            find_all=True, idVendor=VENDOR_ID, idProduct=PRODUCT_ID, backend=backend
        )
        return list(found)
    except usb.core.NoBackendError as error:
        raise LibusbMissing from error


def _node(device: Any) -> str:
    return f"/dev/bus/usb/{device.bus:03d}/{device.address:03d}"


@contextmanager
def _translated(action: str, node: str) -> Iterator[None]:
    """Translate every error of pyusb into one of `transientcam_driver.errors`."""
    try:
        yield
    except NotImplementedError as error:  # what pyusb makes of LIBUSB_ERROR_NOT_SUPPORTED
        raise CameraLost(f"{action}: not supported any more") from error
    except usb.core.USBTimeoutError as error:
        raise CameraLost(f"{action}: no answer within {_CONTROL_TIMEOUT_MS / 1e3:g} s") from error
    except usb.core.USBError as error:
        if error.errno in _GONE:
            raise CameraLost(f"{action}: {error.strerror}") from error
        if error.errno == errno.EACCES:
            raise PermissionDenied(node, UDEV_RULE) from error
        if error.errno == errno.EBUSY:
            raise CameraBusy(node) from error
        if error.errno == errno.EPIPE:
            raise TransferStalled from error
        if error.errno == errno.EOVERFLOW:
            raise TransferOverflow from error
        raise CameraError(f"{action} at {node}: {error}") from error
    except ValueError as error:  # pyusb: a string descriptor that is none
        raise CameraLost(f"{action}: {error}") from error
