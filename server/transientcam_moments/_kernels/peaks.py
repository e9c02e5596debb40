"""Local maxima of the maximum entropy density of every pixel (Sec. 5.3)."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once, empty
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import (
    Complexes,
    ComplexPlanes,
    RealPlane,
    RealPlanes,
    Reals,
)
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.portable import bank, not_a_number, select
from transientcam_moments.arrays import Length
from transientcam_moments.moment_problem import maxima

_INTERLEAVE = 2


@njit(nogil=True, error_model="numpy")
def _peaks(
    order: Length,
    polynomial: ComplexPlanes,
    reflection: ComplexPlanes,
    error: RealPlane,
    starts: RealPlane,
    threshold: float,
    first: RealPlane,
    strongest: RealPlane,
    phase: RealPlanes,
    height: RealPlanes,
    start: int,
    stop: int,
) -> None:
    """Write the peaks of the pixels start..stop."""
    m = len(order)
    one = simd.ones(error, _INTERLEAVE)
    step = simd.width(one)
    ar, ai = bank(one, order, 1), bank(one, order, 1)
    gr, gi = bank(one, order, 0), bank(one, order, 0)
    phases, heights = bank(one, order, 0), bank(one, order, 0)
    nothing = not_a_number(one)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        for j in range(m):
            ar[j + 1], ai[j + 1] = simd.load_complex(one, polynomial[j + 1], p)
            gr[j], gi[j] = simd.load_complex(one, reflection[j], p)
        maxima.peaks(
            order, starts, threshold, simd.load(one, error, p), ar, ai, gr, gi, phases, heights
        )
        highest = maxima.strongest(order, phases, heights)
        for k in range(m):
            simd.store(phase[k], p, select(heights[k] > 0.0, phases[k], nothing))
            simd.store(height[k], p, heights[k])
        simd.store(first, p, select(heights[0] > 0.0, phases[0], nothing))
        simd.store(strongest, p, select(heights[0] > 0.0, highest, nothing))


def peaks_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile the peaks of order m; see the table in ``_kernels``."""
    order = (0,) * m
    run = entry(_peaks, m, precision)
    starts = maxima.start_angles(m, precision)

    def kernel(
        polynomial: Complexes,
        reflection: Complexes,
        error: Reals,
        threshold: float,
        *,
        spread: Spread = at_once,
    ) -> tuple[Any, Any, Any, Any]:
        pixels = error.size
        a, g, scale = (np.ascontiguousarray(each) for each in (polynomial, reflection, error))
        first, strongest = empty(pixels, precision), empty(pixels, precision)
        phase, height = empty((m, pixels), precision), empty((m, pixels), precision)

        def part(start: int, stop: int) -> None:
            run(order, a, g, scale, starts, threshold, first, strongest, phase, height, start, stop)

        spread(part, pixels)
        return first, strongest, phase, height

    return kernel
