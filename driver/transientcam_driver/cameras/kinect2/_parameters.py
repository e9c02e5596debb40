"""The lens of a Kinect v2 as the camera reports it."""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, Self

from transientcam_driver.camera import Lens
from transientcam_driver.cameras.kinect2._layout import HEIGHT
from transientcam_driver.errors import ProtocolError

RESPONSE_BYTES: Final = 92
"""Of the answer to the command 0x22, 3 (`include/internal/libfreenect2/protocol/response.h`)."""
LIGHT_X_M: Final = 0.045
"""How far to the right of the lens the light is (`src/libfreenect2.cpp`, the x and z tables)."""
Rows = Literal["top", "bottom"]
ROWS: Final[Mapping[Rows, str]] = {
    "top": "the principal point is counted from the top row of the image: so do the OpenCL and "
    "CUDA processors of libfreenect2, and its registration of colour",
    "bottom": "the principal point is counted from the bottom row of the image: so do the CPU and "
    "OpenGL processors of libfreenect2",
}
"""The two ways to read ``cy``. Depths differ by up to 2 % at the border; the one that bends a flat
wall less is right."""
_LAYOUT: Final = struct.Struct("<23f")  # fx fy 0 cx cy k1 k2 p1 p2 k3, 13 unused


@dataclass(frozen=True, slots=True)
class DepthParameters:
    """What the camera says of its depth lens; pixel (0, 0) has its centre at (0.5, 0.5)."""

    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    @classmethod
    def unpack(cls, response: bytes) -> Self:
        """Read the camera's answer. Raises ProtocolError where it is too short, or no lens."""
        if len(response) < RESPONSE_BYTES:
            raise ProtocolError(f"camera parameters of {len(response)} bytes, not {RESPONSE_BYTES}")
        fx, fy, _, *others = _LAYOUT.unpack_from(response)[:10]
        found = cls(fx, fy, *others)
        try:
            found.lens()
        except ValueError as error:
            raise ProtocolError(f"camera parameters: {error}") from error
        return found

    def pack(self) -> bytes:
        """Return the answer of a camera with this lens."""
        distortion = self.k1, self.k2, self.p1, self.p2, self.k3
        return _LAYOUT.pack(self.fx, self.fy, 0, self.cx, self.cy, *distortion, *[0.0] * 13)

    def lens(self, rows: Rows = "top") -> Lens:
        """Return the lens, with ``cy`` counted from the top or the bottom of the image (`ROWS`)."""
        top = rows == "top"
        cy, p1 = (self.cy, self.p1) if top else (HEIGHT - self.cy, -self.p1)
        distortion = self.k1, self.k2, p1, self.p2, self.k3
        return Lens(self.fx, self.fy, self.cx - 0.5, cy - 0.5, distortion, LIGHT_X_M)
