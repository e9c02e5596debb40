"""The USB transport: find a camera, send it requests, read its images.

Errors of pyusb are translated in ``translated`` and nowhere else.
"""

import array
import errno
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import usb.backend.libusb1
import usb.core
import usb.util

from transientcam_driver.camera import FoundCamera, Plugged, SameDevice, listed, place_on
from transientcam_driver.cameras.open_usb.protocol import (
    IMAGE_ENDPOINT,
    PRODUCT_ID,
    VENDOR_ID,
    Request,
)
from transientcam_driver.errors import (
    CameraBusy,
    CameraError,
    CameraLost,
    LibusbMissing,
    PermissionDenied,
    TransferOverflow,
    TransferStalled,
)

VENDOR_OUT, VENDOR_IN = 0x40, 0xC0
_US_ENGLISH = 0x0409
_INTERFACE = 0
_CONTROL_TIMEOUT_MS = 1000
_PACKET_BYTES = 1024  # of the fastest bulk endpoint; reads are multiples of it, so none overflows
_SMALLEST_READ_BYTES = 16 * 1024

# usb-protocol 10.7; which one depends on the host controller, the kernel and the moment
_GONE = {errno.ENODEV, errno.EIO, errno.EPROTO, errno.ESHUTDOWN, errno.ENOENT, None}


def udev_rule(vendor_id: int, product_id: int) -> str:
    """Return the line for udev that lets users open such a device."""
    return (
        f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{vendor_id:04x}", '
        f'ATTR{{idProduct}}=="{product_id:04x}", MODE="0660", GROUP="plugdev", TAG+="uaccess"'
    )


UDEV_RULE = udev_rule(VENDOR_ID, PRODUCT_ID)


class UsbTransport:
    """A camera that this process has claimed."""

    def __init__(self, device: Any, serial: str, suffix: str) -> None:
        self._device = device
        self.node = node_of(device)
        self.serial, self.suffix = serial, suffix
        self._buffer = array.array("B", bytes(_SMALLEST_READ_BYTES))
        claim(device)

    def control_in(self, request: Request, *, value: int = 0, length: int) -> bytes:
        """Send a request and return the answer; ``value`` has 32 bits (wValue, wIndex)."""
        with self._translated(request.name):
            return bytes(
                self._device.ctrl_transfer(
                    VENDOR_IN, request, value & 0xFFFF, value >> 16, length, _CONTROL_TIMEOUT_MS
                )
            )

    def control_out(self, request: Request, data: bytes = b"") -> None:
        """Send a request."""
        with self._translated(request.name):
            self._device.ctrl_transfer(VENDOR_OUT, request, 0, 0, data, _CONTROL_TIMEOUT_MS)

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
                count = read_bulk(self._device, IMAGE_ENDPOINT, self._buffer, timeout_ms)
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
        give_back(self._device)

    @contextmanager
    def _translated(self, action: str) -> Iterator[None]:
        with translated(action, self.node):
            yield


def open_transport(name: str | None = None, *, backend: Any = None) -> UsbTransport:
    """Find and claim a camera: by serial number, by place, or the first that can be opened.

    ``backend`` is one of pyusb; the system's libusb without one.

    Raises
    ------
    CameraNotFound, PermissionDenied, CameraBusy, LibusbMissing
    CameraError
        Several cameras have this serial number.
    """
    return SameCamera(name, backend=backend)()


class SameCamera(SameDevice[UsbTransport]):
    """Opens a camera by its name, and once that is lost no other."""

    def __init__(self, name: str | None, *, backend: Any = None) -> None:
        super().__init__(
            "usb",
            name,
            lambda: plugged(VENDOR_ID, PRODUCT_ID, backend=backend),
            lambda each, suffix: UsbTransport(each.device, each.serial, suffix),
        )


def give_back(device: Any) -> None:
    """Release a device; no error if it is gone already."""
    with suppress(usb.core.USBError, NotImplementedError):
        usb.util.release_interface(device, _INTERFACE)
    with suppress(usb.core.USBError, NotImplementedError):
        usb.util.dispose_resources(device)


def claim(device: Any, rule: str = UDEV_RULE) -> None:
    """Claim a device's interface; raises as `translated`."""
    with translated("claiming the interface", node_of(device), rule):
        usb.util.claim_interface(device, _INTERFACE)


def read_bulk(device: Any, endpoint: int, buffer: "array.array[int]", timeout_ms: int) -> int:
    """Read a transfer into a buffer; return how many bytes came, 0 where none did in time."""
    try:
        return int(device.read(endpoint, buffer, timeout_ms))
    except usb.core.USBTimeoutError:
        return 0


def system_libusb() -> Any:
    """Return pyusb's backend for the libusb of this system; None where there is none."""
    return usb.backend.libusb1.get_backend()


def list_cameras(*, backend: Any = None) -> tuple[FoundCamera, ...]:
    """List the cameras that are plugged in; none is claimed, so that none is disturbed.

    Raises
    ------
    LibusbMissing
    """
    return listed("usb", plugged(VENDOR_ID, PRODUCT_ID, backend=backend))


def plugged(
    vendor_id: int, product_id: int, *, rule: str = UDEV_RULE, backend: Any = None
) -> list[Plugged]:
    """Return the devices with these numbers, and what can be read of each without claiming it.

    Raises
    ------
    LibusbMissing
    """
    found = devices(vendor_id, product_id, backend=backend)
    return [_described(device, rule) for device in found]


def _described(device: Any, rule: str) -> Plugged:
    node = node_of(device)
    place = place_on(device.bus, device.port_numbers, device.address)
    try:
        with translated("reading its strings", node, rule):
            serial, product = (
                usb.util.get_string(device, index, _US_ENGLISH) or "" if index else ""
                for index in (device.iSerialNumber, device.iProduct)
            )
        return Plugged(place, serial, node, device, product or None)
    except CameraError as error:
        return Plugged(place, "", node, device, problem=error)
    finally:
        usb.util.dispose_resources(device)


def devices(vendor_id: int, product_id: int, *, backend: Any = None) -> list[Any]:
    """Return pyusb's devices with these numbers.

    Raises
    ------
    LibusbMissing
    """
    try:
        found: Any = usb.core.find(
            find_all=True, idVendor=vendor_id, idProduct=product_id, backend=backend
        )
        return list(found)
    except usb.core.NoBackendError as error:
        raise LibusbMissing from error


def node_of(device: Any) -> str:
    """Return the device node of a device of pyusb."""
    return f"/dev/bus/usb/{device.bus:03d}/{device.address:03d}"


@contextmanager
def translated(action: str, node: str, rule: str = UDEV_RULE) -> Iterator[None]:
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
            raise PermissionDenied(node, rule) from error
        if error.errno == errno.EBUSY:
            raise CameraBusy(node) from error
        if error.errno == errno.EPIPE:
            raise TransferStalled from error
        if error.errno == errno.EOVERFLOW:
            raise TransferOverflow from error
        raise CameraError(f"{action} at {node}: {error}") from error
    except ValueError as error:  # pyusb: a string descriptor that is none
        raise CameraLost(f"{action}: {error}") from error
