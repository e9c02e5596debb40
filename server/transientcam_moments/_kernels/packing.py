"""Rows of pixels between the stages of a kernel: later stages get those that need them, gapless.

A `Room` is a flat array, row after row of `ROW` numbers, of which the last register is slack.
"""

from typing import Any, Final

from numba import njit

from transientcam_moments._kernels import simd
from transientcam_moments.arrays import Bank, Length, Mask, Plane

PIXELS_AT_ONCE: Final = 512
"""Whose rows stay in the second cache from stage to stage; a multiple of any register's pixels."""
ROW: Final = PIXELS_AT_ONCE + 64
Room = Any


@njit(forceinline=True, error_model="numpy")
def put(bank: Bank, length: Length, room: Room, row: int, at: int) -> None:
    """Write as many planes as the tuple is long to the rows from `row` on, from pixel `at` on."""
    for k in range(len(length)):
        simd.store(room, (row + k) * ROW + at, bank[k])


@njit(forceinline=True, error_model="numpy")
def take(bank: Bank, length: Length, like: Plane, room: Room, row: int, at: int) -> None:
    """Read planes that `put` wrote."""
    for k in range(len(length)):
        bank[k] = simd.load(like, room, (row + k) * ROW + at)


@njit(forceinline=True, error_model="numpy")
def pack(mask: Mask, bank: Bank, length: Length, room: Room, row: int, at: int) -> None:
    """Write the pixels of a mask, without gaps."""
    for k in range(len(length)):
        simd.pack(room, (row + k) * ROW + at, mask, bank[k])


@njit(forceinline=True, error_model="numpy")
def unpack(mask: Mask, bank: Bank, length: Length, room: Room, row: int, at: int) -> None:
    """Put the pixels that `pack` wrote back in their places."""
    for k in range(len(length)):
        bank[k] = simd.unpack(room, (row + k) * ROW + at, mask, bank[k])
