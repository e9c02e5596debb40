"""A Kinect v2 on USB: `link.Link` by libusb, with isochronous transfers in flight.

What is requested of the device, and in which order, is that of OpenKinect/libfreenect2 @ fd64c5d
(``src/usb_control.cpp``, ``src/transfer_pool.cpp``). Errors of libusb are translated in
``_translated`` and nowhere else.
"""

import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

from transientcam_driver.errors import (
    CameraBusy,
    CameraError,
    CameraLost,
    LibusbMissing,
    PermissionDenied,
    TransferStalled,
)
from transientcam_driver.kinect2.link import PRODUCT_IDS, VENDOR_ID, FailureTaker, PacketTaker

UDEV_RULES: Final = "\n  ".join(
    f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{VENDOR_ID:04x}", '
    f'ATTR{{idProduct}}=="{product:04x}", MODE="0660", GROUP="plugdev", TAG+="uaccess"'
    for product in PRODUCT_IDS
)
TRANSFERS: Final = 60
"""Of 8 packets, an eighth of a millisecond each: 16.2 MB, just what usbfs allows by default."""
LEAST_TRANSFERS: Final = 16
PACKETS: Final = 8
PACKET_BYTES: Final = 33_792
"""Of one packet, which the endpoint has to allow (wBytesPerInterval of its companion)."""

_COMMANDS, _ANSWERS, _DEPTH = 0x02, 0x81, 0x84
_CONTROL, _STREAM = 0, 1  # interfaces
_TIMEOUT_MS: Final = 1000
_EVENTS_S: Final = 0.1
_TO_DEVICE, _TO_INTERFACE = 0x00, 0x01
_SET_FEATURE, _SET_ISOCH_DELAY = 0x03, 0x31  # USB 3.2, tables 9-5, 9-7
_FUNCTION_SUSPEND, _U1_ENABLE, _U2_ENABLE = 0, 48, 49
_SUSPEND_AND_WAKE: Final = 0x0300  # USB 3.2, table 9-8, of interface 0
_ISOCH_DELAY_NS: Final = 40
_COMPANION: Final = struct.Struct("<BBBBH")  # USB 3.2, table 9-27
_COMPANION_TYPE: Final = 0x30
_SUPER_SPEED: Final = 4


