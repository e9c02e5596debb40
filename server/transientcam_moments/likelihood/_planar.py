"""The fits of all pixels: each model where the simpler ones leave something to explain."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple, cast

import numpy as np

from transientcam_moments.arrays import Array, namespace, repeat, select, some
from transientcam_moments.likelihood import _sharp as sharp, _start as start, _tail as tail
from transientcam_moments.likelihood._choice import (
    DELAY_RAD,
    LATE_STEPS,
    LONE_SHAPE,
    LONE_STEPS,
    MORE_TAIL_STEPS,
    MOST_RETURNS,
    PLANES,
    PRIOR,
    SCORE,
    SPLIT,
    STEPS,
    TAIL_STEPS,
    bar_of_returns,
    bar_of_tail,
    join_lone,
    missed,
    nothing,
    offer_returns,
    offer_tail,
    split,
    start_lone,
    start_of_tail,
    turns_of,
    worth_more_returns,
    worth_more_shapes,
)
from transientcam_moments.moment_problem import half_turns

Planes = list[Array]
State = tuple[Any, ...]
"""Planes, and banks of planes."""


class Data(NamedTuple):
    """What is fitted: planes of pixels, the moments over `scale`.

    Attributes
    ----------
    re, im : m + 1 arrays, shape (P)
        0 where not measured.
    weight : m + 1 arrays, shape (P)
        Inverse variance of each part; 0 where not measured.
    penalty : array, shape (P)
        What an unknown has to lower chi-square by.
    numbers : array, shape (P)
        How many real numbers were measured.
    """

    re: Planes
    im: Planes
    weight: Planes
    penalty: Array
    numbers: Array


def fit(data: Data, most: int, shapes: tuple[int, ...], threshold: float) -> Planes:
    """Return what is found of every pixel: planes as `choice` lays them out.

    `most` is the largest number of sharp returns, 1 to 3; `shapes` are those of the tail, the first
    one tried first; `threshold` is that of the direct return.
    """
    m = len(data.re) - 1
    most = min(most, m)
    found = [data.re[0]] * PLANES
    far = np.inf + 0 * data.penalty
    nothing(data.penalty, far, found)
    one = SharpFit.start(data, 1, None, far)
    one.offer(found, data.numbers >= 0, threshold)
    if most < 2 and not (shapes and m >= 2):
        return found

    def of_two(data: Data, before: State, found: Planes) -> Planes:
        enough = data.numbers >= 4
        two = SharpFit.start(data, 2, before, np.inf + 0 * data.penalty)
        if most >= 2:
            two.offer(found, enough, threshold)
        late: State = ()
        if shapes:
            x1, y1, w, v, ratio, t = start_of_tail(two.x, two.y, two.w, DELAY_RAD)
            late = x1, y1, w, v, ratio * (DELAY_RAD / shapes[0]), t
            late = _fit_tail(data, late, shapes[0], TAIL_STEPS, len(shapes), found)

        def of_shapes(data: Data, before: State, found: Planes) -> Planes:
            state = before
            for last, shape in pairwise(shapes):
                state = *state[:4], state[4] * (last / shape), state[5]
                state = _fit_tail(data, state, shape, MORE_TAIL_STEPS, len(shapes), found)
            return found

        def of_more(data: Data, before: State, found: Planes) -> Planes:
            free = data.numbers - 4
            two, cost = SharpFit.of(data, *before), before[3]
            x, y = [cost] * 3, [cost] * 3
            far = np.inf + 0 * cost
            two.try_also(two.x, two.y, two.damping < sharp.SETTLED, far)
            apart = math.cos(SPLIT / m), math.sin(SPLIT / m)
            split(two.x, two.y, two.w, *apart, x, y)
            two.try_also(
                x[:2], y[:2], missed(two.cost, free), bar_of_returns(4, data.penalty, found)
            )
            if most >= 2:
                two.offer(found, (free >= 0) & (two.cost < cost - 1), threshold)
            if most >= MOST_RETURNS:
                bar = bar_of_returns(6, data.penalty, found)
                split(two.x, two.y, two.w, *apart, x, y)
                three = SharpFit.start(data, 3, two.state(), bar)
                moving = three.damping < sharp.SETTLED
                three.try_also(x, y, missed(three.cost, free - 2), bar)
                three.try_also(three.x, three.y, moving, bar)
                turns = namespace(cost).asarray(half_turns(m, cost.dtype))
                start.pisarenko(three.order, turns, list(data.re), list(data.im), x, y)
                three.try_also(x, y, missed(three.cost, free - 2), bar)
                three.offer(found, free >= 2, threshold)
            return found

        if len(shapes) > 1:
            worth = worth_more_shapes(late[6], found) & enough
            found = where(worth, of_shapes, data, late, found)
        still = (worth_more_returns(data.penalty, found) | (two.damping < sharp.SETTLED)) & enough
        return where(still, of_more, data, two.state(), found)

    # chi-square cannot become less than 0: no model with more unknowns is better below
    return where(found[SCORE] > 4 * data.penalty, of_two, data, one.state(), found)


def where(
    mask: Array,
    function: Callable[[Data, State, Planes], Planes],
    data: Data,
    before: State,
    found: Planes,
) -> Planes:
    """Apply a function of pixels to those of a mask; to all where arrays cannot be cut.

    It may change the planes that it is given.
    """
    xp = namespace(mask)
    branch = getattr(xp, "branch", None)  # of what isn't computed here
    if branch is not None:
        return cast(Planes, branch(mask, lambda: function(data, before, list(found)), found))
    if xp is not np:
        changed = function(data, before, list(found))
        return [xp.where(mask, new, old) for new, old in zip(changed, found, strict=True)]
    planes, at = np.stack(found), np.flatnonzero(mask)
    if at.size:
        planes[:, at] = function(Data._make(cut(data, at)), cut(before, at), cut(found, at))
    return list(planes)


def cut(state: Any, at: Array) -> Any:
    """Return the pixels `at` of planes, and of banks of planes."""
    if not isinstance(state, list | tuple):
        return state[at]
    parts = [cut(part, at) for part in state]
    return parts if isinstance(state, list) else tuple(parts)


class SharpFit:
    """A fit of K sharp returns: banks, as `sharp` takes them."""

    cost: Array
    damping: Array

    def __init__(
        self, data: Data, x: Sequence[Array], y: Sequence[Array], w: Sequence[Array]
    ) -> None:
        m, count = len(data.re) - 1, len(x)
        self.data = data
        self.order, self.returns = (0,) * m, (0,) * count
        self.unknowns = (0,) * (2 * count)
        self.x, self.y, self.w = list(x), list(y), list(w)
        self._pr, self._pi = ([data.re[0]] * (m * count) for _ in range(2))
        self._rr, self._ri = ([data.re[0]] * (m + 1) for _ in range(2))
        for k in range(count):
            sharp.powers(self.order, x[k], y[k], k, self._pr, self._pi)

    @classmethod
    def start(cls, data: Data, count: int, before: State | None, bar: Array) -> "SharpFit":
        """Add a return to those of another fit, and fit all of them; `bar` as in `sharp.judge`."""
        x, y, w = before[:3] if before else ((), (), ())
        point = cls(data, x, y, w).new_return()
        fit = cls(data, *([*old, new] for old, new in zip((x, y, w), point, strict=True)))
        fit._look()
        fit.improve(STEPS[count - 1], bar)
        return fit

    @classmethod
    def of(cls, data: Data, *state: Any) -> "SharpFit":
        """Return the fit that had a `state`."""
        fit = cls(data, *state[:3])
        fit.cost, fit.damping = state[3:]
        return fit

    @classmethod
    def at(cls, data: Data, x: Sequence[Array], y: Sequence[Array]) -> "SharpFit":
        """Begin with returns at points x + i y of the unit circle, and the best weights there."""
        fit = cls(data, x, y, x)
        given = (data.re, data.im, data.weight, fit._pr, fit._pi, fit.w)
        sharp.weigh(fit.order, fit.returns, *given)
        fit._look()
        return fit

    def improve(self, steps: int, bar: Array, active: Array | None = None) -> None:
        """Take at most so many steps to a lower chi-square, of the pixels that are `active`."""
        damping = sharp.FIRST_DAMPING + 0 * self.cost
        if active is not None:
            damping = select(active, damping, sharp.SETTLED)
        data = self.data
        state = repeat(
            _step_returns, steps, (self.order, self.returns, self.unknowns),
            (list(data.re), list(data.im), list(data.weight), bar),
            (damping < sharp.SETTLED, self._pr, self._pi, self.w, self._rr, self._ri, self.cost,
             damping),
            alike=True,
        )  # fmt: skip
        _, self._pr, self._pi, self.w, self._rr, self._ri, self.cost, self.damping = state
        self.x, self.y = (part[:: len(self.order)] for part in (self._pr, self._pi))

    def _look(self) -> None:
        """Find what the returns leave."""
        data, given = self.data, (self._pr, self._pi, self.w, self._rr, self._ri)
        sharp.remains(self.order, self.returns, data.re, data.im, *given)
        self.cost = sharp.chi_square(self.order, data.weight, self._rr, self._ri)

    def new_return(self) -> State:
        """Return point and weight of the best return for what these leave."""
        self._look()
        order, weight, xp = self.order, self.data.weight, namespace(self.cost)
        returns = (0,) * (len(self.returns) + 1)
        re, im = list(self._rr), list(self._ri)
        total = sharp.weigh_what_is_left(order, weight, self._rr, self._ri, re, im)
        kr, ki = ([total] * ((len(order) + 1) * len(returns)) for _ in range(2))
        sharp.overlaps(order, returns, weight, total, self._pr, self._pi, kr, ki)
        turns = xp.asarray(turns_of(len(order)).astype(total.dtype))

        zero = 0 * total
        best = zero, 1 + zero, 1 + zero, zero
        for row in range(len(turns)):
            best = sharp.try_phases(order, returns, turns, row, re, im, kr, ki, *best)
        along, apart, x, y = best
        return x, y, along / (apart * total)

    def state(self) -> State:
        """Return points, weights, chi-square and damping."""
        return self.x, self.y, self.w, self.cost, self.damping

    def try_also(self, x: list[Array], y: list[Array], where: Array, bar: Array) -> None:
        """Fit from other points on as well, and keep the better one, `where` that may help."""
        if not some(where):
            return
        other = SharpFit.at(self.data, x, y)
        other.improve(LATE_STEPS, bar, where)
        better = (other.cost < self.cost) & where
        for mine, theirs in ((self.x, other.x), (self.y, other.y), (self.w, other.w)):
            for k, plane in enumerate(theirs):
                mine[k] = select(better, plane, mine[k])
        self.cost = select(better, other.cost, self.cost)

    def offer(self, found: list[Array], allowed: Array, threshold: float) -> None:
        """Put the returns where they are the better model, and into the average."""
        offer_returns(
            self.order, self.returns, self.unknowns, self.data.weight, self.x, self.y, self.w,
            self.cost, self.data.penalty, threshold, allowed, found,
        )  # fmt: skip


def _fit_tail(
    data: Data, state: State, power: int, steps: int, shapes: int, found: Planes
) -> State:
    """Fit a return with a tail, put it where it is the better model, and into the average.

    So is one tail without a return. Returns what the first has become, and chi-square with the
    prior.
    """
    order, unknowns, weight = (0,) * (len(data.re) - 1), (0,) * 4, data.weight
    allowed = data.numbers >= 4
    state = _tail_of(data, state, power, steps, 0.0, bar_of_tail(4, data.penalty, found))
    x, y, w, v, d, t, cost = state
    offer_tail(
        order, power, unknowns, weight, PRIOR, shapes, x, y, w, v, d, t, cost, data.penalty,
        allowed, found,
    )  # fmt: skip
    if power != LONE_SHAPE:
        return state
    x, y, d, t = start_lone(power, x, y, w, v, d)
    bar = bar_of_tail(3, data.penalty, found)
    lone = _tail_of(data, (x, y, 0 * d, d, d, t), power, LONE_STEPS, tail.LONE, bar)
    x, y, w, v, d, t, cost = lone
    join_lone(
        order, power, unknowns, weight, PRIOR, shapes, x, y, w, v, d, t, cost, data.penalty,
        allowed, found,
    )  # fmt: skip
    return state


def _tail_of(data: Data, state: State, power: int, steps: int, lone: float, bar: Array) -> State:
    """Take at most so many steps of a tail."""
    x, y, w, v, d, t = state
    order, unknowns = (0,) * (len(data.re) - 1), (0,) * 4
    ur, ui, lag, qr, qi, rr, ri = ([d] * len(data.re) for _ in range(7))
    tail.shape(order, power, d, lag, qr, qi)
    tail.turn_back(order, data.re, data.im, x, y, ur, ui)
    w, v = tail.weigh(order, data.weight, lone, ur, ui, qr, qi)
    tail.remains(order, ur, ui, w, v, qr, qi, rr, ri)
    cost = sharp.chi_square(order, data.weight, rr, ri) + PRIOR * t * t
    damping = sharp.FIRST_DAMPING + 0 * cost
    found = repeat(
        _step_tail, steps, (order, power, unknowns, lone),
        (list(data.re), list(data.im), list(data.weight), bar),
        (damping < sharp.SETTLED, lag, qr, qi, rr, ri, x, y, w, v, d, t, cost, damping),
        alike=True,
    )  # fmt: skip
    return found[6:13]


def _step_returns(first: bool, fixed: State, given: State, state: State) -> State:
    _, pr, pi, w, rr, ri, cost, damping = state
    order, returns, unknowns = fixed
    re, im, weight, bar = given
    cost, damping = sharp.step(
        order, returns, unknowns, re, im, weight, pr, pi, w, rr, ri, cost, damping, bar
    )
    return damping < sharp.SETTLED, pr, pi, w, rr, ri, cost, damping


def _step_tail(first: bool, fixed: State, given: State, state: State) -> State:
    _, lag, qr, qi, rr, ri, x, y, w, v, d, t, cost, damping = state
    order, power, unknowns, lone = fixed
    re, im, weight, bar = given
    *found, damping = tail.step(
        order, power, unknowns, re, im, weight, PRIOR, lone, x, y, w, v, d, t, lag, qr, qi, rr, ri,
        cost, damping, bar,
    )  # fmt: skip
    return damping < sharp.SETTLED, lag, qr, qi, rr, ri, *found, damping
