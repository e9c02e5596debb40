"""Images of a TOFcam660: the header in front of the pixels, and the packets they travel in."""

import struct
from dataclasses import astuple, dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.tofcam660._region import Region
from transientcam_driver.cameras.tofcam660._wire import CODES_FROM, ImageType
from transientcam_driver.errors import ImagesLost

_HEADER: Final = struct.Struct("!BHHHHHHHHHHhH")
HEADER_BYTES: Final = _HEADER.size
_PACKET: Final = struct.Struct("!HIHIII")
PACKET_HEADER_BYTES: Final = _PACKET.size
LONGEST_PACKET_BYTES: Final = 4096
HEADER_VERSION: Final = 1
FULL_SCALE_DN: Final = 4095
"""The highest code of the converter: in a `RawFrame` it says that there is no measurement."""
ZERO_DN: Final = 2048
"""What a difference of 0 is in an image."""


@dataclass(frozen=True, slots=True)
class ImageHeader:
    """The 25 bytes in front of an image."""

    kind: int
    columns: int
    rows: int
    region: Region
    integration_us: tuple[int, int, int]
    temperature_c: float

    def pack(self) -> bytes:
        """Return the bytes."""
        centidegrees = round(self.temperature_c * 100)
        size = self.columns, self.rows
        edges = self.region.edges
        times = self.integration_us
        return _HEADER.pack(
            HEADER_VERSION, self.kind, *size, *edges, *times, centidegrees, HEADER_BYTES
        )

    @classmethod
    def unpack(cls, data: bytes) -> "ImageHeader":
        """Read the bytes."""
        _, kind, columns, rows, *rest = _HEADER.unpack_from(data)
        left, top, right, bottom, low, mid, high, centidegrees, _ = rest
        region = Region(left, top, right, bottom)
        return cls(kind, columns, rows, region, (low, mid, high), centidegrees / 100)


@dataclass(frozen=True, slots=True)
class PacketHeader:
    """The 20 bytes in front of each piece of an image over UDP."""

    measurement: int
    image_bytes: int
    bytes_here: int
    offset: int
    packets: int
    number: int

    def pack(self) -> bytes:
        """Return the bytes."""
        return _PACKET.pack(*astuple(self))

    @classmethod
    def unpack(cls, data: bytes | memoryview) -> "PacketHeader":
        """Read the bytes."""
        return cls(*_PACKET.unpack_from(data))


def image_bytes(kind: ImageType, region: Region) -> int:
    """Return the length of an image with its header."""
    return HEADER_BYTES + 2 * kind.values_per_pixel * region.width * region.height


def dcs_images(data: bytes, region: Region, integration_us: int) -> NDArray[np.uint16]:
    """Return the four images (4, H, W) of a capture, `ZERO_DN` for a difference of zero.

    ``DCS_k = ZERO_DN + A cos(phi - k pi / 2)``, so that image k has the phase k pi / 2. A pixel
    that overflowed or is saturated has the highest code of the converter.
    Raises ImagesLost: these are not the images that were asked for.
    """
    header = ImageHeader.unpack(data)
    found = (header.kind, header.columns, header.rows, header.integration_us[0])
    wanted = (ImageType.DCS.value, region.width, region.height, integration_us)
    if found != wanted:
        raise ImagesLost(
            "an image of (type, columns, rows, integration time in us) = "
            f"{found} came in place of {wanted}"
        )
    pixels = np.frombuffer(data, dtype="<u2", offset=HEADER_BYTES)
    images = pixels.reshape(4, region.height, region.width)
    corrupt = images >= CODES_FROM
    return np.where(corrupt, np.uint16(FULL_SCALE_DN), np.minimum(images, FULL_SCALE_DN)).astype(
        np.uint16
    )
