"""Memory goes back to the system when a large answer has been sent."""

import ctypes
from typing import Final

from transientcam_server.imaging import BAND_BYTES

_M_MMAP_THRESHOLD: Final = -3
"""Of glibc's malloc.h."""


def give_back_large_blocks() -> None:
    """Give each block of more than a band back to the system as soon as it is free.

    glibc's malloc does so by itself for blocks of 128 KiB at first, and for larger and larger ones
    as they are used: then they stay, in pieces (mallopt(3), M_MMAP_THRESHOLD). 100 answers of
    30 MiB left 190 MiB behind. Other systems' allocators have no such function, and are left alone.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_M_MMAP_THRESHOLD, BAND_BYTES)
