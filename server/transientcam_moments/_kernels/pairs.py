"""Two returns by all pairs: `transientcam_moments.two_returns` in kernels."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_compiled import Spread, at_once
from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import (
    Complexes,
    ComplexPlanes,
    Counts,
    Places,
    RealPlanes,
    Reals,
)
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments._kernels.fits import fit_one, portable, write
from transientcam_moments._kernels.portable import bank, infinity, larger, select, some, square_bank
from transientcam_moments.arrays import Bank, Length, Mask, Plane
from transientcam_moments.likelihood import (
    COINCIDE,
    FINALISTS,
    FIRST_STEPS,
    LAST_STEPS,
    LEAST_GAIN,
    PEAKS,
    STARTS,
    choice,
    grid,
    least_alike,
    pair_fit,
    sharp,
)

__all__ = ["pairs_kernel", "portable"]  # which gives the fits' arithmetic its meaning


@njit(error_model="numpy")
def _project(
    places: Places, turns: Reals, data_r: Bank, data_i: Bank, share: Bank, along: Bank, alike: Bank
) -> Any:
    """Put the moments' projections on returns at the phases of the grid in `along`, twice over.

    In `alike`, what returns so many steps apart have in common, from 0 to half a turn. Returns what
    a pair has to explain.
    """
    count = turns.shape[1]
    none = 0.0 * share[0]
    squared, most = none, none
    for k in range(len(places)):
        squared = squared + share[k] * (data_r[k] * data_r[k] + data_i[k] * data_i[k])
    for g in range(count):
        found, common = none, none
        for k in range(len(places)):
            at = (places[k] * g) % count
            c, s = turns[0, at], turns[1, at]
            found = found + share[k] * (data_r[k] * c + data_i[k] * s)
            common = common + share[k] * c
        along[g], along[count + g] = found, found
        most = larger(found, most)
        if g <= count // 2:
            alike[g] = common
    return larger(LEAST_GAIN * squared, most * most)


@njit(forceinline=True, error_model="numpy")
def _fill_row(count: int, apart: int, along: Bank, alike: Bank, rows: Bank) -> None:
    """Put what pairs so many steps apart explain in their row, by the first one's phase."""
    row = (apart % 3) * (count + 2) + 1
    s = alike[apart]
    inverse = select(s * s < COINCIDE, 1.0 / (1.0 - s * s), 0.0)
    for g in range(count):
        a, b = along[g], along[g + apart]
        left_a, left_b = a - s * b, b - s * a  # in the signs of the weights
        explained = (a * left_a + b * left_b) * inverse
        rows[row + g] = select((left_a > 0.0) & (left_b > 0.0), explained, 0.0)
    rows[row - 1], rows[row + count] = rows[row + count - 1], rows[row]


@njit(forceinline=True, error_model="numpy")
def _insert(gain: Plane, pair: Plane, gains: Bank, pairs: Bank, size: int) -> None:
    """Insert pairs in lists of the best ones, of so many each."""
    for k in range(size):
        better = gain > gains[k]
        gain, gains[k] = select(better, gains[k], gain), select(better, gain, gains[k])
        pair, pairs[k] = select(better, pairs[k], pair), select(better, pair, pairs[k])


@njit(forceinline=True, error_model="numpy")
def _keep_peaks(
    count: int, apart: int, rows: Bank, row_gains: Bank, row_pairs: Bank, gains: Bank, pairs: Bank
) -> None:
    """Insert the best pairs of a row that explain more than those beside them.

    A pair is its steps apart times the phases of the grid, and the place of its first phase.
    """
    width = count + 2
    row = (apart % 3) * width + 1
    before, after = (apart + 2) % 3 * width + 1, (apart + 1) % 3 * width + 1
    for k in range(PEAKS):
        row_gains[k], row_pairs[k] = gains[STARTS - 1], pairs[STARTS - 1]
    for g in range(count):
        gain = rows[row + g]
        peak = gain > row_gains[PEAKS - 1]
        if not some(peak):
            continue
        peak = peak & (gain >= rows[row + g + 1]) & (gain >= rows[row + g - 1])
        if apart > 1:
            peak = peak & (gain >= rows[before + g])
        if apart < count // 2:
            peak = peak & (gain >= rows[after + g])
        if some(peak):
            pair = 0.0 * gain + float(apart * count + g)
            _insert(select(peak, gain, 0.0), pair, row_gains, row_pairs, PEAKS)
    for k in range(PEAKS):
        if some(row_gains[k] > gains[STARTS - 1]):
            _insert(row_gains[k], row_pairs[k], gains, pairs, STARTS)


@njit(error_model="numpy")
def _search(
    places: Places, turns: Reals, data_r: Bank, data_i: Bank, share: Bank, along: Bank, alike: Bank,
    rows: Bank, row_gains: Bank, row_pairs: Bank, gains: Bank, pairs: Bank,
) -> None:  # fmt: skip
    """Put the pairs on the grid that explain most in `pairs`."""
    count = turns.shape[1]
    half = count // 2
    least = _project(places, turns, data_r, data_i, share, along, alike)
    for k in range(STARTS):
        gains[k], pairs[k] = least, 0.0 * least + float(half * count)
    for apart in range(1, half + 2):
        if apart <= half:
            _fill_row(count, apart, along, alike, rows)
        if apart > 1:
            _keep_peaks(count, apart - 1, rows, row_gains, row_pairs, gains, pairs)


