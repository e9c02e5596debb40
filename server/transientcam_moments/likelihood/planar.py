"""The fits of all pixels: each model where the simpler ones leave something to explain."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from transientcam_moments._arrays import Array, namespace
from transientcam_moments.likelihood import sharp, tail
from transientcam_moments.likelihood.choice import (
    DELAY_RAD,
    MOST_RETURNS,
    PLANES,
    PRIOR,
    SCORE,
    STEPS,
    TAIL_STEPS,
    nothing,
    offer_returns,
    offer_tail,
    phases_of,
    start_of_tail,
)


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


def fit(data: Data, most: int, shape: int) -> Array:
    """Return what is found of every pixel (PLANES, P), as `choice` lays it out.

    `most` is the largest number of sharp returns, 1 to 3; `shape` that of the tail, 0 for none.
    """
    xp = namespace(data.re)
    m = data.re.shape[0] - 1
    found = [data.re[0]] * PLANES
    far = np.inf + 0 * data.penalty
    nothing(data.penalty, far, found)
    one = SharpFit.start(data, 1, None, far)
    one.offer(found, data.numbers >= 0)
    planes = xp.stack(found)
    further = min(most, m) >= 2
    if not further and not (shape and m >= 2):
        return planes

    def more(data: Data, before: tuple[Array, ...], planes: Array) -> Array:
        found = list(planes)
        two = SharpFit.start(data, 2, before, np.inf + 0 * data.penalty)
        if further:
            two.offer(found, data.numbers >= 4)
        if shape:
            _offer_tail(data, two, shape, found)
        done = xp.stack(found)
        if min(most, m) < MOST_RETURNS:
            return done

        def most_of_all(data: Data, before: tuple[Array, ...], planes: Array) -> Array:
            found = list(planes)
            bar = found[SCORE] - 6 * data.penalty
            SharpFit.start(data, 3, before, bar).offer(found, data.numbers >= 6)
            return namespace(planes).stack(found)

        still = done[SCORE] > 6 * data.penalty
        return where(still, most_of_all, data, two.state(), done)

    # chi-square cannot become less than 0: no model with more unknowns is better below
    return where(planes[SCORE] > 4 * data.penalty, more, data, one.state(), planes)


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

    def __init__(self, data: Data, count: int, before: tuple[Array, ...] | None) -> None:
        m = data.re.shape[0] - 1
        self.data = data
        self.order, self.returns = (0,) * m, (0,) * count
        self.unknowns = (0,) * (2 * count)
        flat = (list(data.re), list(data.im)) if before is None else (before[0], before[1])
        self.rr, self.ri = list(flat[0]), list(flat[1])
        points = () if before is None else before[2:]
        self.x, self.y, self.w = ([*part, data.re[0]] for part in points or ((), (), ()))

    @classmethod
    def start(
        cls, data: Data, count: int, before: tuple[Array, ...] | None, bar: Array
    ) -> "SharpFit":
        """Add a return to those of another fit, and fit all of them; `bar` as in `sharp.judge`."""
        fit = cls(data, count, before)
        fit.cost = fit._add()
        fit.improve(STEPS[count - 1], bar)
        return fit

    @classmethod
    def at(cls, data: Data, x: Sequence[Array], y: Sequence[Array]) -> "SharpFit":
        """Begin with returns at points x + i y of the unit circle, and the best weights there."""
        fit = cls(data, len(x), None)
        fit.x, fit.y, fit.w = list(x), list(y), list(x)
        given = (data.re, data.im, data.weight, fit.x, fit.y, fit.w)
        sharp.weigh(fit.order, fit.returns, *given)
        for point in zip(fit.x, fit.y, fit.w, strict=True):
            sharp.take_away(fit.order, *point, fit.rr, fit.ri)
        fit.cost = sharp.chi_square(fit.order, data.weight, fit.rr, fit.ri)
        return fit

    def improve(self, steps: int, bar: Array) -> None:
        """Take at most so many steps to a lower chi-square."""
        data = self.data

        def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
            x, y, w, rr, ri = (list(part) for part in state[:5])
            cost, damping = sharp.step(
                self.order, self.returns, self.unknowns, data.re, data.im, data.weight,
                x, y, w, rr, ri, state[5], state[6], bar,
            )  # fmt: skip
            return tuple(x), tuple(y), tuple(w), tuple(rr), tuple(ri), cost, damping

        banks = (tuple(part) for part in (self.x, self.y, self.w, self.rr, self.ri))
        damping = sharp.FIRST_DAMPING + 0 * self.cost
        state = _times(steps, step, (*banks, self.cost, damping), _moving)
        self.x, self.y, self.w, self.rr, self.ri = (list(part) for part in state[:5])
        self.cost = state[5]

    def _add(self) -> Array:
        """Put the best return for what is left in the last place; return chi-square."""
        order, data = self.order, self.data
        re, im = list(self.rr), list(self.ri)
        total = sharp.weigh_what_is_left(order, data.weight, self.rr, self.ri, re, im)
        phases = phases_of(len(order))
        cosine, sine = np.cos(2 * np.pi / phases), np.sin(2 * np.pi / phases)
        kr, ki = [total] * len(order) * 2, [total] * len(order) * 2
        sharp.overlaps(order, self.returns, data.weight, total, self.x, self.y, kr, ki)
        flat = data.weight[0] / total

        def attempt(state: tuple[Array, ...]) -> tuple[Array, ...]:
            c, s = state[:2]
            best = sharp.try_phase(
                order, self.returns, flat, re, im, total, kr, ki, c, s, *state[2:]
            )
            return c * cosine - s * sine, c * sine + s * cosine, *best

        zero = 0 * total
        none = zero - 1
        one = total.dtype.type(1) if namespace(total) is np else 1 + zero
        state = _times(phases, attempt, (one, 0 * one, none, zero, zero, zero))
        x, y, w = self.x, self.y, self.w
        x[-1], y[-1], w[-1] = state[3:]
        sharp.take_away(order, x[-1], y[-1], w[-1], self.rr, self.ri)
        return sharp.chi_square(order, data.weight, self.rr, self.ri)

    def state(self) -> tuple[Array, ...]:
        """Return what a fit of one more return begins with."""
        xp = namespace(self.cost)
        return tuple(xp.stack(part) for part in (self.rr, self.ri, self.x, self.y, self.w))

    def offer(self, found: list[Array], allowed: Array) -> None:
        """Put the returns where they are the better model."""
        offer_returns(
            self.order, self.returns, self.unknowns, self.data.weight,
            self.x, self.y, self.w, self.cost, self.data.penalty, allowed, found,
        )  # fmt: skip


def _offer_tail(data: Data, two: SharpFit, shape: int, found: list[Array]) -> None:
    """Fit a return with a tail, from two returns on, and put it where it is the better model."""
    order, powers, unknowns = two.order, (0,) * shape, (0,) * 4
    mean = DELAY_RAD / shape
    x, y, w, v, ratio, t = start_of_tail(two.x, two.y, two.w, DELAY_RAD)
    d = ratio * mean
    qr, qi, rr, ri = ([d] * len(data.re) for _ in range(4))
    tail.shape(order, powers, d, qr, qi)
    tail.remains(order, data.re, data.im, x, y, w, v, qr, qi, rr, ri)
    cost = sharp.chi_square(order, data.weight, rr, ri) + PRIOR * t * t

    def step(state: Any) -> Any:
        x, y, w, v, d, t, cost, damping = state[4:]
        qr, qi, rr, ri = (list(part) for part in state[:4])
        new = tail.step(
            order, powers, unknowns, data.re, data.im, data.weight, PRIOR,
            x, y, w, v, d, t, qr, qi, rr, ri, cost, damping, bar,
        )  # fmt: skip
        return tuple(qr), tuple(qi), tuple(rr), tuple(ri), *new

    banks = (tuple(part) for part in (qr, qi, rr, ri))
    damping = sharp.FIRST_DAMPING + 0 * cost
    bar = found[SCORE] - 4 * data.penalty
    state = _times(TAIL_STEPS, step, (*banks, x, y, w, v, d, t, cost, damping), _moving)
    qr, qi, rr, ri = (list(part) for part in state[:4])
    x, y, w, v, d, t, cost, _ = state[4:]
    offer_tail(
        order, powers, unknowns, data.weight, PRIOR, x, y, w, v, d, t, qr, qi, rr, ri,
        cost, data.penalty, data.numbers >= 4, found,
    )  # fmt: skip


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
