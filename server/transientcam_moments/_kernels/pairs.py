"""Two returns by all pairs: `transientcam_moments.likelihood.pairs` in lanes."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from transientcam_moments._kernels import simd
from transientcam_moments._kernels.compiled_entry import (
    COUNTS,
    PIXELS,
    REAL,
    complex_arrays,
    entry,
    order_type,
    real_arrays,
)
from transientcam_moments._kernels.likelihood import fit_one, portable, write
from transientcam_moments._kernels.parallel import Spread, at_once
from transientcam_moments.likelihood import choice, sharp
from transientcam_moments.likelihood.choice import SCORE
from transientcam_moments.likelihood.pairs import COINCIDE, FIRST_STEPS, LAST_STEPS, STARTS, grid

__all__ = ["pairs_lane", "portable"]  # which gives the fits' arithmetic its meaning


@njit(error_model="numpy")
def _project(
    order: Any, turns: Any, data_r: Any, data_i: Any, weight: Any, along: Any, alike: Any
) -> None:
    """Put the moments' projections on returns at the phases of the grid in `along`, twice over.

    In `alike`, what returns so many steps apart have in common, from 0 to half a turn.
    """
    m, count = len(order), turns.shape[1]
    total = weight[0]
    for j in range(1, m + 1):
        total = total + weight[j]
    inverse = 1.0 / total
    for g in range(count):
        found, common = weight[0] * data_r[0], weight[0]
        for j in range(1, m + 1):
            c, s = turns[0, (j * g) % count], turns[1, (j * g) % count]
            found = found + weight[j] * (data_r[j] * c + data_i[j] * s)
            common = common + weight[j] * c
        along[g], along[count + g] = found * inverse, found * inverse
        alike[g] = common * inverse


@njit(forceinline=True, error_model="numpy")
def _fill_row(count: int, apart: int, along: Any, alike: Any, rows: Any) -> None:
    """Put what pairs so many steps apart explain in their row, by the first one's phase."""
    row = (apart % 3) * (count + 2) + 1
    s = alike[apart]
    inverse = simd.select(s * s < COINCIDE, 1.0 / (1.0 - s * s), 0.0)
    for g in range(count):
        a, b = along[g], along[g + apart]
        left_a, left_b = a - s * b, b - s * a  # in the signs of the weights
        explained = (a * left_a + b * left_b) * inverse
        rows[row + g] = simd.select((left_a > 0.0) & (left_b > 0.0), explained, 0.0)
    rows[row - 1], rows[row + count] = rows[row + count - 1], rows[row]


@njit(forceinline=True, error_model="numpy")
def _keep_peaks(count: int, apart: int, rows: Any, gains: Any, pairs: Any) -> None:
    """Insert the pairs of a row that explain more than those beside them, the best ones first.

    A pair is its steps apart times the phases of the grid, and the place of its first phase.
    """
    width = count + 2
    row = (apart % 3) * width + 1
    before, after = (apart + 2) % 3 * width + 1, (apart + 1) % 3 * width + 1
    for g in range(count):
        gain = rows[row + g]
        peak = gain > gains[STARTS - 1]
        if not simd.some(peak):
            continue
        peak = peak & (gain >= rows[row + g + 1]) & (gain >= rows[row + g - 1])
        if apart > 1:
            peak = peak & (gain >= rows[before + g])
        if apart < count // 2:
            peak = peak & (gain >= rows[after + g])
        if not simd.some(peak):
            continue
        gain = simd.select(peak, gain, 0.0)
        pair = 0.0 * gain + float(apart * count + g)
        for k in range(STARTS):
            better = gain > gains[k]
            gain, gains[k] = (
                simd.select(better, gains[k], gain),
                simd.select(better, gain, gains[k]),
            )
            pair, pairs[k] = (
                simd.select(better, pairs[k], pair),
                simd.select(better, pair, pairs[k]),
            )


@njit(error_model="numpy")
def _search(
    order: Any, turns: Any, data_r: Any, data_i: Any, weight: Any, along: Any, alike: Any,
    rows: Any, gains: Any, pairs: Any,
) -> None:  # fmt: skip
    """Put the pairs on the grid that explain most in `pairs`."""
    count = turns.shape[1]
    half = count // 2
    zero = 0.0 * weight[0]
    for k in range(STARTS):
        gains[k], pairs[k] = zero, zero + float(half * count)
    _project(order, turns, data_r, data_i, weight, along, alike)
    for apart in range(1, half + 2):
        if apart <= half:
            _fill_row(count, apart, along, alike, rows)
        if apart > 1:
            _keep_peaks(count, apart - 1, rows, gains, pairs)