@njit(forceinline=True, error_model="numpy")
def _points(turns: Reals, pair: Plane, room: Reals, x: Bank, y: Bank) -> None:
    """Put the points of the unit circle of a pair on the grid in `x` and `y`."""
    count = turns.shape[1]
    simd.store(room[0], 0, pair)
    for i in range(room.shape[1]):
        apart, first = divmod(int(room[0, i]), count)
        for k in range(2):
            room[2 * k, i] = turns[0, (first + k * apart) % count]
            room[2 * k + 1, i] = turns[1, (first + k * apart) % count]
    for k in range(2):
        x[k], y[k] = simd.load(pair, room[2 * k], 0), simd.load(pair, room[2 * k + 1], 0)


@njit(error_model="numpy")
def _polish(
    places: Places, steps: int, data_r: Bank, data_i: Bank, weight: Bank, share: Bank, x: Bank,
    y: Bank, w: Bank, room: tuple[Bank, ...], active: Mask,
) -> Any:  # fmt: skip
    """Take at most so many steps from two returns on; return chi-square."""
    pr, pi, tx, ty, tw, tr, ti = room
    cost = pair_fit.begin(places, data_r, data_i, weight, share, x, y, w, pr, pi)
    far = infinity(cost)
    damping = pair_fit.first_damping(active, cost)
    for _ in range(steps):
        if not some(damping < sharp.SETTLED):
            break
        cost, damping = pair_fit.step(
            places, data_r, data_i, weight, share, x, y, w, pr, pi, tx, ty, tw, tr, ti, cost,
            damping, far,
        )  # fmt: skip
    return cost


@njit(forceinline=True, error_model="numpy")
def _keep_finalist(cost: Plane, x: Bank, y: Bank, costs: Bank, points: Bank) -> None:
    """Insert a fit in the list of the best ones; each has four coordinates in `points`."""
    a, b, c, d = x[0], y[0], x[1], y[1]
    for k in range(FINALISTS):
        better = cost < costs[k]
        cost, costs[k] = select(better, costs[k], cost), select(better, cost, costs[k])
        i = 4 * k
        a, points[i] = select(better, points[i], a), select(better, a, points[i])
        i += 1
        b, points[i] = select(better, points[i], b), select(better, b, points[i])
        i += 1
        c, points[i] = select(better, points[i], c), select(better, c, points[i])
        i += 1
        d, points[i] = select(better, points[i], d), select(better, d, points[i])


@njit(error_model="numpy")
def _choose(
    places: Places, same: float, data_r: Bank, data_i: Bank, weight: Bank, share: Bank,
    costs: Bank, points: Bank, x: Bank, y: Bank, w: Bank, bx: Bank, by: Bank, bw: Bank,
    directs: Bank, room: tuple[Bank, ...], active: Mask,
) -> Any:  # fmt: skip
    """Polish the finalists, put the best one in `bx`, `by`, `bw`; return its cost and lead."""
    far = infinity(weight[0])
    best, bx_direct, by_direct = far, 0.0 * weight[0], 0.0 * weight[0]
    for f in range(FINALISTS):
        for k in range(2):
            x[k], y[k] = points[4 * f + 2 * k], points[4 * f + 2 * k + 1]
        _polish(places, LAST_STEPS, data_r, data_i, weight, share, x, y, w, room, active)
        # anew: the last step before may have been damped
        cost = _polish(places, FIRST_STEPS, data_r, data_i, weight, share, x, y, w, room, active)
        dx, dy = pair_fit.direct(x, y, w)
        costs[f], directs[2 * f], directs[2 * f + 1] = cost, dx, dy
        better = cost < best
        best = select(better, cost, best)
        bx_direct, by_direct = (select(better, dx, bx_direct), select(better, dy, by_direct))
        for k in range(2):
            bx[k] = select(better, x[k], bx[k]) if f > 0 else x[k]
            by[k] = select(better, y[k], by[k]) if f > 0 else y[k]
            bw[k] = select(better, w[k], bw[k]) if f > 0 else w[k]
    second = far
    for f in range(FINALISTS):
        other = directs[2 * f] * bx_direct + directs[2 * f + 1] * by_direct < same
        second = select(other & (costs[f] < second), costs[f], second)
    return best, second - best