def libusb() -> Any:
    """Return the package ``usb1``.

    Raises
    ------
    CameraError
        It is not installed, or the system has no libusb.
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


class UsbLink:
    """One camera that this process has claimed.

    Parameters
    ----------
    context
        Of ``usb1``, owned from now on: its events are handled on a thread of this link.
    device
        Of ``usb1``, of that context.
    transfers
        How many to keep in flight.

    Raises
    ------
    CameraBusy, PermissionDenied, CameraLost
    CameraError
        Its port is no SuperSpeed one.
    """

    def __init__(self, context: Any, device: Any, *, transfers: int = TRANSFERS) -> None:
        self._usb1 = libusb()
        self._context = context
        self._node = node_of(device)
        self._count = transfers
        self._lock = threading.Lock()
        self._transfers: list[Any] = []
        self._in_flight = 0
        self._stopping = False
        self._thread: threading.Thread | None = None
        self._handle: Any = None
        try:
            with self._translated("opening"):
                require_bandwidth(device)
                self._handle = device.open()
                self._prepare()
        except BaseException:
            self.close()
            raise

    def write(self, data: bytes) -> None:
        """Send a request to the command endpoint."""
        with self._translated("a request"):
            self._opened().bulkWrite(_COMMANDS, data, timeout=_TIMEOUT_MS)

    def read(self, most_bytes: int) -> bytes:
        """Return the next transfer of the answer endpoint."""
        with self._translated("an answer"):
            return bytes(self._opened().bulkRead(_ANSWERS, most_bytes, timeout=_TIMEOUT_MS))

    def set_suspended(self, suspended: bool) -> None:
        """Suspend the function of the depth camera, or wake it up."""
        options = _SUSPEND_AND_WAKE if suspended else 0
        self._request(_TO_INTERFACE, _SET_FEATURE, _FUNCTION_SUSPEND, options)

    def set_stream_enabled(self, enabled: bool) -> None:
        """Give the depth endpoint its bandwidth, or take it away."""
        with self._translated("setting the alternate setting"):
            self._opened().setInterfaceAltSetting(_STREAM, int(enabled))

    def start_images(self, received: PacketTaker, failed: FailureTaker) -> None:
        """Keep transfers in flight, and hand over every packet of them.

        Raises
        ------
        CameraError
            Not enough of them can be had: usbfs has too little memory.
        """
        handle = self._opened()
        self._stopping = False

        def done(transfer: Any) -> None:
            self._done(transfer, received, failed)

        for _ in range(self._count):
            transfer = handle.getTransfer(iso_packets=PACKETS)
            transfer.setIsochronous(_DEPTH, PACKETS * PACKET_BYTES, callback=done)
            if not self._submitted(transfer):
                break
            self._transfers.append(transfer)
        self._thread = threading.Thread(target=self._handle_events, name="kinect2-usb")
        self._thread.start()
        enough = min(self._count, LEAST_TRANSFERS)
        if len(self._transfers) < enough:
            self.stop_images()
            had = f"{len(self._transfers)} of {enough} isochronous transfers"
            raise CameraError(f"{had} could be had: usbfs_memory_mb is too small, see doctor")

    def stop_images(self) -> None:
        """Cancel what is in flight, and wait until it has come back."""
        with self._lock:
            self._stopping = True
            transfers, self._transfers = self._transfers, []
        for transfer in transfers:
            with suppress(self._usb1.USBError):  # it has just come back
                transfer.cancel()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def close(self) -> None:
        """Give the device back."""
        self.stop_images()
        handle, self._handle = self._handle, None
        if handle is not None:
            for interface in (_CONTROL, _STREAM):
                with suppress(self._usb1.USBError):
                    handle.releaseInterface(interface)
            handle.close()
        self._context.close()

    # --- opening -----------------------------------------------------------------------------

    def _prepare(self) -> None:
        handle = self._handle
        handle.claimInterface(_CONTROL)  # first: a reset would disturb the program that has it
        handle.resetDevice()
        if handle.getConfiguration() != 1:
            handle.setConfiguration(1)
        handle.claimInterface(_STREAM)
        self._request(_TO_DEVICE, _SET_ISOCH_DELAY, _ISOCH_DELAY_NS)
        self.set_stream_enabled(False)
        for feature in (_U1_ENABLE, _U2_ENABLE):
            self._request(_TO_DEVICE, _SET_FEATURE, feature)
        self.set_suspended(True)

    def _request(self, kind: int, request: int, value: int, index: int = 0) -> None:
        with self._translated("a control request"):
            self._opened().controlWrite(kind, request, value, index, b"", timeout=_TIMEOUT_MS)

    def _opened(self) -> Any:
        if self._handle is None:
            raise CameraLost("it is closed")
        return self._handle

    # --- transfers ---------------------------------------------------------------------------

    def _handle_events(self) -> None:
        while self._in_flight:
            with suppress(self._usb1.USBErrorInterrupted):
                self._context.handleEventsTimeout(_EVENTS_S)

    def _submitted(self, transfer: Any) -> bool:
        with self._lock:
            try:
                transfer.submit()
            except self._usb1.USBError:
                return False
            self._in_flight += 1
            return True

    def _done(self, transfer: Any, received: PacketTaker, failed: FailureTaker) -> None:
        """Hand over the packets of a transfer that came back, and send it out again."""
        with self._lock:
            self._in_flight -= 1
            stopping = self._stopping
        status = transfer.getStatus()
        if stopping:
            return
        if status == self._usb1.TRANSFER_COMPLETED:
            for packet_status, data in transfer.iterISO():
                whole = packet_status == self._usb1.TRANSFER_COMPLETED
                received(bytes(data) if whole else b"")
        else:
            received(b"")
        gone = status == self._usb1.TRANSFER_NO_DEVICE
        if (gone or not self._submitted(transfer)) and not self._in_flight:
            failed(CameraLost("it was unplugged" if gone else "no transfer can be submitted"))

    @contextmanager
    def _translated(self, action: str) -> Iterator[None]:
        with translated(action, self._node):
            yield


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
        raise CameraLost(f"{action}: no answer within {_TIMEOUT_MS / 1e3:g} s") from error
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
            if endpoint.getAddress() == _DEPTH:
                for extra in endpoint.getExtra():
                    if len(extra) >= _COMPANION.size and extra[1] == _COMPANION_TYPE:
                        return int(_COMPANION.unpack_from(bytes(extra))[4])
    return 0


def require_bandwidth(device: Any) -> None:
    """Refuse a port that is too slow.

    Raises
    ------
    CameraError
        It is no USB 3 port, or its depth endpoint may send less than its images need.
    """
    if device.getDeviceSpeed() < _SUPER_SPEED:
        raise CameraError(f"the Kinect v2 at {node_of(device)} is on a port slower than USB 3")
    allowed = bytes_per_interval(device)
    if allowed < PACKET_BYTES:
        limit = f"{allowed} bytes an interval, and {PACKET_BYTES} are needed"
        raise CameraError(f"the depth endpoint of the Kinect v2 may send {limit}")
