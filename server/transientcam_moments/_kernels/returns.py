"""Pisarenko's returns for one register of pixels at a time, expanded into the kernels.

``order`` is a tuple of length m; banks of registers are taken and filled.
"""

import numpy as np
from numba import njit

from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import (
    Complexes,
    ComplexPlanes,
    Counts,
    RealPlane,
    RealPlanes,
    Reals,
)
from transientcam_moments._kernels.moments import load_harmonics, load_zeroth
from transientcam_moments._kernels.portable import bank
from transientcam_moments.arrays import Length
from transientcam_moments.moment_problem import sparse

_INTERLEAVE = 2
_LATE = 1024  # pixels that are redone with more steps at a time
MOST_STEPS = 24
"""Of the iteration for roots, for pixels that need more than the others."""


@njit(nogil=True, error_model="numpy")
def _returns(
    order: Length,
    turns: Reals,
    b: Complexes,
    zeroth: Reals,
    apart: int,
    uniform: Reals,
    phase: Reals,
    weight: Reals,
    count: Counts,
    residual: Reals,
    noise: float,
    steps: int,
    start: int,
    stop: int,
) -> int:
    """Do as `find_returns` does, but with no more than ``steps`` towards the roots."""
    m = len(order)
    one = simd.ones(uniform, _INTERLEAVE)
    step = simd.width(one)
    re, im = bank(one, order, 1), bank(one, order, 1)
    phases, weights = bank(one, order, 0), bank(one, order, 0)
    explained = simd.spread(one, sparse.largest_residual(m, noise))
    ill = 0
    for left in range(start, stop, step):
        p = min(left, stop - step)
        re[0] = simd.load(one, zeroth, p) if apart else load_zeroth(one, b, p)
        load_harmonics(order, one, b, p, re, im)
        found, worst = sparse.returns(
            order, turns, steps, noise, one, simd.load(one, uniform, p), re, im, phases, weights
        )
        simd.store(count, p, found)
        simd.store(residual, p, worst)
        ill += simd.count(worst > explained)
        for i in range(m):
            simd.store(phase[i], p, phases[i])
            simd.store(weight[i], p, weights[i])
    return ill


@njit(nogil=True, error_model="numpy")
def find_returns(
    order: Length,
    turns: RealPlane,
    b: ComplexPlanes,
    zeroth: RealPlane,
    apart: int,
    uniform: RealPlane,
    phase: RealPlanes,
    weight: RealPlanes,
    count: Counts,
    residual: RealPlane,
    noise: float,
    steps: int,
    start: int,
    stop: int,
) -> int:
    """Write the returns of the pixels start..stop, whose smallest eigenvalues are known.

    b_0 comes from ``zeroth`` if it is ``apart``.

    ``noise`` is the precision of the data. ``residual`` becomes the error of all moments that
    the returns leave, relative to their sum; infinite where they could not be found, 0 where there
    is no light. Returns how many pixels have one larger than rounding explains.

    Pixels share registers, and each step is done for all of them. So after ``steps`` those that do
    not reproduce their moments are packed, and done again with as many as they need.
    """
    ill = _returns(
        order, turns, b, zeroth, apart, uniform, phase, weight, count, residual, noise,
        steps, start, stop,
    )  # fmt: skip
    if ill == 0 or steps >= MOST_STEPS:
        return ill
    m = len(order)
    tolerance = sparse.largest_residual(m, noise)
    where = np.empty(_LATE, np.int64)
    moments = np.empty((m + 1, _LATE), b.dtype)
    late_zeroth, late_uniform = np.empty(_LATE, uniform.dtype), np.empty(_LATE, uniform.dtype)
    late_phase = np.empty((m, _LATE), uniform.dtype)
    late_weight = np.empty_like(late_phase)
    late_count, late_residual = np.empty(_LATE, count.dtype), np.empty(_LATE, uniform.dtype)
    ill, begin = 0, start
    while begin < stop:
        late = 0
        while begin < stop and late < _LATE:
            where[late] = begin
            late += int(residual[begin] > tolerance)
            begin += 1
        whole = -(-late // LEAST_PIXELS) * LEAST_PIXELS
        for i in range(late, whole):
            where[i] = where[0]
        for i in range(whole):
            p = where[i]
            late_zeroth[i] = zeroth[p] if apart else b[0, p].real
            late_uniform[i] = uniform[p]
            for j in range(1, m + 1):
                moments[j, i] = b[j, p]
        _returns(
            order, turns, moments, late_zeroth, True, late_uniform, late_phase, late_weight,
            late_count, late_residual, noise, MOST_STEPS, 0, whole,
        )  # fmt: skip
        for i in range(late):
            p = where[i]
            count[p], residual[p] = late_count[i], late_residual[i]
            ill += int(residual[p] > tolerance)
            for k in range(m):
                phase[k, p], weight[k, p] = late_phase[k, i], late_weight[k, i]
    return ill


def usual_steps(m: int, precision: str) -> int:
    """Return how many steps towards the roots all pixels are given: nine of ten need no more.

    Fewest of processor time with m = 3, 4 and 8 in single precision (decision 11).
    """
    return (3 if m < 6 else 5) + (precision == "d")
