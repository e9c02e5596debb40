"""The fits of the likelihood to a vector of pixels: a return more, a tail, and what is written."""

from typing import Any

from numba import njit

from transientcam_moments._kernels import portable, simd
from transientcam_moments._kernels.arrays import Complexes, Counts, Reals
from transientcam_moments._kernels.portable import bank, infinity, product_bank, select, some
from transientcam_moments.arrays import Bank, Length, Mask, Plane
from transientcam_moments.likelihood import choice, scaled, sharp, tail

# portable gives arithmetic its meaning
__all__ = ["fit", "fit_again", "fit_one", "portable", "write"]

_MEAN = choice.DELAY_RAD / choice.TAIL_SHAPES[0]
DAMPING = 6
"""Place of the damping in the state of a tail: x, y, w, v, d, t, damping, chi-square."""


@njit(error_model="numpy")
def _new(
    order: Length, returns: Length, turns: Reals, data_r: Bank, data_i: Bank, weight: Bank,
    x: Bank, y: Bank, w: Bank, pr: Bank, pi: Bank, rr: Bank, ri: Bank,
) -> Any:  # fmt: skip
    """Add the best return for what the others leave; return what all of them leave."""
    m, last = len(order), len(returns) - 1
    like = data_r[0]
    for j in range(m + 1):
        rr[j], ri[j] = data_r[j], data_i[j]
    for k in range(last):
        sharp.powers(order, x[k], y[k], k, pr, pi)
    sharp.remains(order, returns[1:], data_r, data_i, pr, pi, w, rr, ri)
    re, im = bank(like, order, 1), bank(like, order, 1)
    total = sharp.weigh_what_is_left(order, weight, rr, ri, re, im)
    # (m + 1) (K - 1) are enough
    kr, ki = product_bank(like, order, returns), product_bank(like, order, returns)
    sharp.overlaps(order, returns, weight, total, pr, pi, kr, ki)
    best, apart, bx, by = 0.0 * total, 1.0 + 0.0 * total, 1.0 + 0.0 * total, 0.0 * total
    for row in range(m + 2):
        best, apart, bx, by = sharp.try_phases(
            order, returns, turns, row, re, im, kr, ki, best, apart, bx, by
        )
    x[last], y[last], w[last] = bx, by, best / (apart * total)
    sharp.powers(order, bx, by, last, pr, pi)
    sharp.remains(order, returns, data_r, data_i, pr, pi, w, rr, ri)
    return sharp.chi_square(order, weight, rr, ri)


@njit(error_model="numpy")
def fit(
    order: Length, returns: Length, unknowns: Length, steps: int, turns: Reals, data_r: Bank,
    data_i: Bank, weight: Bank, x: Bank, y: Bank, w: Bank, pr: Bank, pi: Bank, rr: Bank, ri: Bank,
    active: Mask, bar: Plane,
) -> Any:  # fmt: skip
    """Add a return and fit all of them, until `active` pixels have settled.

    Returns chi-square and the damping of a next step.
    """
    cost = _new(order, returns, turns, data_r, data_i, weight, x, y, w, pr, pi, rr, ri)
    return _improve(
        order, returns, unknowns, steps, data_r, data_i, weight, x, y, w, pr, pi, rr, ri, cost,
        active, bar,
    )  # fmt: skip


@njit(error_model="numpy")
def fit_again(
    order: Length, returns: Length, unknowns: Length, data_r: Bank, data_i: Bank, weight: Bank,
    from_x: Bank, from_y: Bank, x: Bank, y: Bank, w: Bank, cost: Plane, active: Mask, bar: Plane,
) -> Any:  # fmt: skip
    """Fit returns from other points on as well; keep the better ones and return chi-square."""
    pr, pi = product_bank(cost, order, returns), product_bank(cost, order, returns)
    rr, ri = bank(cost, order, 1), bank(cost, order, 1)
    size = bank(cost, returns, 0)
    for k in range(len(returns)):
        sharp.powers(order, from_x[k], from_y[k], k, pr, pi)
    sharp.weigh(order, returns, data_r, data_i, weight, pr, pi, size)
    sharp.remains(order, returns, data_r, data_i, pr, pi, size, rr, ri)
    tried, _ = _improve(
        order, returns, unknowns, choice.LATE_STEPS, data_r, data_i, weight, from_x, from_y, size,
        pr, pi, rr, ri, sharp.chi_square(order, weight, rr, ri), active, bar,
    )  # fmt: skip
    better = active & (tried < cost)
    for k in range(len(returns)):
        x[k], y[k] = select(better, from_x[k], x[k]), select(better, from_y[k], y[k])
        w[k] = select(better, size[k], w[k])
    return select(better, tried, cost)


