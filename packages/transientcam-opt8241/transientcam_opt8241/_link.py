"""The requests that an OPT8241-CDK takes, and what carries them.

`TI3DToF/VoxelUSBProgrammer.cpp` and `Voxel/USBIO.cpp` of 3dtof/voxelsdk @ db85629. The requests of
its firmware loader (0x0C, 0x17, 0x1D and their neighbours) switch supplies off and erase memory:
they are none of these, and no other request is ever sent.
"""

from enum import IntEnum
from typing import Final, Protocol

VENDOR_ID: Final = 0x0451
PRODUCT_ID: Final = 0x9105
"""Of the variant with bulk transfers; 0x9106, a UVC camera, is controlled in another way."""
TIMEOUT_MS: Final = 1000
FRAME_ENDPOINT: Final = 0x82
SLACK_BYTES: Final = 255
"""A read asks for so much more than a frame: a frame that is too long shows."""


class Request(IntEnum):
    """Vendor requests."""

    WRITE_SUPPLY = 0x03
    READ_REGISTER = 0x08
    WRITE_REGISTER = 0x09
    WRITE_MONITOR = 0x0B


class Link(Protocol):
    """A claimed camera."""

    @property
    def node(self) -> str:
        """Device node of usbfs; empty without one."""
        ...

    @property
    def serial(self) -> str:
        """Serial number; where it has none, the place it is plugged in at."""
        ...

    def control_in(self, request: Request, value: int, index: int, length: int) -> bytes:
        """Send a request and return the answer, of just that length."""
        ...

    def control_out(self, request: Request, value: int, index: int, data: bytes) -> None:
        """Send a request."""

    def read(self, most_bytes: int, *, timeout_s: float) -> bytes | None:
        """Return the next frame, up to so many bytes; None where none comes in time."""
        ...

    def clear_halt(self) -> None:
        """Let the endpoint of the frames begin anew."""

    def close(self) -> None:
        """Give the camera back; never fails."""
