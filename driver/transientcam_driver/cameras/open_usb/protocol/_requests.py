"""The device on the bus, its requests (usb-protocol 1, 3), and why it refused one (7)."""

import struct
from enum import IntEnum

from transientcam_driver.errors import ProtocolError

VENDOR_ID = 0x1209
PRODUCT_ID = 0x0001
"""A test number of pid.codes; a product gets its own."""
VENDOR_CLASS = 0xFF
IMAGE_ENDPOINT = 0x81
VERSION = 1


class Request(IntEnum):
    """bRequest of the vendor requests to the device (usb-protocol 3)."""

    GET_CAPS = 0x01
    SET_SEQUENCE = 0x02
    COMMIT = 0x03
    START = 0x04
    STOP = 0x05
    FLUSH = 0x06
    GET_STATUS = 0x07
    GET_TIME = 0x08
    HEARTBEAT = 0x09
    SAFE_OFF = 0x0A
    GET_LAST_ERROR = 0x0B


class ErrorCode(IntEnum):
    """Why the device stalled a request (usb-protocol 7)."""

    NONE = 0
    UNKNOWN_REQUEST = 1
    BAD_LENGTH = 2
    BAD_VALUE = 3
    NOT_CONFIGURED = 4
    INTERLOCK_OPEN = 5


_LAST_ERROR = struct.Struct("<HB")
LAST_ERROR_BYTES = 64


def pack_last_error(code: ErrorCode, request: int, detail: str) -> bytes:
    """Answer to GET_LAST_ERROR: code, request that was stalled, a sentence in ASCII."""
    return (_LAST_ERROR.pack(code, request) + detail.encode("ascii", "replace"))[:LAST_ERROR_BYTES]


def unpack_last_error(data: bytes) -> tuple[str, str, str]:
    """Read the answer to GET_LAST_ERROR: request, code and detail, as words."""
    if len(data) < _LAST_ERROR.size:
        raise ProtocolError(f"last error of {len(data)} bytes")
    code, request = _LAST_ERROR.unpack_from(data)
    return (
        Request(request).name if request in tuple(Request) else f"request {request:#04x}",
        ErrorCode(code).name if code in tuple(ErrorCode) else f"error {code}",
        data[_LAST_ERROR.size :].decode("ascii", "replace"),
    )