@njit(error_model="numpy")
def _improve(
    order: Length, returns: Length, unknowns: Length, steps: int, data_r: Bank, data_i: Bank,
    weight: Bank, x: Bank, y: Bank, w: Bank, pr: Bank, pi: Bank, rr: Bank, ri: Bank, cost: Plane,
    active: Mask, bar: Plane,
) -> Any:  # fmt: skip
    m = len(order)
    damping = select(active, sharp.FIRST_DAMPING + 0.0 * cost, sharp.SETTLED)
    for _ in range(steps):
        if not some(damping < sharp.SETTLED):
            break
        cost, damping = sharp.step(
            order, returns, unknowns, data_r, data_i, weight, pr, pi, w, rr, ri, cost, damping, bar
        )
    for k in range(len(returns)):
        x[k], y[k] = pr[k * m], pi[k * m]
    return cost, damping


@njit(error_model="numpy")
def start_tail(x2: Bank, y2: Bank, w2: Bank, active: Mask, state: Bank) -> None:
    """Put the state that the fit of a tail begins with in `state`, from two returns."""
    x, y, w, v, ratio, t = choice.start_of_tail(x2, y2, w2, choice.DELAY_RAD)
    state[0], state[1], state[2], state[3], state[4], state[5] = x, y, w, v, ratio * _MEAN, t
    state[DAMPING] = select(active, sharp.FIRST_DAMPING + 0.0 * x, sharp.SETTLED)
    state[7] = 0.0 * x


@njit(error_model="numpy")
def step_tail(
    order: Length, power: int, unknowns: Length, steps: int, lone: float, data_r: Bank,
    data_i: Bank, weight: Bank, state: Bank, bar: Plane,
) -> None:  # fmt: skip
    """Take at most so many steps of a return with a tail, until all pixels have settled."""
    like = data_r[0]
    x, y, w, v, d, t = state[0], state[1], state[2], state[3], state[4], state[5]
    ur, ui = bank(like, order, 1), bank(like, order, 1)
    qr, qi = bank(like, order, 1), bank(like, order, 1)
    rr, ri = bank(like, order, 1), bank(like, order, 1)
    lag = bank(like, order, 1)
    tail.shape(order, power, d, lag, qr, qi)
    tail.turn_back(order, data_r, data_i, x, y, ur, ui)
    w, v = tail.weigh(order, weight, lone, ur, ui, qr, qi)
    tail.remains(order, ur, ui, w, v, qr, qi, rr, ri)
    cost = sharp.chi_square(order, weight, rr, ri) + choice.PRIOR * t * t
    damping = state[DAMPING]
    for _ in range(steps):
        if not some(damping < sharp.SETTLED):
            break
        x, y, w, v, d, t, cost, damping = tail.step(
            order, power, unknowns, data_r, data_i, weight, choice.PRIOR, lone, x, y, w, v, d, t,
            lag, qr, qi, rr, ri, cost, damping, bar,
        )  # fmt: skip
    state[0], state[1], state[2], state[3], state[4], state[5] = x, y, w, v, d, t
    state[DAMPING], state[7] = damping, cost


@njit(forceinline=True, error_model="numpy")
def write(
    slots: Length, found: Bank, scale: Plane, numbers: Plane, usable: Mask, p: int, planes: Reals,
    free: Counts, count: Counts,
) -> None:  # fmt: skip
    """Write the attributes of `Likelihood`, its returns sorted by phase."""
    out = bank(scale, (), 22)  # of three slots
    scaled.attributes(slots, found, scale, numbers, usable, out)
    last = 4 * len(slots) + 8
    for row in range(last):
        simd.store(planes[row], p, out[row])
    simd.store(free, p, out[last])
    simd.store(count, p, out[last + 1])


@njit(forceinline=True, error_model="numpy")
def fit_one(
    order: Length, turns: Reals, b: Complexes, variance: Reals, error: float, p: int, one: Plane,
    data_r: Bank, data_i: Bank, weight: Bank, x: Bank, y: Bank, w: Bank, pr: Bank, pi: Bank,
    rr: Bank, ri: Bank, threshold: float, found: Bank,
) -> Any:  # fmt: skip
    """Load pixels and put one return in `found`; return their scale, numbers, use and penalty."""
    far = infinity(one)
    for j in range(len(order) + 1):
        data_r[j], data_i[j] = simd.load_complex(one, b[j], p)
        weight[j] = simd.load(one, variance[j], p)
    scale, numbers, penalty, usable = scaled.prepare(order, error, one, data_r, data_i, weight)
    choice.nothing(one, far, found)
    cost, _ = fit(
        order, (0,), (0, 0), choice.STEPS[0], turns, data_r, data_i, weight, x, y, w, pr, pi, rr,
        ri, usable, far,
    )  # fmt: skip
    choice.offer_returns(
        order, (0,), (0, 0), weight, x, y, w, cost, penalty, threshold, one > 0.0, found
    )
    return scale, numbers, usable, penalty
