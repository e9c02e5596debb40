"""Stages of the likelihood's kernel: each does a block of pixels, packed in rows (`packing`)."""

import math
from typing import Any, Final

from numba import njit

from transientcam_moments._kernels import simd
from transientcam_moments._kernels.arrays import Complexes, Counts, Reals
from transientcam_moments._kernels.fits import (
    DAMPING,
    fit,
    fit_again,
    fit_one,
    start_tail,
    step_tail,
    write,
)
from transientcam_moments._kernels.packing import ROW, pack, put, take, unpack
from transientcam_moments._kernels.portable import bank, infinity, product_bank, select, some
from transientcam_moments.arrays import Bank, Length, Mask, Plane
from transientcam_moments.likelihood import choice, sharp, start, tail

TAIL_ROUNDS: Final = (3, 3, choice.TAIL_STEPS - 6)
"""Steps of a tail after each of which the pixels are packed that go on."""
_FOUND: Final = (0,) * choice.PLANES
_STATE: Final = (0,) * 8
# Rows of a room: what was found, the state of the tail, points and weights of two returns, what an
# unknown has to gain (0 behind the last pixel), three more numbers of a pixel, and then the data.
_TAIL: Final = choice.PLANES
_POINTS: Final = _TAIL + 8
_PENALTY: Final = _POINTS + 6
_NUMBERS, _SCALE, _USABLE = _PENALTY + 1, _PENALTY + 2, _PENALTY + 3
_COST, _MOVING = _SCALE, _USABLE
"""Behind the first fit: what two returns leave, and the damping of their next step."""
_DATA: Final = _PENALTY + 4


@njit(forceinline=True, error_model="numpy")
def rows_of(order: Length) -> int:
    """Return how many rows a room has; the last ones hold the data, then their weights."""
    return _DATA + 3 * (len(order) + 1)


@njit(forceinline=True, error_model="numpy")
def _put_data(
    order: Length, data_r: Bank, data_i: Bank, weight: Bank, room: Reals, at: int
) -> None:
    size = len(order) + 1
    for j in range(size):
        simd.store(room, (_DATA + j) * ROW + at, data_r[j])
        simd.store(room, (_DATA + size + j) * ROW + at, data_i[j])
        simd.store(room, (_DATA + 2 * size + j) * ROW + at, weight[j])


@njit(forceinline=True, error_model="numpy")
def _take_data(
    order: Length, like: Plane, data_r: Bank, data_i: Bank, weight: Bank, room: Reals, at: int
) -> None:
    size = len(order) + 1
    for j in range(size):
        data_r[j] = simd.load(like, room, (_DATA + j) * ROW + at)
        data_i[j] = simd.load(like, room, (_DATA + size + j) * ROW + at)
        weight[j] = simd.load(like, room, (_DATA + 2 * size + j) * ROW + at)


@njit(forceinline=True, error_model="numpy")
def _pack_data(
    order: Length, mask: Mask, data_r: Bank, data_i: Bank, weight: Bank, room: Reals, at: int
) -> None:
    size = len(order) + 1
    for j in range(size):
        simd.pack(room, (_DATA + j) * ROW + at, mask, data_r[j])
        simd.pack(room, (_DATA + size + j) * ROW + at, mask, data_i[j])
        simd.pack(room, (_DATA + 2 * size + j) * ROW + at, mask, weight[j])


