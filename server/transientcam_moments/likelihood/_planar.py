"""The fits of all pixels: each model where the simpler ones leave something to explain."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from transientcam_moments.arrays import Array, namespace, some
from transientcam_moments.likelihood import (
    _sharp as sharp,
    _start as start,
    _tail as tail,
)
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


class Data(NamedTuple):
    """What is fitted: planes of pixels, the moments over `scale`.

    Attributes
    ----------
    re, im : array, shape (m + 1, P)
        0 where not measured.
    weight : array, shape (m + 1, P)
        Inverse variance of each part; 0 where not measured.
    penalty : array, shape (P)
        What an unknown has to lower chi-square by.
    numbers : array, shape (P)
        How many real numbers were measured.
    """

    re: Array
    im: Array
    weight: Array
    penalty: Array
    numbers: Array


def fit(data: Data, most: int, shapes: tuple[int, ...], threshold: float) -> Array:
    """Return what is found of every pixel (PLANES, P), as `choice` lays it out.

    `most` is the largest number of sharp returns, 1 to 3; `shapes` are those of the tail, the first
    one tried first; `threshold` is that of the direct return.
    """
    xp = namespace(data.re)
    m = data.re.shape[0] - 1
    most = min(most, m)
    found = [data.re[0]] * PLANES
    far = np.inf + 0 * data.penalty
    nothing(data.penalty, far, found)
    one = SharpFit.start(data, 1, None, far)
    one.offer(found, data.numbers >= 0, threshold)
    planes = xp.stack(found)
    if most < 2 and not (shapes and m >= 2):
        return planes

    def of_two(data: Data, before: tuple[Array, ...], planes: Array) -> Array:
        found = list(planes)
        enough = data.numbers >= 4
        two = SharpFit.start(data, 2, before, np.inf + 0 * data.penalty)
        if most >= 2:
            two.offer(found, enough, threshold)
        late: tuple[Array, ...] = ()
        if shapes:
            x1, y1, w, v, ratio, t = start_of_tail(two.x, two.y, two.w, DELAY_RAD)
            late = x1, y1, w, v, ratio * (DELAY_RAD / shapes[0]), t
            late = _fit_tail(data, late, shapes[0], TAIL_STEPS, len(shapes), found)

        def of_shapes(data: Data, before: tuple[Array, ...], planes: Array) -> Array:
            found, state = list(planes), before
            for last, shape in pairwise(shapes):
                state = *state[:4], state[4] * (last / shape), state[5]
                state = _fit_tail(data, state, shape, MORE_TAIL_STEPS, len(shapes), found)
            return xp.stack(found)

        def of_more(data: Data, before: tuple[Array, ...], planes: Array) -> Array:
            found, free = list(planes), data.numbers - 4
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
                turns = xp.asarray(half_turns(m, data.re.dtype))
                start.pisarenko(three.order, turns, list(data.re), list(data.im), x, y)
                three.try_also(x, y, missed(three.cost, free - 2), bar)
                three.offer(found, free >= 2, threshold)
            return xp.stack(found)

        done = xp.stack(found)
        if len(shapes) > 1:
            worth = worth_more_shapes(late[6], done) & enough
            done = where(worth, of_shapes, data, late, done)
        still = (
            worth_more_returns(data.penalty, list(done)) | (two.damping < sharp.SETTLED)
        ) & enough
        return where(still, of_more, data, two.state(), done)

    # chi-square cannot become less than 0: no model with more unknowns is better below
    return where(planes[SCORE] > 4 * data.penalty, of_two, data, one.state(), planes)


def where(
    mask: Array,
    function: Callable[[Data, tuple[Array, ...], Array], Array],
    data: Data,
    before: tuple[Array, ...],
    planes: Array,
) -> Array:
    """Apply a function of pixels to those of a mask; to all where arrays cannot be cut."""
    if namespace(mask) is not np:
        return namespace(mask).where(mask, function(data, before, planes), planes)
    at = np.flatnonzero(mask)
    if at.size:
        planes[:, at] = function(
            Data(*(part[..., at] for part in data)),
            tuple(part[..., at] for part in before),
            planes[:, at],
        )
    return planes


class SharpFit:
    """A fit of K sharp returns: banks, as `sharp` takes them."""

    cost: Array
    damping: Array

    def __init__(
        self, data: Data, x: Sequence[Array], y: Sequence[Array], w: Sequence[Array]
    ) -> None:
        m, count = data.re.shape[0] - 1, len(x)
        self.data = data
        self.order, self.returns = (0,) * m, (0,) * count
        self.unknowns = (0,) * (2 * count)
        self.x, self.y, self.w = list(x), list(y), list(w)
        self._pr, self._pi = ([data.re[0]] * (m * count) for _ in range(2))
        self._rr, self._ri = ([data.re[0]] * (m + 1) for _ in range(2))
        for k in range(count):
            sharp.powers(self.order, x[k], y[k], k, self._pr, self._pi)

    @classmethod
    def start(
        cls, data: Data, count: int, before: tuple[Array, ...] | None, bar: Array
    ) -> "SharpFit":
        """Add a return to those of another fit, and fit all of them; `bar` as in `sharp.judge`."""
        x, y, w = before[:3] if before else ((), (), ())
        point = cls(data, x, y, w).new_return()
        fit = cls(data, *([*old, new] for old, new in zip((x, y, w), point, strict=True)))
        fit._look()
        fit.improve(STEPS[count - 1], bar)
        return fit

    @classmethod
    def of(cls, data: Data, *state: Array) -> "SharpFit":
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
        data = self.data

        def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
            pr, pi, w, rr, ri = (list(part) for part in state[:5])
            cost, damping = sharp.step(
                self.order, self.returns, self.unknowns, data.re, data.im, data.weight,
                pr, pi, w, rr, ri, state[5], state[6], bar,
            )  # fmt: skip
            return tuple(pr), tuple(pi), tuple(w), tuple(rr), tuple(ri), cost, damping

        banks = (tuple(part) for part in (self._pr, self._pi, self.w, self._rr, self._ri))
        damping = sharp.FIRST_DAMPING + 0 * self.cost
        if active is not None:
            damping = namespace(damping).where(active, damping, sharp.SETTLED + 0 * damping)
        state = _times(steps, step, (*banks, self.cost, damping), _moving)
        self._pr, self._pi, self.w, self._rr, self._ri = (list(part) for part in state[:5])
        self.x, self.y = (list(part[:: len(self.order)]) for part in (self._pr, self._pi))
        self.cost, self.damping = state[5:]

    def _look(self) -> None:
        """Find what the returns leave."""
        data, given = self.data, (self._pr, self._pi, self.w, self._rr, self._ri)
        sharp.remains(self.order, self.returns, data.re, data.im, *given)
        self.cost = sharp.chi_square(self.order, data.weight, self._rr, self._ri)

    def new_return(self) -> tuple[Array, Array, Array]:
        """Return point and weight of the best return for what these leave."""
        self._look()
        order, weight, xp = self.order, self.data.weight, namespace(self.cost)
        returns = (0,) * (len(self.returns) + 1)
        re, im = list(self._rr), list(self._ri)
        total = sharp.weigh_what_is_left(order, weight, self._rr, self._ri, re, im)
        kr, ki = ([total] * ((len(order) + 1) * len(returns)) for _ in range(2))
        sharp.overlaps(order, returns, weight, total, self._pr, self._pi, kr, ki)
        turns = xp.asarray(turns_of(len(order)).astype(total.dtype))

        def attempt(state: tuple[Array, ...]) -> tuple[Array, ...]:
            row = state[0]
            best = sharp.try_phases(order, returns, turns, row, re, im, kr, ki, *state[1:])
            return row + 1, *best

        zero = 0 * total
        state = _times(len(turns), attempt, (0, zero, 1 + zero, 1 + zero, zero))
        _, along, apart, x, y = state
        return x, y, along / (apart * total)

    def state(self) -> tuple[Array, ...]:
        """Return points, weights, chi-square and damping."""
        xp = namespace(self.cost)
        return *(xp.stack(part) for part in (self.x, self.y, self.w)), self.cost, self.damping

    def try_also(self, x: list[Array], y: list[Array], where: Array, bar: Array) -> None:
        """Fit from other points on as well, and keep the better one, `where` that may help."""
        xp = namespace(self.cost)
        if not some(where):
            return
        other = SharpFit.at(self.data, x, y)
        other.improve(LATE_STEPS, bar, where)
        better = (other.cost < self.cost) & where
        for mine, theirs in ((self.x, other.x), (self.y, other.y), (self.w, other.w)):
            for k, plane in enumerate(theirs):
                mine[k] = xp.where(better, plane, mine[k])
        self.cost = xp.where(better, other.cost, self.cost)

    def offer(self, found: list[Array], allowed: Array, threshold: float) -> None:
        """Put the returns where they are the better model, and into the average."""
        offer_returns(
            self.order, self.returns, self.unknowns, self.data.weight, self.x, self.y, self.w,
            self.cost, self.data.penalty, threshold, allowed, found,
        )  # fmt: skip


def _fit_tail(
    data: Data, state: tuple[Array, ...], power: int, steps: int, shapes: int, found: list[Array]
) -> tuple[Array, ...]:
    """Fit a return with a tail, put it where it is the better model, and into the average.

    So is one tail without a return. Returns what the first has become, and chi-square with the
    prior.
    """
    given: tuple[Any, ...] = (0,) * (len(data.re) - 1), power, (0,) * 4, data.weight, PRIOR, shapes
    allowed = data.numbers >= 4
    state = _tail_of(data, state, power, steps, 0.0, bar_of_tail(4, data.penalty, found))
    offer_tail(*(*given, *state, data.penalty, allowed, found))
    if power != LONE_SHAPE:
        return state
    x, y, d, t = start_lone(power, *state[:5])
    bar = bar_of_tail(3, data.penalty, found)
    lone = _tail_of(data, (x, y, 0 * d, d, d, t), power, LONE_STEPS, tail.LONE, bar)
    join_lone(*(*given, *lone, data.penalty, allowed, found))
    return state


def _tail_of(
    data: Data, state: tuple[Array, ...], power: int, steps: int, lone: float, bar: Array
) -> tuple[Array, ...]:
    """Take at most so many steps of a tail."""
    x, y, w, v, d, t = state
    order, unknowns = (0,) * (len(data.re) - 1), (0,) * 4
    ur, ui, lag, qr, qi, rr, ri = ([d] * len(data.re) for _ in range(7))
    tail.shape(order, power, d, lag, qr, qi)
    tail.turn_back(order, data.re, data.im, x, y, ur, ui)
    w, v = tail.weigh(order, data.weight, lone, ur, ui, qr, qi)
    tail.remains(order, ur, ui, w, v, qr, qi, rr, ri)
    cost = sharp.chi_square(order, data.weight, rr, ri) + PRIOR * t * t

    def step(state: Any) -> Any:
        lag, qr, qi, rr, ri = (list(part) for part in state[:5])
        x, y, w, v, d, t, cost, damping = state[5:]
        new = tail.step(
            order, power, unknowns, data.re, data.im, data.weight, PRIOR, lone,
            x, y, w, v, d, t, lag, qr, qi, rr, ri, cost, damping, bar,
        )  # fmt: skip
        return tuple(lag), tuple(qr), tuple(qi), tuple(rr), tuple(ri), *new

    banks = (tuple(part) for part in (lag, qr, qi, rr, ri))
    damping = sharp.FIRST_DAMPING + 0 * cost
    found: tuple[Array, ...] = _times(
        steps, step, (*banks, x, y, w, v, d, t, cost, damping), _moving
    )
    return found[5:12]


def _moving(state: Any) -> bool:
    """Say whether any pixel takes a further step."""
    return bool((state[-1] < sharp.SETTLED).any())


def _times(
    times: int,
    step: Callable[[Any], Any],
    state: Any,
    going_on: Callable[[Any], bool] = lambda state: True,
) -> Any:
    """Apply a step so many times, or until nothing goes on; JAX compiles all of them once."""
    if namespace(state[-1]).__name__ == "jax.numpy":
        from jax import lax

        return lax.fori_loop(0, times, lambda _, inner: step(inner), state)
    for _ in range(times):
        if not going_on(state):
            break
        state = step(state)
    return state
