"""From smoothed moments to returns, block by block in one call.

Three kernels that are called from Python one after the other, a block of pixels at a time, acquire
the interpreter's lock after each of them; for all pixels at a time, each finds what the one before
wrote in memory instead of the caches (decision 11).
"""

from collections.abc import Callable
from typing import Any, Final

from numba import njit

from transientcam_moments._kernels.arrays import ComplexPlanes, Counts, Flags, RealPlane, RealPlanes
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.eigenvalue import smallest_eigenvalue
from transientcam_moments._kernels.outputs import flag_and_bias
from transientcam_moments._kernels.returns import find_returns
from transientcam_moments.arrays import Length

_BLOCK: Final = 4096
"""Pixels, of which a thread's own cache holds all that the kernels read and write."""


@njit(nogil=True, error_model="numpy")
def _analyse(
    order: Length, turns: RealPlane, estimated: int, b: ComplexPlanes, saturated: Flags, eigenvalue:
    RealPlane, brightness: RealPlane, uniform: RealPlane, validity: RealPlane, flags: Flags,
    epsilon: float, least: float, phase: RealPlanes, weight: RealPlanes, count: Counts, residual:
    RealPlane, noise: float, steps: int, start: int, stop: int,
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
    entry(smallest_eigenvalue, m, "f")  # which are linked, and kept for other kernels anyway
    entry(find_returns, m, "f")
    return entry(_analyse, m, "f")
