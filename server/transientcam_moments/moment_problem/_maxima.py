"""Poles of the maximum entropy density, and its local maxima beside them (Sec. 5.3)."""

import numpy as np
from numpy.typing import DTypeLike

from transientcam_moments.arrays import (
    Array,
    Bank,
    Banks,
    Length,
    Mask,
    Pair,
    Plane,
    bank,
    close,
    eps,
    infinity,
    larger,
    largest,
    magnitude,
    repeat,
    root,
    root_eps,
    select,
    smaller,
    tiny,
)
from transientcam_moments.moment_problem._circle import phase_of
from transientcam_moments.moment_problem._sorting import sort
from transientcam_moments.moment_problem._toeplitz import least_modulus

POLE_STEPS = 80
"""Ten are usual; clusters need more."""
CLIMB_STEPS = 60


def poles(order: Length, starts: Array, ar: Bank, ai: Bank) -> tuple[Array, Array]:
    """Return banks of the roots of z^m + a_1 z^(m-1) + ... + a_m, all within the circle.

    The iteration of Ehrlich and Aberth: Newton's with the other roots divided out. ``starts`` is
    from `start_angles`.
    """
    m = len(order)
    most = ar[1] * ar[1] + ai[1] * ai[1]
    for j in range(2, m + 1):
        most = larger(most, ar[j] * ar[j] + ai[j] * ai[j])
    # no root is farther out than 2 max |a_j|^(1/j); a start on a circle of about the right size
    radius = smaller(root(most), most * 0.0 + 0.9) + 0.05
    zr, zi = bank(radius, order, 0), bank(radius, order, 0)
    for i in range(m):
        zr[i], zi[i] = radius * starts[i], radius * starts[m + i]
    state = radius <= radius, radius * 0.0 + infinity(radius), zr, zi  # NaN does not move
    found = repeat(move_poles, POLE_STEPS, (order,), (ar, ai), state)
    return found[2], found[3]


def move_poles(
    first: bool,
    fixed: tuple[Length],
    given: tuple[Bank, Bank],
    state: tuple[Mask, Plane, Bank, Bank],
) -> tuple[Mask, Plane, Bank, Bank]:
    """Take a step of `poles`; the state holds the size of the last one."""
    order = fixed[0]
    ar, ai = given
    moving, before, zr, zi = state
    m = len(order)
    sr, si = bank(before, order, 0), bank(before, order, 0)
    for i in range(m):
        sr[i], si[i] = 0.0 * zr[i], 0.0 * zr[i]
        for k in range(i):
            x, y = zr[i] - zr[k], zi[i] - zi[k]
            inverse = 1.0 / (x * x + y * y + tiny(x))  # none where roots coincide
            x, y = x * inverse, -y * inverse
            sr[i], si[i] = sr[i] + x, si[i] + y
            sr[k], si[k] = sr[k] - x, si[k] - y
    furthest = 0.0 * zr[0]
    for i in range(m):
        x, y = zr[i], zi[i]
        vr, vi = x + ar[1], y + ai[1]
        dr, di = 0.0 * x + 1.0, 0.0 * x
        for j in range(2, m + 1):  # Horner, with the derivative
            dr, di = dr * x - di * y + vr, dr * y + di * x + vi
            vr, vi = vr * x - vi * y + ar[j], vr * y + vi * x + ai[j]
        # Newton's w = p / p', corrected: w / (1 - w sum) = p / (p' - p sum)
        br, bi = dr - vr * sr[i] + vi * si[i], di - vr * si[i] - vi * sr[i]
        size = br * br + bi * bi
        inverse = select(moving & (size > 0.0), 1.0 / size, 0.0)
        cr, ci = (vr * br + vi * bi) * inverse, (vi * br - vr * bi) * inverse
        zr[i], zi[i] = x - cr, y - ci
        furthest = larger(cr * cr + ci * ci, furthest)
    last = root(furthest)
    # close roots are known to eps over their distance only: steps of that size go on for ever
    settled = (last < close(last)) & (last > 0.25 * before)
    return moving & (last > 4.0 * eps(last)) & ~settled, last, zr, zi


def shape(
    order: Length, zr: Bank, zi: Bank, x: Plane, y: Plane
) -> tuple[Plane, Plane, Plane, Plane]:
    """Return slope and curvature of log h at a point of the circle, and two of its distances.

    Those are the square of that to the nearest pole, and the product of the squares to all, the
    denominator of Eq. (2).
    """
    slope, curvature = x * 0.0, x * 0.0
    near = slope + infinity(x)
    modulus = slope + 1.0
    for k in range(len(order)):
        ur, ui = x - zr[k], y - zi[k]
        distance = ur * ur + ui * ui
        modulus = modulus * distance
        distance = larger(distance, 4.0 * tiny(x))
        inverse = 1.0 / distance
        rr, ri = (x * ur + y * ui) * inverse, (y * ur - x * ui) * inverse  # z / (z - p)
        slope = slope + 2.0 * ri
        # d/dphi z / (z - p) = -i z p / (z - p)^2 and p / (z - p) = z / (z - p) - 1
        curvature = curvature - 2.0 * (rr * (rr - 1.0) - ri * ri)
        near = smaller(near, distance)
    return slope, curvature, near, modulus


