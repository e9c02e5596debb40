"""What a frame's pixels need besides coefficients and returns: flags, biasing, direct light."""

import numpy as np
from numba import njit

from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import (
    Complexes,
    ComplexPlanes,
    Counts,
    Flags,
    Places,
    RealPlane,
    RealPlanes,
    Reals,
    WideComplexPlanes,
    WideRealPlane,
    WideRealPlanes,
)
from transientcam_moments._kernels.moments import load_harmonics, load_zeroth
from transientcam_moments._kernels.portable import bank, not_a_number, select, some
from transientcam_moments.arrays import Length
from transientcam_moments.moment_problem import eigenvalue as eigenvalues, sparse

_INTERLEAVE = 2
# transientcam_moments.Flags
_BIASED, _NO_SIGNAL, _SATURATED, _NON_FINITE = 1.0, 2.0, 4.0, 8.0


@njit(nogil=True, error_model="numpy")
def flag_and_bias(
    order: Length,
    estimated: int,
    b: Complexes,
    saturated: Flags,
    eigenvalue: Reals,
    brightness: Reals,
    uniform: Reals,
    validity: Reals,
    flags: Flags,
    epsilon: float,
    least: float,
    start: int,
    stop: int,
) -> None:
    """Flag and bias the pixels start..stop, whose eigenvalues are known (Sec. 4.3).

    ``brightness`` and ``uniform`` become b_0 and the smallest eigenvalue after biasing.
    """
    one = simd.ones(eigenvalue, _INTERLEAVE)
    step = simd.width(one)
    re, im = bank(one, order, 1), bank(one, order, 1)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        smallest = simd.load(one, eigenvalue, p)
        re[0] = load_zeroth(one, b, p)
        if estimated:
            re[0], smallest = eigenvalues.least_zeroth(smallest, epsilon)
        load_harmonics(order, one, b, p, re, im)
        finite, dark, biased, valid, raised, rest = eigenvalues.margin(
            order, re, im, smallest, epsilon, least
        )
        flag = simd.load(one, saturated, p)
        flag = flag + select(finite, one * 0.0, _NON_FINITE)
        flag = flag + select(dark, _NO_SIGNAL * one, 0.0)
        flag = flag + select(biased, _BIASED * one, 0.0)
        simd.store(flags, p, flag)
        simd.store(validity, p, valid)
        simd.store(brightness, p, raised)
        simd.store(uniform, p, rest)


@njit(nogil=True, error_model="numpy")
def separate(
    order: Length,
    phase: RealPlanes,
    weight: RealPlanes,
    flags: Flags,
    direct: RealPlane,
    indirect: RealPlane,
    range_m: RealPlane,
    threshold: float,
    metres: float,
    start: int,
    stop: int,
) -> None:
    """Separate direct from indirect light: the first return above a threshold (Sec. 5.1)."""
    one = simd.ones(direct, _INTERLEAVE)
    step = simd.width(one)
    phases, weights = bank(one, order, 0), bank(one, order, 0)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        for i in range(len(order)):
            weights[i], phases[i] = simd.load(one, weight[i], p), simd.load(one, phase[i], p)
        first, rest, angle = sparse.separate(order, threshold, one, phases, weights)
        flag = simd.load(one, flags, p)
        invalid = flag >= _NON_FINITE
        flag = select(flag >= _SATURATED, flag - _SATURATED, flag)
        invalid = invalid | (flag >= _NO_SIGNAL)
        simd.store(direct, p, first)
        simd.store(indirect, p, rest)
        simd.store(range_m, p, select(invalid, not_a_number(one), angle * metres))


@njit(nogil=True, error_model="numpy")
def gather(
    order: Length, b: ComplexPlanes, brightness: RealPlane, residual: RealPlane, tolerance: float,
    ramp: RealPlane, packed: RealPlane, wide: WideComplexPlanes, where: Places, begin: int,
) -> int:  # fmt: skip
    """Collect pixels from ``begin`` on whose residual is above the tolerance, until room ends.

    Fills moments ``wide`` (m + 1, n) in double precision and their places ``where`` (n), both
    padded with the first one to as many as a kernel takes; returns the number of pixels. ``ramp``
    counts from 0, ``packed`` is room for as many.
    """
    room, found = where.shape[0], 0
    one = simd.ones(residual, _INTERLEAVE)
    step, limit = simd.width(one), simd.spread(one, tolerance)
    pixels = residual.shape[0]
    left = begin
    while left + step <= pixels and found + step <= room:
        chosen = simd.load(one, residual, left) > limit
        if some(chosen):
            for i in range(simd.pack(packed, 0, chosen, simd.load(one, ramp, 0))):
                where[found] = left + int(packed[i])
                found += 1
        left += step
    while left < pixels and found < room and pixels - left < step:
        if residual[left] > tolerance:
            where[found] = left
            found += 1
        left += 1
    for i in range(-(-found // LEAST_PIXELS) * LEAST_PIXELS):
        p = where[i] if i < found else where[0]
        where[i] = p
        wide[0, i] = brightness[p]
        for j in range(1, len(order) + 1):
            wide[j, i] = b[j, p]
    return found


@njit(nogil=True, error_model="numpy")
def scatter(
    order: Length, where: Places, found: int, wide_phase: WideRealPlanes, wide_weight:
    WideRealPlanes, wide_count: Counts, wide_residual: WideRealPlane, phase: RealPlanes, weight:
    RealPlanes, count: Counts, residual: RealPlane,
) -> None:  # fmt: skip
    """Put redone returns back where they came from."""
    for i in range(found):
        p = where[i]
        count[p] = wide_count[i]
        residual[p] = wide_residual[i]
        for k in range(len(order)):
            weight[k, p] = wide_weight[k, i]
            phase[k, p] = wide_phase[k, i]
            if phase[k, p] >= 2 * np.pi:  # rounded up
                phase[k, p] = 0.0
