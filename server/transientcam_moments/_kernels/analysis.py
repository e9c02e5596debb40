"""From smoothed moments to returns, block by block in one call.

Three kernels that are called from Python one after the other, a block of pixels at a time, acquire
the interpreter's lock after each of them; for all pixels at a time, each finds what the one before
wrote in memory instead of the caches (decision 11).
"""

from collections.abc import Callable
from typing import Any, Final

from numba import njit

from transientcam_moments._kernels.arrays import Complexes, Counts, Flags, Reals
from transientcam_moments._kernels.compiled_entry import (
    BYTES,
    COUNTS,
    PIXELS,
    REAL,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.eigenvalue import eigenvalue_entry, smallest_eigenvalue
from transientcam_moments._kernels.outputs import flag_and_bias
from transientcam_moments._kernels.returns import find_returns, returns_entry
from transientcam_moments.arrays import Length

_BLOCK: Final = 4096
"""Pixels, of which a thread's own cache holds all that the kernels read and write."""


@njit(nogil=True, error_model="numpy")
def _analyse(
    order: Length, turns: Reals, estimated: bool, b: Complexes, saturated: Flags, eigenvalue: Reals,
    brightness: Reals, uniform: Reals, validity: Reals, flags: Flags, epsilon: float, least: float,
    phase: Reals, weight: Reals, count: Counts, residual: Reals, noise: float, steps: int,
    start: int, stop: int,
) -> None:  # fmt: skip
    """Do as `smallest_eigenvalue`, `flag_and_bias` and `find_returns` do one after the other."""
    left = start
    while left < stop:
        right = left + _BLOCK if stop - left >= 2 * _BLOCK else stop
        smallest_eigenvalue(order, b, estimated, eigenvalue, left, right)
        flag_and_bias(
            order, estimated, b, saturated, eigenvalue, brightness, uniform, validity, flags,
            epsilon, least, left, right,
        )  # fmt: skip
        find_returns(
            order, turns, b, brightness, 1, uniform, phase, weight, count, residual, noise, steps,
            left, right,
        )  # fmt: skip
        left = right


def analysis_entry(m: int) -> Callable[..., Any]:
    """Compile the kernel of order m in single precision."""
    eigenvalue_entry(m, "f")  # which are linked, as they are kept for other lanes anyway
    returns_entry(m, "f")
    plane, planes, moments = real_arrays("f")[1], real_arrays("f")[2], complex_arrays("f")[2]
    return entry(
        _analyse,
        order_type(m), plane, PIXELS, moments, BYTES, plane, plane, plane, plane, BYTES, REAL, REAL,
        planes, planes, COUNTS, plane, REAL, PIXELS, PIXELS, PIXELS,
    )  # fmt: skip