def climb(order: Length, zr: Bank, zi: Bank, x: Plane, y: Plane) -> Pair:
    """Climb from the angle of a pole to the top of log h = const - sum log |z - p|^2."""
    size = root(x * x + y * y)
    inverse = select(size > 0.0, 1.0 / size, 0.0)
    x, y = select(size > 0.0, x * inverse, 1.0), y * inverse
    found = repeat(climb_once, CLIMB_STEPS, (order,), (zr, zi), (size <= size, x, y))
    return found[1], found[2]


def climb_once(
    first: bool, fixed: tuple[Length], given: Banks, state: tuple[Mask, Plane, Plane]
) -> tuple[Mask, Plane, Plane]:
    """Take a step of `climb`: Newton's where log h is concave, as a rotation."""
    moving, x, y = state
    slope, curvature, near, _ = shape(fixed[0], given[0], given[1], x, y)
    reach = 0.5 * root(near)
    concave = curvature < 0.0
    newton = slope / select(concave, -curvature, 1.0)
    uphill = select(concave, newton, select(slope > 0.0, reach, -reach))
    turn = smaller(larger(uphill, -reach), reach)
    turn = select(moving, turn, 0.0)
    half = 0.5 * turn
    shrink = 1.0 / (1.0 + half * half)
    c, s = (1.0 - half * half) * shrink, turn * shrink
    return moving & (magnitude(turn) > 4.0 * eps(turn)), x * c - y * s, x * s + y * c


def drop(order: Length, keys: Bank, values: Bank, threshold: float) -> None:
    """Drop what was found twice and what is too low: phases ``keys`` ascend, unused ones last.

    Heights ``values`` of unused ones are 0, and their phases infinite.
    """
    m = len(order)
    kept = bank(values[0], order, 0)
    same = 2.0 * root_eps(values[0])
    strongest = values[0]
    for k in range(1, m):
        strongest = larger(values[k], strongest)
    for k in range(m):
        before, alone = keys[m - 1] - 2.0 * np.pi, values[m - 1] <= 0.0
        if k > 0:
            before, alone = keys[k - 1], values[k - 1] <= 0.0
        fresh = alone | (keys[k] - before > same)
        kept[k] = select(fresh & (values[k] >= threshold * strongest), values[k], 0.0)
    for k in range(m):
        values[k] = kept[k]
        keys[k] = select(values[k] > 0.0, keys[k], infinity(values[k]))


def peaks(
    order: Length,
    starts: Array,
    threshold: float,
    error: Plane,
    ar: Bank,
    ai: Bank,
    gr: Bank,
    gi: Bank,
    phases: Bank,
    heights: Bank,
) -> None:
    """Fill ``phases`` with those of the peaks, ascending, and ``heights`` with the density there.

    Unused ones come last: of infinite phase, and height 0. E, polynomial and reflection
    coefficients are those of Eq. (2).
    """
    floor = least_modulus(order, gr, gi)
    scale = error * (0.5 / np.pi)
    zr, zi = poles(order, starts, ar, ai)
    for k in range(len(order)):
        x, y = climb(order, zr, zi, zr[k], zi[k])
        _, curvature, _, modulus = shape(order, zr, zi, x, y)
        top = smaller(scale / larger(modulus, floor), largest(scale))
        used = (curvature < -root_eps(scale)) & (top > 0.0)  # curved by more than rounding
        phases[k] = select(used, phase_of(x, y), infinity(scale))
        heights[k] = select(used, top, 0.0)
    sort(order, phases, heights)
    drop(order, phases, heights, threshold)
    sort(order, phases, heights)


def strongest(order: Length, phases: Bank, heights: Bank) -> Plane:
    """Return the phase of the highest peak, infinite without any."""
    best, where = heights[0], phases[0]
    for k in range(1, len(order)):
        higher = heights[k] > best
        best, where = larger(heights[k], best), select(higher, phases[k], where)
    return where


def start_angles(m: int, precision: DTypeLike) -> Array:
    """Return cos and sin of where the search for m poles starts, one after the other."""
    angle = 2 * np.pi * np.arange(m) / m + 0.4
    return np.concatenate([np.cos(angle), np.sin(angle)]).astype(precision)