@njit(error_model="numpy")
def fit_first(
    order: Length, turns: Reals, b: Complexes, variance: Reals, error: float, first: int, last: int,
    end: int, threshold: float, all_rooms: Reals, rooms: Reals,
) -> int:  # fmt: skip
    """Fit one return to the pixels first..last; pack and count those that it leaves something of.

    `end` is behind the last pixel there is: the last vector ends there.
    """
    one = simd.ones(variance, 1)
    step = simd.width(one)
    data_r, data_i = bank(one, order, 1), bank(one, order, 1)
    rr, ri = bank(one, order, 1), bank(one, order, 1)
    pr, pi = bank(one, order, 0), bank(one, order, 0)
    weight, found = bank(one, order, 1), bank(one, (), 27)
    points = bank(one, (), 6)
    x, y, w = bank(one, (), 1), bank(one, (), 1), bank(one, (), 1)
    count = 0
    for left in range(first, last, step):
        scale, numbers, usable, penalty = fit_one(
            order, turns, b, variance, error, min(left, end - step), one, data_r, data_i, weight, x,
            y, w, pr, pi, rr, ri, threshold, found,
        )  # fmt: skip
        at = left - first
        put(found, _FOUND, all_rooms, 0, at)
        _put_data(order, data_r, data_i, weight, all_rooms, at)
        simd.store(all_rooms, _SCALE * ROW + at, scale)
        simd.store(all_rooms, _NUMBERS * ROW + at, numbers)
        simd.store(all_rooms, _PENALTY * ROW + at, penalty)
        simd.store(all_rooms, _USABLE * ROW + at, select(usable, one, 0.0))
        more = found[choice.SCORE] > 4.0 * penalty
        if some(more):
            points[0], points[1], points[2] = x[0], y[0], w[0]
            pack(more, points, (0, 0, 0), rooms, _POINTS, count)
            pack(more, found, _FOUND, rooms, 0, count)
            _pack_data(order, more, data_r, data_i, weight, rooms, count)
            simd.pack(rooms, _NUMBERS * ROW + count, more, numbers)
            count += simd.pack(rooms, _PENALTY * ROW + count, more, penalty)
    simd.store(rooms, _PENALTY * ROW + count, 0.0 * one)  # pixels behind are none
    return count


@njit(error_model="numpy")
def fit_second(
    order: Length, turns: Reals, threshold: float, rooms: Reals, count: int, late: Reals
) -> int:
    """Fit two returns, and first steps of a tail; pack and count the pixels that need more."""
    one = simd.ones(rooms, 1)
    data_r, data_i = bank(one, order, 1), bank(one, order, 1)
    rr, ri = bank(one, order, 1), bank(one, order, 1)
    pr, pi = product_bank(one, order, (0, 0)), product_bank(one, order, (0, 0))
    weight, found = bank(one, order, 1), bank(one, (), 27)
    points, state = bank(one, (), 6), bank(one, (), 8)
    x, y, w = bank(one, (), 2), bank(one, (), 2), bank(one, (), 2)
    moving = 0
    for at in range(0, count, simd.width(one)):
        take(found, _FOUND, one, rooms, 0, at)
        take(points, (0, 0, 0), one, rooms, _POINTS, at)
        _take_data(order, one, data_r, data_i, weight, rooms, at)
        penalty = simd.load(one, rooms, _PENALTY * ROW + at)
        numbers = simd.load(one, rooms, _NUMBERS * ROW + at)
        active = penalty > 0.0
        x[0], y[0], w[0] = points[0], points[1], points[2]
        cost, damping = fit(
            order, (0, 0), (0, 0, 0, 0), choice.STEPS[1], turns, data_r, data_i, weight, x, y, w,
            pr, pi, rr, ri, active, infinity(one),
        )  # fmt: skip
        allowed = active & (numbers >= 4.0)
        choice.offer_returns(
            order, (0, 0), (0, 0, 0, 0), weight, x, y, w, cost, penalty, threshold, allowed, found
        )
        put(found, _FOUND, rooms, 0, at)
        for k in range(2):
            points[3 * k], points[3 * k + 1], points[3 * k + 2] = x[k], y[k], w[k]
        put(points, (0, 0, 0, 0, 0, 0), rooms, _POINTS, at)
        simd.store(rooms, _COST * ROW + at, cost)
        simd.store(rooms, _MOVING * ROW + at, damping)
        start_tail(x, y, w, allowed, state)
        bar = choice.bar_of_tail(4, penalty, found)
        step_tail(
            order,
            choice.TAIL_SHAPES[0],
            (0, 0, 0, 0),
            TAIL_ROUNDS[0],
            0.0,
            data_r,
            data_i,
            weight,
            state,
            bar,
        )
        put(state, _STATE, rooms, _TAIL, at)
        moving += _pack_moving(order, one, data_r, data_i, weight, state, bar, late, moving)
    simd.store(late, (_TAIL + DAMPING) * ROW + moving, sharp.SETTLED * one)
    return moving


