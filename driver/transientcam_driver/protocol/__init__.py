"""The camera's USB protocol: requests, their answers and image headers as bytes.

Pure: nothing here needs a transport or a clock. Both ends use it, the driver and the simulated
firmware. The specification is docs/usb-protocol.md, whose sections the comments cite; all numbers
are little-endian.
"""

from transientcam_driver.protocol.images import ImageFlag, ImageHeader
from transientcam_driver.protocol.requests import ErrorCode, Request
from transientcam_driver.protocol.sequences import Commitment, SequenceWords
from transientcam_driver.protocol.status import DeviceState, Status

__all__ = [
    "Commitment",
    "DeviceState",
    "ErrorCode",
    "ImageFlag",
    "ImageHeader",
    "Request",
    "SequenceWords",
    "Status",
]
