"""The camera's USB protocol: requests, their answers and image headers as bytes.

Pure: nothing here needs a transport or a clock. Both ends use it, the driver and the simulated
firmware. The specification is docs/usb-protocol.md, whose sections the comments cite; all numbers
are little-endian.
"""

from transientcam_driver.cameras.open_usb.protocol._capabilities import (
    CAPS_ROOM_BYTES,
    pack_capabilities,
    unpack_capabilities,
)
from transientcam_driver.cameras.open_usb.protocol._images import (
    IMAGE_MAGIC,
    ImageFlag,
    ImageHeader,
    payload_checksum,
)
from transientcam_driver.cameras.open_usb.protocol._requests import (
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
from transientcam_driver.cameras.open_usb.protocol._sequences import Commitment, SequenceWords
from transientcam_driver.cameras.open_usb.protocol._status import (
    STATUS_BYTES,
    TIME_BYTES,
    pack_status,
    pack_time,
    unpack_status,
    unpack_time,
)
from transientcam_driver.cameras.open_usb.protocol._units import phase_word