@njit(forceinline=True, error_model="numpy")
def _pack_moving(
    order: Length, one: Plane, data_r: Bank, data_i: Bank, weight: Bank, state: Bank, bar: Plane,
    late: Reals, at: int,
) -> Any:  # fmt: skip
    """Pack and count the pixels whose tail has not settled."""
    more = state[DAMPING] < sharp.SETTLED
    if not some(more):
        return 0
    pack(more, state, _STATE, late, _TAIL, at)
    _pack_data(order, more, data_r, data_i, weight, late, at)
    return simd.pack(late, _PENALTY * ROW + at, more, bar)


@njit(error_model="numpy")
def step_late(order: Length, steps: int, rooms: Reals, count: int, late: Reals) -> int:
    """Take further steps of tails; pack and count the pixels that need more."""
    one = simd.ones(rooms, 1)
    data_r, data_i = bank(one, order, 1), bank(one, order, 1)
    weight, state = bank(one, order, 1), bank(one, (), 8)
    moving = 0
    for at in range(0, count, simd.width(one)):
        take(state, _STATE, one, rooms, _TAIL, at)
        _take_data(order, one, data_r, data_i, weight, rooms, at)
        bar = simd.load(one, rooms, _PENALTY * ROW + at)
        step_tail(
            order, choice.TAIL_SHAPES[0], (0, 0, 0, 0), steps, 0.0, data_r, data_i, weight, state,
            bar,
        )  # fmt: skip
        put(state, _STATE, rooms, _TAIL, at)
        moving += _pack_moving(order, one, data_r, data_i, weight, state, bar, late, moving)
    simd.store(late, (_TAIL + DAMPING) * ROW + moving, sharp.SETTLED * one)
    return moving


@njit(error_model="numpy")
def bring_back(rooms: Reals, count: int, late: Reals) -> None:
    """Put the states of the tails that went on in `late` back among all."""
    one = simd.ones(rooms, 1)
    state = bank(one, (), 8)
    done = 0
    for at in range(0, count, simd.width(one)):
        take(state, _STATE, one, rooms, _TAIL, at)
        more = state[DAMPING] < sharp.SETTLED
        unpack(more, state, _STATE, late, _TAIL, done)
        put(state, _STATE, rooms, _TAIL, at)
        done += simd.count(more)


@njit(error_model="numpy")
def offer_tails(order: Length, rooms: Reals, count: int, third: Reals) -> int:
    """Choose tails where they are better, of further shapes where the first is not far worse.

    Pack and count the pixels that leave something then.
    """
    one = simd.ones(rooms, 1)
    data_r, data_i = bank(one, order, 1), bank(one, order, 1)
    weight, found = bank(one, order, 1), bank(one, (), 27)
    points, state, lone = bank(one, (), 6), bank(one, (), 8), bank(one, (), 8)
    packed = 0
    for at in range(0, count, simd.width(one)):
        take(found, _FOUND, one, rooms, 0, at)
        take(state, _STATE, one, rooms, _TAIL, at)
        penalty = simd.load(one, rooms, _PENALTY * ROW + at)
        numbers = simd.load(one, rooms, _NUMBERS * ROW + at)
        allowed = (penalty > 0.0) & (numbers >= 4.0)
        _take_data(order, one, data_r, data_i, weight, rooms, at)
        power = choice.TAIL_SHAPES[0]
        _offer_tail(order, power, data_r, data_i, weight, state, lone, penalty, allowed, found)
        worth = allowed & choice.worth_more_shapes(state[7], found)
        for k in range(1, len(choice.TAIL_SHAPES) if some(worth) else 0):
            power = choice.TAIL_SHAPES[k]
            state[4] = state[4] * (float(choice.TAIL_SHAPES[k - 1]) / float(power))
            state[DAMPING] = select(worth, sharp.FIRST_DAMPING * one, sharp.SETTLED)
            bar = choice.bar_of_tail(4, penalty, found)
            steps = choice.MORE_TAIL_STEPS
            step_tail(order, power, (0, 0, 0, 0), steps, 0.0, data_r, data_i, weight, state, bar)
            _offer_tail(order, power, data_r, data_i, weight, state, lone, penalty, worth, found)
        put(found, _FOUND, rooms, 0, at)
        moving = simd.load(one, rooms, _MOVING * ROW + at)
        more = _needs_more(found, penalty, numbers, moving)
        if some(more):
            simd.pack(third, _MOVING * ROW + packed, more, moving)
            take(points, (0, 0, 0, 0, 0, 0), one, rooms, _POINTS, at)
            pack(more, points, (0, 0, 0, 0, 0, 0), third, _POINTS, packed)
            pack(more, found, _FOUND, third, 0, packed)
            _pack_data(order, more, data_r, data_i, weight, third, packed)
            simd.pack(third, _NUMBERS * ROW + packed, more, numbers)
            simd.pack(third, _COST * ROW + packed, more, simd.load(one, rooms, _COST * ROW + at))
            packed += simd.pack(third, _PENALTY * ROW + packed, more, penalty)
    simd.store(third, _PENALTY * ROW + packed, 0.0 * one)
    return packed


