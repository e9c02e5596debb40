"""The camera's USB protocol: requests and image packets as bytes.

Pure: nothing here knows a transport or a clock. Both ends use it, the driver and the simulated
firmware. The specification is docs/usb-protocol.md; all numbers are little-endian.
"""

from transientcam_driver.protocol.capabilities import (
    CAPS_BYTES,
    CAPS_ROOM_BYTES,
    pack_capabilities,
    unpack_capabilities,
)
from transientcam_driver.protocol.images import (
    IMAGE_MAGIC,
    ImageFlag,
    ImageHeader,
    payload_checksum,
)
from transientcam_driver.protocol.requests import (
    IMAGE_ENDPOINT,
    LAST_ERROR_BYTES,
    PRODUCT_ID,
    VENDOR_CLASS,
    VENDOR_ID,
    VERSION,
    ErrorCode,
    Request,
    pack_last_error,
    unpack_last_error,
)
from transientcam_driver.protocol.sequences import (
    Commitment,
    SequenceWords,
)
from transientcam_driver.protocol.status import (
    TIME_BYTES,
    DeviceState,
    Status,
    StatusFlag,
    pack_time,
    unpack_time,
)
from transientcam_driver.protocol.units import (
    phase_word,
)

__all__ = [
    "CAPS_BYTES",
    "CAPS_ROOM_BYTES",
    "IMAGE_ENDPOINT",
    "IMAGE_MAGIC",
    "LAST_ERROR_BYTES",
    "PRODUCT_ID",
    "TIME_BYTES",
    "VENDOR_CLASS",
    "VENDOR_ID",
    "VERSION",
    "Commitment",
    "DeviceState",
    "ErrorCode",
    "ImageFlag",
    "ImageHeader",
    "Request",
    "SequenceWords",
    "Status",
    "StatusFlag",
    "pack_capabilities",
    "pack_last_error",
    "pack_time",
    "payload_checksum",
    "phase_word",
    "unpack_capabilities",
    "unpack_last_error",
    "unpack_time",
]