@njit(nogil=True, error_model="numpy")
def fit_pairs(
    order: Length, lists: tuple[Length, ...], places: Places, first_turns: RealPlanes, same: float,
    turns: RealPlanes, b: ComplexPlanes, variance: RealPlanes, error: float, threshold: float,
    planes: RealPlanes, free: Counts, count: Counts, start: int, stop: int,
) -> None:  # fmt: skip
    """Write the estimate of the pixels start..stop; two returns where one leaves enough.

    ``lists`` is a tuple of tuples as long as the powers of two returns, `STARTS`, `PEAKS`,
    `FINALISTS`, and four times that.
    """
    one = simd.ones(variance, 1)
    step, far = simd.width(one), infinity(one)
    data_r, data_i = bank(one, order, 1), bank(one, order, 1)
    rr, ri = bank(one, order, 1), bank(one, order, 1)
    pr, pi = bank(one, order, 0), bank(one, order, 0)
    weight, found = bank(one, order, 1), bank(one, (), 27)
    kr, ki = bank(one, order, 1), bank(one, order, 1)
    kw, share = bank(one, order, 1), bank(one, order, 1)
    x, y, w = bank(one, (), 2), bank(one, (), 2), bank(one, (), 2)
    bx, by, bw = bank(one, (), 2), bank(one, (), 2), bank(one, (), 2)
    room = (
        bank(one, lists[0], 0), bank(one, lists[0], 0),
        bank(one, (), 2), bank(one, (), 2), bank(one, (), 2),
        bank(one, lists[0], 0), bank(one, lists[0], 0),
    )  # fmt: skip
    # 8 m phases, or 24: (m + 8)^2 are enough for two turns, and (m + 12)^2 for three rows
    along, alike = square_bank(one, order, 8), square_bank(one, order, 4)
    rows = square_bank(one, order, 12)
    gains, pairs = bank(one, lists[1], 0), bank(one, lists[1], 0)
    row_gains, row_pairs = bank(one, lists[2], 0), bank(one, lists[2], 0)
    costs, directs = bank(one, lists[3], 0), bank(one, lists[4], 0)
    points = bank(one, lists[4], 0)
    scalars = np.empty((4, step), turns.dtype)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        scale, numbers, usable, penalty = fit_one(
            order, first_turns, b, variance, error, p, one, data_r, data_i, weight, x, y, w, pr,
            pi, rr, ri, threshold, found,
        )  # fmt: skip
        lead = far
        more = (found[choice.SCORE] > 4.0 * penalty) & (numbers >= 4.0)
        if some(more):
            total = 0.0 * one
            for k in range(len(places)):
                j = places[k]
                kr[k], ki[k], kw[k] = data_r[j], data_i[j], weight[j]
                total = total + weight[j]
            inverse = 1.0 / total
            for k in range(len(places)):
                share[k] = kw[k] * inverse
            _search(
                places, turns, kr, ki, share, along, alike, rows, row_gains, row_pairs, gains, pairs
            )
            for k in range(FINALISTS):
                costs[k] = far
            for k in range(STARTS):
                _points(turns, pairs[k], scalars, x, y)
                cost = _polish(places, FIRST_STEPS, kr, ki, kw, share, x, y, w, room, more)
                _keep_finalist(cost, x, y, costs, points)
            cost, lead = _choose(
                places, same, kr, ki, kw, share, costs, points, x, y, w, bx, by, bw, directs, room,
                more,
            )  # fmt: skip
            choice.offer_returns(
                order, (0, 0), (0, 0, 0, 0), weight, bx, by, bw, cost, penalty, threshold, more,
                found,
            )  # fmt: skip
            lead = select(found[choice.COUNT] == 2.0, lead, far)
        write((0, 0), found, scale, numbers, usable, p, planes, free, count)
        simd.store(planes[16], p, lead)


def pairs_kernel(m: int, precision: str) -> Callable[..., Any]:
    """Compile the estimate of order m, 2 or more; see the table in ``_kernels``."""
    order = (0,) * m
    sizes = (2 * (m + 1), STARTS, PEAKS, FINALISTS, 4 * FINALISTS)
    lists = tuple((0,) * size for size in sizes)
    run = entry(fit_pairs, m, precision, lists=sizes)
    first_turns = choice.turns_of(m).astype(precision)
    phase, same = grid(m), least_alike(m)
    turns = np.stack([np.cos(phase), np.sin(phase)]).astype(precision)

    def kernel(
        b: Complexes, variance: Reals, error: float, threshold: float, *, spread: Spread = at_once
    ) -> tuple[Any, ...]:
        pixels = b.shape[1]
        moments, noise = np.ascontiguousarray(b), np.ascontiguousarray(variance)
        places = np.array([j for j, plane in enumerate(noise) if plane.any()], np.int64)
        planes = np.empty((17, pixels), precision)
        free, count = np.empty(pixels, np.int32), np.empty(pixels, np.int32)

        def part(start: int, stop: int) -> None:
            run(
                order, lists, places, first_turns, same, turns, moments, noise, error, threshold,
                planes, free, count, start, stop,
            )  # fmt: skip

        spread(part, pixels)
        return (
            *(planes[2 * k : 2 * k + 2] for k in range(4)),
            *planes[8:13],
            free,
            count,
            *planes[13:15],
            planes[15].astype(np.int32),
            planes[16],
        )

    return kernel