@njit(error_model="numpy")
def _offer_tail(
    order: Length, power: int, data_r: Bank, data_i: Bank, weight: Bank, state: Bank, lone: Bank,
    penalty: Plane, allowed: Mask, found: Bank,
) -> None:  # fmt: skip
    """Offer what is in `state`, and one shape without a return, for which `lone` is room."""
    shapes = len(choice.TAIL_SHAPES)
    choice.offer_tail(
        order, power, (0, 0, 0, 0), weight, choice.PRIOR, shapes, state[0], state[1], state[2],
        state[3], state[4], state[5], state[7], penalty, allowed, found,
    )  # fmt: skip
    if power != choice.LONE_SHAPE:
        return
    x, y, d, t = choice.start_lone(power, state[0], state[1], state[2], state[3], state[4])
    lone[0], lone[1], lone[2], lone[3], lone[4], lone[5] = x, y, 0.0 * d, d, d, t
    lone[DAMPING] = select(allowed, sharp.FIRST_DAMPING + 0.0 * d, sharp.SETTLED)
    bar = choice.bar_of_tail(3, penalty, found)
    steps = choice.LONE_STEPS
    step_tail(order, power, (0, 0, 0, 0), steps, tail.LONE, data_r, data_i, weight, lone, bar)
    choice.join_lone(
        order, power, (0, 0, 0, 0), weight, choice.PRIOR, shapes, lone[0], lone[1], lone[2],
        lone[3], lone[4], lone[5], lone[7], penalty, allowed, found,
    )  # fmt: skip


@njit(forceinline=True, error_model="numpy")
def _needs_more(found: Bank, penalty: Plane, numbers: Plane, moving: Plane) -> Any:
    more = choice.worth_more_returns(penalty, found) | (moving < sharp.SETTLED)
    return (penalty > 0.0) & more & (numbers >= 4.0)


