"""A Kinect v2 on USB: `link.Link` by libusb, with isochronous transfers in flight.

What is requested of the device, and in which order, is that of OpenKinect/libfreenect2 @ fd64c5d
(``src/usb_control.cpp``, ``src/transfer_pool.cpp``). Errors of libusb are translated in
``usb_port.translated`` and nowhere else.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

from transientcam_driver.cameras.kinect2._link import FailureTaker, PacketTaker
from transientcam_driver.cameras.kinect2._usb_port import (
    DEPTH_ENDPOINT,
    PACKET_BYTES,
    TIMEOUT_MS,
    libusb,
    node_of,
    require_bandwidth,
    translated,
)
from transientcam_driver.errors import CameraError, CameraLost

TRANSFERS: Final = 60
"""Of 8 packets, an eighth of a millisecond each: 16.2 MB, just what usbfs allows by default."""
LEAST_TRANSFERS: Final = 16
PACKETS: Final = 8

COMMANDS, ANSWERS = 0x02, 0x81
CONTROL, STREAM = 0, 1  # interfaces
_EVENTS_S: Final = 0.1
_TO_DEVICE, TO_INTERFACE, _FROM_INTERFACE = 0x00, 0x01, 0x81
SET_FEATURE, _GET_INTERFACE, _SET_ISOCH_DELAY = 0x03, 0x0A, 0x31  # USB 3.2, table 9-5
FUNCTION_SUSPEND, _U1_ENABLE, _U2_ENABLE = 0, 48, 49
SUSPEND_AND_WAKE: Final = 0x0300  # USB 3.2, table 9-8, of interface 0
_ISOCH_DELAY_NS: Final = 40


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
        self.node = node_of(device)
        self._count = transfers
        self._lock = threading.Lock()
        self._transfers: list[Any] = []
        self._in_flight = 0
        self._stopping = False
        self._gone = False
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
        with self._bulk("a request", COMMANDS) as handle:
            handle.bulkWrite(COMMANDS, data, timeout=TIMEOUT_MS)

    def read(self, most_bytes: int) -> bytes:
        """Return the next transfer of the answer endpoint."""
        with self._bulk("an answer", ANSWERS) as handle:
            return bytes(handle.bulkRead(ANSWERS, most_bytes, timeout=TIMEOUT_MS))

    def set_suspended(self, suspended: bool) -> None:
        """Suspend the function of the depth camera, or wake it up."""
        options = SUSPEND_AND_WAKE if suspended else 0
        self._request(TO_INTERFACE, SET_FEATURE, FUNCTION_SUSPEND, options)

    def set_stream_enabled(self, enabled: bool) -> None:
        """Give the depth endpoint its bandwidth, or take it away."""
        handle = self._opened()
        with self._translated("setting the alternate setting"):
            # libusb 1.0.26 unlocks what it has not locked where the device is gone, and aborts at
            # its close: look first
            handle.controlRead(_FROM_INTERFACE, _GET_INTERFACE, 0, STREAM, 1, timeout=TIMEOUT_MS)
            handle.setInterfaceAltSetting(STREAM, int(enabled))

    def start_images(self, received: PacketTaker, failed: FailureTaker) -> None:
        """Keep transfers in flight, and hand over every packet of them.

        Raises CameraError: not enough of them can be had: usbfs has too little memory.
        """
        handle = self._opened()
        self._stopping = False

        def done(transfer: Any) -> None:
            self._done(transfer, received, failed)

        for _ in range(self._count):
            transfer = handle.getTransfer(iso_packets=PACKETS)
            transfer.setIsochronous(DEPTH_ENDPOINT, PACKETS * PACKET_BYTES, callback=done)
            if not self._submitted(transfer):
                break
            self._transfers.append(transfer)
        self._thread = threading.Thread(target=self._handle_events, name="kinect2-usb", daemon=True)
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
            for interface in (CONTROL, STREAM):
                with suppress(self._usb1.USBError):
                    handle.releaseInterface(interface)
            handle.close()
        self._context.close()

    # --- opening -----------------------------------------------------------------------------

    def _prepare(self) -> None:
        handle = self._handle
        handle.claimInterface(CONTROL)  # first: a reset would disturb the program that has it
        handle.resetDevice()
        if handle.getConfiguration() != 1:
            handle.setConfiguration(1)
        handle.claimInterface(STREAM)
        self._request(_TO_DEVICE, _SET_ISOCH_DELAY, _ISOCH_DELAY_NS)
        self.set_stream_enabled(False)
        for feature in (_U1_ENABLE, _U2_ENABLE):
            self._request(_TO_DEVICE, SET_FEATURE, feature)
        self.set_suspended(True)

    def _request(self, kind: int, request: int, value: int, index: int = 0) -> None:
        with self._translated("a control request"):
            self._opened().controlWrite(kind, request, value, index, b"", timeout=TIMEOUT_MS)

    @contextmanager
    def _bulk(self, action: str, endpoint: int) -> Iterator[Any]:
        """Around a bulk transfer: after a stall the endpoint can be used again."""
        handle = self._opened()
        with self._translated(action):
            try:
                yield handle
            except self._usb1.USBErrorPipe:
                handle.clearHalt(endpoint)
                raise

    def _opened(self) -> Any:
        if self._handle is None or self._gone:
            raise CameraLost("it is not plugged in any more")
        return self._handle

    # --- transfers ---------------------------------------------------------------------------

    def _handle_events(self) -> None:
        while self._in_flight:
            with suppress(self._usb1.USBErrorInterrupted):
                self._context.handleEventsTimeout(_EVENTS_S)

    def _submitted(self, transfer: Any) -> bool:
        with self._lock:
            if self._stopping:
                return False
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
        self._gone |= gone
        sent = not gone and self._submitted(transfer)
        if not (sent or self._in_flight or self._stopping):
            failed(CameraLost("it was unplugged" if gone else "no transfer can be submitted"))

    @contextmanager
    def _translated(self, action: str) -> Iterator[None]:
        with translated(action, self.node):
            yield
