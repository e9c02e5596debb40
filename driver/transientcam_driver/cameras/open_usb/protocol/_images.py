"""Image packets: the header in front of the pixels, and their checksums (usb-protocol 8.1)."""

import struct
from dataclasses import astuple, dataclass
from enum import IntFlag

from crc32c import crc32c

from transientcam_driver.camera import IMAGE_HEADER_BYTES
from transientcam_driver.cameras.open_usb.protocol._requests import VERSION
from transientcam_driver.cameras.open_usb.protocol._units import centidegrees

IMAGE_MAGIC = b"TCIM"
_HEADER = struct.Struct("<4sBBHIIQHHIHHIQhxxII")
_CRC = struct.Struct("<I")


class ImageFlag(IntFlag):
    """Flags of an image header."""

    ILLUMINATION = 1
    FIRST_OF_FRAME = 2
    LAST_OF_FRAME = 4
    OVERFLOW = 8
    """Images in front of this one were dropped, because the FIFO was full (usb-protocol 8.3)."""


@dataclass(frozen=True, slots=True)
class ImageHeader:
    """The 64 bytes in front of each image.

    ``number`` counts every image since power-up, also those that were dropped; ``phase`` is in
    1/65536 of a turn; ``device_time_ns`` is when the exposure began.
    """

    flags: ImageFlag
    epoch: int
    frame: int
    number: int
    index: int
    count: int
    tuning_word: int
    phase: int
    harmonic: int
    exposure_ns: int
    device_time_ns: int
    temperature_c: float
    payload_bytes: int
    payload_crc: int

    def pack(self) -> bytes:
        """Return the 64 bytes, with their checksum."""
        *fields, temperature_c, payload_bytes, payload_crc = astuple(self)
        body = _HEADER.pack(
            IMAGE_MAGIC,
            VERSION,
            IMAGE_HEADER_BYTES,
            *fields,
            centidegrees(temperature_c),
            payload_bytes,
            payload_crc,
        )
        return body + _CRC.pack(crc32c(body))

    @classmethod
    def unpack(cls, data: bytes) -> "ImageHeader | None":
        """Read 64 bytes; None unless they are an undamaged header of this version."""
        if data[:4] != IMAGE_MAGIC or data[4] != VERSION or data[5] != IMAGE_HEADER_BYTES:
            return None
        if crc32c(data[: _HEADER.size]) != _CRC.unpack_from(data, _HEADER.size)[0]:
            return None
        flags, *fields = _HEADER.unpack_from(data)[3:]
        fields[-3] /= 100  # the temperature
        return cls(ImageFlag(flags), *fields)


def payload_checksum(payload: bytes | bytearray | memoryview) -> int:
    """CRC-32C (Castagnoli) of an image's pixels."""
    return int(crc32c(payload))
