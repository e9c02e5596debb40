"""The device at the other end of an `OffSwitch`: by usbfs, as the kernel has it, or by TCP.

Numbers and structures are those of Linux, ``linux/usbdevice_fs.h``. libusb would start a thread,
and would refuse to take an interface from another process; usbfs does that where no driver is named
(``proc_disconnect_claim`` of ``drivers/usb/core/devio.c``).
"""

import ctypes
import errno
import fcntl
import os
import socket
import struct
from typing import Final

from transientcam_supervisor._switch import (
    OffSwitch,
    Step,
    TcpMessage,
    UsbClaim,
    UsbControl,
    UsbRead,
    UsbReset,
    UsbSetting,
    UsbWrite,
)

STEP_MS: Final = 250
"""A device that answers does so in a fraction of this."""
_CONTROL: Final = struct.Struct("@BBHHHIP")
_BULK: Final = struct.Struct("@IIIP")
_SETTING: Final = struct.Struct("@II")
_INTERFACE: Final = struct.Struct("@I")
_CLAIM: Final = struct.Struct("@II256s")
_GONE: Final = {errno.ENODEV, errno.ESHUTDOWN}


def _number(direction: int, number: int, size: int = 0) -> int:
    """Return the number of a request of usbfs (asm-generic/ioctl.h)."""
    return direction << 30 | size << 16 | ord("U") << 8 | number


_DO_CONTROL: Final = _number(3, 0, _CONTROL.size)
_DO_BULK: Final = _number(3, 2, _BULK.size)
_SET_INTERFACE: Final = _number(2, 4, _SETTING.size)
_RELEASE: Final = _number(2, 16, _INTERFACE.size)
_RESET: Final = _number(0, 20)
_DISCONNECT_CLAIM: Final = _number(2, 27, _CLAIM.size)


class Device:
    """What is at the place of an off switch, opened and not disturbed.

    Raises OSError where it cannot be opened.
    """

    def __init__(self, switch: OffSwitch) -> None:
        self._switch = switch
        self._file: int | None = None
        self._claimed: list[int] = []
        self._failed = False
        if not all(isinstance(each, TcpMessage) for each in switch.steps):
            self._file = os.open(switch.at, os.O_RDWR | os.O_CLOEXEC)

    def switch_off(self) -> str | None:
        """Take all steps; return why one of them failed, None where the light is off.

        A device that is not there any more has none.
        """
        problem: str | None = None
        self._failed = False
        for step in self._switch.steps:
            try:
                self._take(step)
            except OSError as error:
                if error.errno in _GONE:
                    return None
                self._failed = True
                problem = problem or f"{step}: {error}"
            else:
                if isinstance(step, UsbReset) and self._failed:
                    problem = None
        return problem

    def give_back(self) -> None:
        """Give back the interfaces that were taken."""
        while self._claimed:
            try:
                self._ioctl(_RELEASE, _INTERFACE.pack(self._claimed.pop()))
            except OSError:
                continue  # unplugged meanwhile

    def close(self) -> None:
        """Close it, and with it give back what was taken."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _take(self, step: Step) -> None:
        match step:
            case UsbControl(request_type, request, value, index, data):
                sent = ctypes.create_string_buffer(data, len(data) or 1)
                fields = request_type, request, value, index, len(data), STEP_MS
                self._ioctl(_DO_CONTROL, _CONTROL.pack(*fields, ctypes.addressof(sent)))
            case UsbClaim(interface):
                if interface not in self._claimed:
                    self._ioctl(_DISCONNECT_CLAIM, _CLAIM.pack(interface, 0, b""))
                    self._claimed.append(interface)
            case UsbSetting(interface, alternate):
                self._ioctl(_SET_INTERFACE, _SETTING.pack(interface, alternate))
            case UsbWrite(endpoint, data):
                self._bulk(endpoint, ctypes.create_string_buffer(data, len(data)))
            case UsbRead(endpoint, most_bytes):
                self._bulk(endpoint, ctypes.create_string_buffer(most_bytes))
            case UsbReset():
                if self._failed:
                    self._ioctl(_RESET)
            case TcpMessage(data):
                self._send(data)

    def _bulk(self, endpoint: int, buffer: "ctypes.Array[ctypes.c_char]") -> None:
        address = ctypes.addressof(buffer)
        self._ioctl(_DO_BULK, _BULK.pack(endpoint, len(buffer), STEP_MS, address))

    def _ioctl(self, request: int, argument: bytes = b"") -> None:
        if self._file is None:
            raise OSError(errno.EBADF, "it is not a USB device")
        fcntl.ioctl(self._file, request, bytearray(argument) if argument else 0)

    def _send(self, data: bytes) -> None:
        host, _, port = self._switch.at.rpartition(":")
        timeout_s = STEP_MS / 1e3
        with socket.create_connection((host, int(port)), timeout_s) as connection:
            connection.sendall(data)
            if not connection.recv(1):
                raise ConnectionResetError("it closed the connection without an answer")
