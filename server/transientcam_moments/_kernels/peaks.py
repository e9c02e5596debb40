"""Local maxima of the maximum entropy density, a register of pixels at a time (Sec. 5.3).

The search of ``transientcam_moments.peaks``: poles of the density by simultaneous iteration, a
climb from the angle of each, and what was found twice or is too low left out.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once, empty
from transientcam_moments._kernels import simd, toeplitz
from transientcam_moments._kernels.compiled_entry import (
    PIXELS,
    REAL,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.returns import phase_of, sort

_INTERLEAVE = 2
_POLE_STEPS = 80  # ten are usual; clusters need more
_CLIMB_STEPS = 60


@njit(forceinline=True, error_model="numpy")
def _poles(order: Any, ar: Any, ai: Any, starts: Any, zr: Any, zi: Any, sr: Any, si: Any) -> None:
    """Fill ``zr``, ``zi`` with the roots of z^m + a_1 z^(m-1) + ... + a_m, all within the circle.

    The iteration of Ehrlich and Aberth: Newton's with the other roots divided out. ``starts`` holds
    cos and sin of m angles; ``sr``, ``si`` are room for sums.
    """
    m = len(order)
    largest = ar[1] * ar[1] + ai[1] * ai[1]
    for j in range(2, m + 1):
        largest = simd.maximum(largest, ar[j] * ar[j] + ai[j] * ai[j])
    # no root is farther out than 2 max |a_j|^(1/j); a start on a circle of about the right size
    radius = simd.minimum(simd.sqrt(largest), largest * 0.0 + 0.9) + 0.05
    for i in range(m):
        zr[i], zi[i] = radius * starts[i], radius * starts[m + i]
    rounding = 4.0 * simd.eps(radius)
    before = simd.infinity(radius)
    moving = radius == radius
    for _ in range(_POLE_STEPS):
        for i in range(m):
            sr[i], si[i] = radius * 0.0, radius * 0.0
            for k in range(i):
                x, y = zr[i] - zr[k], zi[i] - zi[k]
                inverse = 1.0 / (x * x + y * y + simd.tiny(x))  # none where roots coincide
                x, y = x * inverse, -y * inverse
                sr[i], si[i] = sr[i] + x, si[i] + y
                sr[k], si[k] = sr[k] - x, si[k] - y
        furthest = radius * 0.0
        for i in range(m):
            x, y = zr[i], zi[i]
            vr, vi = x + ar[1], y + ai[1]
            dr, di = radius * 0.0 + 1.0, radius * 0.0
            for j in range(2, m + 1):  # Horner, with the derivative
                dr, di = dr * x - di * y + vr, dr * y + di * x + vi
                vr, vi = vr * x - vi * y + ar[j], vr * y + vi * x + ai[j]
            # Newton's w = p / p', corrected: w / (1 - w sum) = p / (p' - p sum)
            br, bi = dr - vr * sr[i] + vi * si[i], di - vr * si[i] - vi * sr[i]
            size = br * br + bi * bi
            inverse = simd.select(moving & (size > 0.0), 1.0 / size, 0.0)
            cr, ci = (vr * br + vi * bi) * inverse, (vi * br - vr * bi) * inverse
            zr[i], zi[i] = x - cr, y - ci
            furthest = simd.maximum(cr * cr + ci * ci, furthest)
        last = simd.sqrt(furthest)
        # close roots are known to eps over their distance only: steps of that size go on for ever
        settled = (last < simd.close(last)) & (last > 0.25 * before)
        moving = moving & (last > rounding) & ~settled
        before = last
        if not simd.some(moving):
            break


@njit(forceinline=True, error_model="numpy")
def _shape(order: Any, zr: Any, zi: Any, x: Any, y: Any) -> Any:
    """Return slope and curvature of log h at a point of the circle, and the nearest pole's |.|^2.

    The third, prod |z - p|^2, is the denominator of Eq. (2).
    """
    slope, curvature, near = x * 0.0, x * 0.0, simd.infinity(x)
    modulus = slope + 1.0
    for k in range(len(order)):
        ur, ui = x - zr[k], y - zi[k]
        distance = ur * ur + ui * ui
        modulus = modulus * distance
        distance = simd.maximum(distance, 4.0 * simd.tiny(x))
        inverse = 1.0 / distance
        rr, ri = (x * ur + y * ui) * inverse, (y * ur - x * ui) * inverse  # z / (z - p)
        slope = slope + 2.0 * ri
        # d/dphi z / (z - p) = -i z p / (z - p)^2 and p / (z - p) = z / (z - p) - 1
        curvature = curvature - 2.0 * (rr * (rr - 1.0) - ri * ri)
        near = simd.minimum(near, distance)
    return slope, curvature, near, modulus


@njit(forceinline=True, error_model="numpy")
def _climb(order: Any, zr: Any, zi: Any, x: Any, y: Any) -> Any:
    """Climb from the angle of a pole to the top of log h = const - sum log |z - p|^2."""
    size = simd.sqrt(x * x + y * y)
    inverse = simd.select(size > 0.0, 1.0 / size, 0.0)
    x, y = simd.select(size > 0.0, x * inverse, 1.0), y * inverse
    tolerance = 4.0 * simd.eps(x)
    moving = size == size
    for _ in range(_CLIMB_STEPS):
        slope, curvature, near, _ = _shape(order, zr, zi, x, y)
        reach = 0.5 * simd.sqrt(near)
        concave = curvature < 0.0
        newton = slope / simd.select(concave, -curvature, 1.0)
        uphill = simd.select(concave, newton, simd.select(slope > 0.0, reach, -reach))
        turn = simd.minimum(simd.maximum(uphill, -reach), reach)
        turn = simd.select(moving, turn, 0.0)
        half = 0.5 * turn
        shrink = 1.0 / (1.0 + half * half)
        c, s = (1.0 - half * half) * shrink, turn * shrink
        x, y = x * c - y * s, x * s + y * c
        moving = moving & (simd.absolute(turn) > tolerance)
        if not simd.some(moving):
            break
    return x, y


@njit(forceinline=True, error_model="numpy")
def _drop(order: Any, keys: Any, values: Any, kept: Any, threshold: float) -> None:
    """Drop what was found twice and what is too low: phases ``keys`` ascend, unused ones last."""
    m = len(order)
    same = 2.0 * simd.nearly(values[0])
    strongest = values[0]
    for k in range(1, m):
        strongest = simd.maximum(values[k], strongest)
    least = threshold * strongest
    for k in range(m):
        before, alone = keys[m - 1] - 2.0 * np.pi, values[m - 1] <= 0.0
        if k > 0:
            before, alone = keys[k - 1], values[k - 1] <= 0.0
        fresh = alone | (keys[k] - before > same)
        kept[k] = simd.select(fresh & (values[k] >= least), values[k], 0.0)
    for k in range(m):
        values[k] = kept[k]
        keys[k] = simd.select(values[k] > 0.0, keys[k], simd.infinity(same))


@njit(nogil=True, error_model="numpy")
def _peaks(
    order: Any,
    polynomial: Any,
    reflection: Any,
    error: Any,
    starts: Any,
    threshold: float,
    first: Any,
    strongest: Any,
    phase: Any,
    height: Any,
    start: int,
    stop: int,
) -> None:
    """Write the peaks of the pixels start..stop."""
    m = len(order)
    one = simd.ones(error, _INTERLEAVE)
    step = simd.width(one)
    ar, ai = simd.registers(one, order, 1), simd.registers(one, order, 1)
    zr, zi = simd.registers(one, order, 0), simd.registers(one, order, 0)
    sr, si = simd.registers(one, order, 0), simd.registers(one, order, 0)
    kept = simd.registers(one, order, 0)
    nothing = simd.nan(one)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        floor = simd.eps(one)
        for j in range(m):
            ar[j + 1], ai[j + 1] = simd.load_complex(one, polynomial[j + 1], p)
            x, y = simd.load_complex(one, reflection[j], p)
            floor = floor * toeplitz.below_one(x, y)  # eps E / b_0
        _poles(order, ar, ai, starts, zr, zi, sr, si)
        scale = simd.load(one, error, p) * (0.5 / np.pi)
        for k in range(m):
            x, y = _climb(order, zr, zi, zr[k], zi[k])
            _, curvature, _, modulus = _shape(order, zr, zi, x, y)
            top = simd.minimum(scale / simd.maximum(modulus, floor), simd.largest(one))
            used = (curvature < -simd.nearly(one)) & (top > 0.0)
            sr[k] = simd.select(used, phase_of(x, y), simd.infinity(one))
            si[k] = simd.select(used, top, 0.0)
        sort(order, sr, si)
        _drop(order, sr, si, kept, threshold)
        sort(order, sr, si)
        best, where = si[0], sr[0]
        for k in range(m):
            higher = si[k] > best
            best, where = simd.maximum(si[k], best), simd.select(higher, sr[k], where)
            found = si[k] > 0.0
            simd.store(phase[k], p, simd.select(found, sr[k], nothing))
            simd.store(height[k], p, si[k])
        simd.store(first, p, simd.select(si[0] > 0.0, sr[0], nothing))
        simd.store(strongest, p, simd.select(best > 0.0, where, nothing))


def start_angles(m: int, precision: str) -> Any:
    """Return cos and sin of where the search for m poles starts, one after the other."""
    angle = 2 * np.pi * np.arange(m) / m + 0.4
    return np.concatenate([np.cos(angle), np.sin(angle)]).astype(precision)


def peaks_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile the peaks of order m; see the table in ``_kernels``."""
    order = (0,) * m
    real, cplx = real_arrays(precision), complex_arrays(precision)
    run = entry(
        _peaks,
        order_type(m), cplx[2], cplx[2], real[1], real[1], REAL,
        real[1], real[1], real[2], real[2], PIXELS, PIXELS,
    )  # fmt: skip
    starts = start_angles(m, precision)

    def lane(
        polynomial: Any,
        reflection: Any,
        error: Any,
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

    return lane