@njit(error_model="numpy")
def fit_third(
    order: Length, turns: Reals, half_turns: Reals, threshold: float, rooms: Reals, count: int
) -> None:
    """Fit two returns from another start, then three, and choose them where they are better."""
    one = simd.ones(rooms, 1)
    data_r, data_i = bank(one, order, 1), bank(one, order, 1)
    rr, ri = bank(one, order, 1), bank(one, order, 1)
    pr, pi = product_bank(one, order, (0, 0, 0)), product_bank(one, order, (0, 0, 0))
    weight, found = bank(one, order, 1), bank(one, (), 27)
    points = bank(one, (), 6)
    x, y, w = bank(one, (), 3), bank(one, (), 3), bank(one, (), 3)
    from_x, from_y = bank(one, (), 3), bank(one, (), 3)
    cosine, sine = math.cos(choice.SPLIT / len(order)), math.sin(choice.SPLIT / len(order))
    for at in range(0, count, simd.width(one)):
        take(found, _FOUND, one, rooms, 0, at)
        take(points, (0, 0, 0, 0, 0, 0), one, rooms, _POINTS, at)
        _take_data(order, one, data_r, data_i, weight, rooms, at)
        penalty = simd.load(one, rooms, _PENALTY * ROW + at)
        free = simd.load(one, rooms, _NUMBERS * ROW + at) - 4.0
        active = penalty > 0.0
        for k in range(2):
            x[k], y[k], w[k] = points[3 * k], points[3 * k + 1], points[3 * k + 2]
        cost, far = simd.load(one, rooms, _COST * ROW + at), infinity(one)
        moving = active & (simd.load(one, rooms, _MOVING * ROW + at) < sharp.SETTLED)
        tried, bar = cost, far
        for attempt in range(2):
            if attempt == 0:
                from_x[0], from_y[0], from_x[1], from_y[1] = x[0], y[0], x[1], y[1]
            else:
                choice.split(x, y, w, cosine, sine, from_x, from_y)
                bar = choice.bar_of_returns(4, penalty, found)
                moving = active & choice.missed(tried, free)
            if some(moving):
                tried = fit_again(
                    order, (0, 0), (0, 0, 0, 0), data_r, data_i, weight, from_x, from_y, x, y, w,
                    tried, moving, bar,
                )  # fmt: skip
        choice.offer_returns(
            order, (0, 0), (0, 0, 0, 0), weight, x, y, w, tried, penalty, threshold,
            active & (tried < cost - 1.0), found,
        )  # fmt: skip
        if len(order) >= 3:
            bar = choice.bar_of_returns(6, penalty, found)
            choice.split(x, y, w, cosine, sine, from_x, from_y)
            cost, damping = fit(
                order, (0, 0, 0), (0, 0, 0, 0, 0, 0), choice.STEPS[2], turns, data_r, data_i,
                weight, x, y, w, pr, pi, rr, ri, active, bar,
            )  # fmt: skip
            for attempt in range(3):
                again = active & choice.missed(cost, free - 2.0)
                if attempt == 1:
                    again = active & (damping < sharp.SETTLED)
                    for k in range(3):
                        from_x[k], from_y[k] = x[k], y[k]
                if not some(again):
                    continue
                if attempt == 2:
                    start.pisarenko(order, half_turns, data_r, data_i, from_x, from_y)
                cost = fit_again(
                    order, (0, 0, 0), (0, 0, 0, 0, 0, 0), data_r, data_i, weight, from_x, from_y, x,
                    y, w, cost, again, bar,
                )  # fmt: skip
            choice.offer_returns(
                order, (0, 0, 0), (0, 0, 0, 0, 0, 0), weight, x, y, w, cost, penalty, threshold,
                active & (free >= 2.0), found,
            )  # fmt: skip
        put(found, _FOUND, rooms, 0, at)


@njit(error_model="numpy")
def take_three(rooms: Reals, count: int, third: Reals) -> None:
    """Put what was found with three returns back among all that were fitted with two."""
    one = simd.ones(rooms, 1)
    found = bank(one, (), 27)
    done = 0
    for at in range(0, count, simd.width(one)):
        take(found, _FOUND, one, rooms, 0, at)
        penalty = simd.load(one, rooms, _PENALTY * ROW + at)
        numbers = simd.load(one, rooms, _NUMBERS * ROW + at)
        moving = simd.load(one, rooms, _MOVING * ROW + at)
        more = _needs_more(found, penalty, numbers, moving)
        unpack(more, found, _FOUND, third, 0, done)
        put(found, _FOUND, rooms, 0, at)
        done += simd.count(more)


@njit(error_model="numpy")
def finish(
    order: Length, slots: Length, all_rooms: Reals, rooms: Reals, first: int, last: int, end: int,
    planes: Reals, free: Counts, count: Counts,
) -> None:  # fmt: skip
    """Write what was found of the pixels first..last, with its deviations.

    In vectors as wide as those of `fit_first`, whose last one overlaps the one before.
    """
    one = simd.ones(planes, 1)
    step = simd.width(one)
    found = bank(one, (), 27)
    done = 0
    for left in range(first, last, step):
        at = left - first
        take(found, _FOUND, one, all_rooms, 0, at)
        penalty = simd.load(one, all_rooms, _PENALTY * ROW + at)
        more = found[choice.SCORE] > 4.0 * penalty
        if len(order) >= 2 and some(more):
            unpack(more, found, _FOUND, rooms, 0, done)
            done += simd.count(more)
        scale = simd.load(one, all_rooms, _SCALE * ROW + at)
        numbers = simd.load(one, all_rooms, _NUMBERS * ROW + at)
        usable = simd.load(one, all_rooms, _USABLE * ROW + at) > 0.0
        write(slots, found, scale, numbers, usable, min(left, end - step), planes, free, count)
