"""The phase offsets of each pixel and frequency that a Kinect v2 holds: its P0 tables."""

import struct
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.kinect2._layout import (
    ASCENDING,
    HEIGHT,
    RESPONSE,
    STREAM_MULTIPLES,
    WIDTH,
)
from transientcam_driver.errors import ProtocolError

RESPONSE_BYTES: Final = 1_302_572
"""Of the answer to the command 0x22, 2 (`include/internal/libfreenect2/protocol/response.h`)."""
UNIT_RAD: Final = 31e-6 * np.pi
"""Of a table (`src/cpu_depth_packet_processor.cpp`)."""
_HEADER: Final = struct.Struct("<8I")  # header bytes, 2 unknown, table bytes, 4 unknown
_BORDER: Final = 2  # unknown bytes in front of each table and behind
_PIXELS_BYTES: Final = 2 * HEIGHT * WIDTH
_TABLE_BYTES: Final = _PIXELS_BYTES + 2 * _BORDER
_TABLES: Final = len(STREAM_MULTIPLES)


@dataclass(frozen=True, slots=True, eq=False)
class P0Tables:
    """Phase offsets in units of `UNIT_RAD`: uint16 (3, 424, 512), at 80, 16 and 120 MHz.

    Rows are as they are displayed.
    """

    units: NDArray[np.uint16]

    @classmethod
    def unpack(cls, response: bytes) -> Self:
        """Read the camera's answer; bytes behind it are left out.

        Raises ProtocolError where it is too short.
        """
        if len(response) < RESPONSE_BYTES:
            raise ProtocolError(f"P0 tables of {len(response)} bytes, not {RESPONSE_BYTES}")
        tables = np.frombuffer(response, np.uint8, _TABLES * _TABLE_BYTES, _HEADER.size)
        pixels = tables.reshape((_TABLES, _TABLE_BYTES))[:, _BORDER:-_BORDER]
        return cls(np.ascontiguousarray(pixels).view("<u2").reshape((_TABLES, HEIGHT, WIDTH)))

    def pack(self) -> bytes:
        """Return the answer of a camera with these tables; what is of unknown meaning is 0."""
        border = bytes(_BORDER)
        tables = (border + each.astype("<u2").tobytes() + border for each in self.units)
        body = _HEADER.pack(_HEADER.size, 0, 0, _TABLE_BYTES, 0, 0, 0, 0) + b"".join(tables)
        return body.ljust(RESPONSE_BYTES, b"\0")

    def gains(self) -> NDArray[np.complex64]:
        """Return what moments are divided by (4, 424, 512): of b_0, 16, 80 and 120 MHz.

        Sample k of a frequency is g Re(b exp(i (2 pi k / 3 - P0))), an image of a moment
        1/2 Re(gain b exp(-i phase)): gain = 2 g exp(-i P0). A moment is then in counts of a
        sample at 16 MHz. b_0 is not measured; its gain is 1.
        """
        made = np.ones((1 + _TABLES, HEIGHT, WIDTH), np.complex64)
        for plane, at in zip(made[1:], ASCENDING, strict=True):
            plane[:] = 2 * RESPONSE[at] * np.exp(-1j * UNIT_RAD * self.units[at])
        return made
