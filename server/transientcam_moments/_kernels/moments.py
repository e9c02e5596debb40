"""Moments of one register of pixels at a time, loaded into banks."""

from typing import Any

from numba import njit

from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import Complexes
from transientcam_moments.arrays import Bank, Length, Plane


@njit(forceinline=True, error_model="numpy")
def load_zeroth(one: Plane, b: Complexes, p: int) -> Any:
    """Load the real part of b_0, NaN where its imaginary part isn't finite."""
    b0, rest = simd.load_complex(one, b[0], p)
    return b0 + rest * 0.0


@njit(forceinline=True, error_model="numpy")
def load_harmonics(order: Length, one: Plane, b: Complexes, p: int, re: Bank, im: Bank) -> None:
    """Load b_1 .. b_m, and 0 as the imaginary part of b_0."""
    im[0] = one * 0.0
    for j in range(1, len(order) + 1):
        re[j], im[j] = simd.load_complex(one, b[j], p)