@njit(forceinline=True, error_model="numpy")
def _begin(turns: Any, pair: Any, room: Any, x: Any, y: Any) -> None:
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
    order: Any, steps: int, data_r: Any, data_i: Any, weight: Any, x: Any, y: Any, w: Any, rr: Any,
    ri: Any, active: Any,
) -> Any:  # fmt: skip
    """Take at most so many steps from two returns on; return chi-square."""
    for j in range(len(order) + 1):
        rr[j], ri[j] = data_r[j], data_i[j]
    sharp.weigh(order, (0, 0), data_r, data_i, weight, x, y, w)
    for k in range(2):
        sharp.take_away(order, x[k], y[k], w[k], rr, ri)
    cost = sharp.chi_square(order, weight, rr, ri)
    damping = simd.select(active, sharp.FIRST_DAMPING + 0.0 * cost, sharp.SETTLED)
    far = simd.infinity(cost)
    for _ in range(steps):
        if not simd.some(damping < sharp.SETTLED):
            break
        cost, damping = sharp.step(
            order, (0, 0), (0, 0, 0, 0), data_r, data_i, weight, x, y, w, rr, ri, cost, damping, far
        )
    return cost


@njit(nogil=True, error_model="numpy")
def fit_pairs(
    order: Any, starts: Any, cosine: float, sine: float, turns: Any, b: Any, variance: Any,
    error: float, planes: Any, free: Any, count: Any, start: int, stop: int,
) -> None:  # fmt: skip
    """Write the estimate of the pixels start..stop; two returns where one leaves enough.

    ``starts`` is a tuple of length `STARTS`.
    """
    one = simd.ones(variance, 1)
    step, far = simd.width(one), simd.infinity(one)
    data_r, data_i = simd.registers(one, order, 1), simd.registers(one, order, 1)
    rr, ri = simd.registers(one, order, 1), simd.registers(one, order, 1)
    weight, found = simd.registers(one, order, 1), simd.registers(one, (), 22)
    x, y, w = simd.registers(one, (), 2), simd.registers(one, (), 2), simd.registers(one, (), 2)
    bx, by = simd.registers(one, (), 2), simd.registers(one, (), 2)
    # 8 m phases, or 24: (m + 8)^2 are enough for two turns, and (m + 12)^2 for three rows
    along, alike = simd.matrix(one, order, 8), simd.matrix(one, order, 4)
    rows = simd.matrix(one, order, 12)
    gains, pairs = simd.registers(one, starts, 0), simd.registers(one, starts, 0)
    room = np.empty((4, step), turns.dtype)
    for left in range(start, stop, step):
        p = min(left, stop - step)
        scale, numbers, usable, penalty = fit_one(
            order, cosine, sine, b, variance, error, p, one, data_r, data_i, weight, x, y, w, rr,
            ri, found,
        )  # fmt: skip
        more = (found[SCORE] > 4.0 * penalty) & (numbers >= 4.0)
        if simd.some(more):
            _search(order, turns, data_r, data_i, weight, along, alike, rows, gains, pairs)
            best = far
            for k in range(STARTS):
                _begin(turns, pairs[k], room, x, y)
                cost = _polish(order, FIRST_STEPS, data_r, data_i, weight, x, y, w, rr, ri, more)
                better = cost < best
                best = simd.select(better, cost, best)
                for i in range(2):
                    bx[i] = simd.select(better, x[i], bx[i]) if k > 0 else x[i]
                    by[i] = simd.select(better, y[i], by[i]) if k > 0 else y[i]
            cost = _polish(order, LAST_STEPS, data_r, data_i, weight, bx, by, w, rr, ri, more)
            choice.offer_returns(
                order, (0, 0), (0, 0, 0, 0), weight, bx, by, w, cost, penalty, more, found
            )
        write((0, 0), found, scale, numbers, usable, p, planes, free, count)


def pairs_lane(m: int, precision: str) -> Callable[..., Any]:
    """Compile the estimate of order m, 2 or more; see the table in ``_kernels``."""
    order, starts = (0,) * m, (0,) * STARTS
    real, cplx = real_arrays(precision), complex_arrays(precision)
    run = entry(
        fit_pairs,
        order_type(m), order_type(STARTS), REAL, REAL, real[2], cplx[2], real[2], REAL, real[2],
        COUNTS, COUNTS, PIXELS, PIXELS,
    )  # fmt: skip
    turn = 2 * np.pi / choice.phases_of(m)
    cosine, sine = float(np.cos(turn)), float(np.sin(turn))
    phase = grid(m)
    turns = np.stack([np.cos(phase), np.sin(phase)]).astype(precision)

    def lane(b: Any, variance: Any, error: float, *, spread: Spread = at_once) -> tuple[Any, ...]:
        pixels = b.shape[1]
        moments, noise = np.ascontiguousarray(b), np.ascontiguousarray(variance)
        planes = np.empty((13, pixels), precision)
        free, count = np.empty(pixels, np.int32), np.empty(pixels, np.int32)

        def part(start: int, stop: int) -> None:
            run(
                order, starts, cosine, sine, turns, moments, noise, error, planes, free, count,
                start, stop,
            )  # fmt: skip

        spread(part, pixels)
        return (*(planes[2 * k : 2 * k + 2] for k in range(4)), *planes[8:], free, count)

    return lane
