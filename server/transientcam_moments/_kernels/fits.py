"""The fits of the likelihood to a vector of pixels: a return more, a tail, and what is written."""

from typing import Any

from numba import njit

from transientcam_moments._kernels import portable, simd
from transientcam_moments._kernels.arrays import Complexes, Counts, Reals
from transientcam_moments._kernels.portable import (
    bank,
    eps,
    infinity,
    larger,
    largest,
    logarithm,
    magnitude,
    not_a_number,
    product_bank,
    root,
    select,
    smaller,
    some,
    tiny,
)
from transientcam_moments.arrays import Bank, Length, Mask, Plane
from transientcam_moments.likelihood import choice, sharp, tail
from transientcam_moments.moment_problem import phase_of

# portable gives arithmetic its meaning
__all__ = ["fit", "fit_again", "fit_one", "portable", "write"]

_MEAN = choice.DELAY_RAD / choice.TAIL_SHAPES[0]
DAMPING = 6
"""Place of the damping in the state of a tail: x, y, w, v, d, t, damping, chi-square."""


@njit(forceinline=True, error_model="numpy")
def _prepare(
    order: Length, b: Complexes, variance: Reals, error: float, p: int, one: Plane, data_r: Bank,
    data_i: Bank, weight: Bank,
) -> Any:  # fmt: skip
    """Load pixels, their largest moment made 1; return that, how many numbers, and their use."""
    m = len(order)
    zero = 0.0 * one
    size, poison, numbers, waves = zero, zero, zero, zero
    for j in range(m + 1):
        x, y = simd.load_complex(one, b[j], p)
        v = simd.load(one, variance[j], p)
        seen = (v > 0.0) & (v < infinity(one))
        x = select(seen, x, 0.0)
        y = select(seen, y, 0.0) if j > 0 else zero
        size = larger(size, larger(magnitude(x), magnitude(y)))
        poison = poison + x * 0.0 + y * 0.0
        numbers = numbers + select(seen, one * (2.0 if j > 0 else 1.0), 0.0)
        waves = waves + select(seen, one * (1.0 if j > 0 else 0.0), 0.0)
        data_r[j], data_i[j] = x, y
        weight[j] = select(seen, v, 0.0)
    usable = (poison >= 0.0) & (size > 16.0 * tiny(one)) & (size < (largest(one) * eps(one)))
    usable = usable & (waves > 0.0) & ~((weight[0] > 0.0) & ~(data_r[0] > 0.0))
    scale = select(usable, size, one)
    inverse = select(usable, 1.0 / scale, 0.0)
    rounding = 4.0 * eps(one)
    for j in range(m + 1):
        data_r[j] = select(usable, data_r[j] * inverse, one)
        data_i[j] = select(usable, data_i[j] * inverse, 0.0)
        seen = weight[j] > 0.0
        std = root(select(seen, weight[j], one)) * inverse
        std = smaller(larger(std, rounding), 1.0 / rounding)
        each = 1.0 / (std * std + error * error)
        weight[j] = select(usable, select(seen, each, 0.0), one)
    return scale, select(usable, numbers, one), usable


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
    one = scale / scale
    nan, far = not_a_number(one), infinity(one)
    size = len(slots)
    keys, values = bank(one, slots, 0), bank(one, slots, 0)
    first, second = bank(one, slots, 0), bank(one, slots, 0)
    with_tail = found[choice.LENGTH] > 0.0
    there = 0.0 * one
    for k in range(size):
        used = (
            usable
            & (found[choice.COUNT] > float(k))
            & ((found[choice.WEIGHT + k] > 0.0) | with_tail)
        )
        keys[k] = select(used, phase_of(found[choice.X + k], found[choice.Y + k]), far)
        values[k] = select(used, found[choice.WEIGHT + k] * scale, 0.0)
        first[k] = select(used, root(found[choice.PHASE_VARIANCE + k]), nan)
        second[k] = select(used, root(found[choice.WEIGHT_VARIANCE + k]) * scale, nan)
        there = there + select(used, one, 0.0)
    for i in range(size - 1):
        for k in range(size - 1 - i):
            swap = keys[k] > keys[k + 1]
            low, high = smaller(keys[k], keys[k + 1]), larger(keys[k], keys[k + 1])
            keys[k], keys[k + 1] = low, high
            low, high = (
                select(swap, values[k + 1], values[k]),
                select(swap, values[k], values[k + 1]),
            )
            values[k], values[k + 1] = low, high
            low, high = (
                select(swap, first[k + 1], first[k]),
                select(swap, first[k], first[k + 1]),
            )
            first[k], first[k + 1] = low, high
            low, high = (
                select(swap, second[k + 1], second[k]),
                select(swap, second[k], second[k + 1]),
            )
            second[k], second[k + 1] = low, high
    for k in range(size):
        simd.store(planes[k], p, select(keys[k] < far, keys[k], nan))
        simd.store(planes[size + k], p, values[k])
        simd.store(planes[2 * size + k], p, first[k])
        simd.store(planes[3 * size + k], p, second[k])
    tailed = usable & with_tail & (found[choice.TAIL] > 0.0)
    delay = found[choice.SHAPE] * found[choice.LENGTH]
    rest = 4 * size
    simd.store(planes[rest], p, select(tailed, found[choice.TAIL] * scale, 0.0))
    std = root(found[choice.TAIL_VARIANCE]) * scale
    simd.store(planes[rest + 1], p, select(tailed, std, nan))
    simd.store(planes[rest + 2], p, select(tailed, delay, nan))
    std = delay * root(found[choice.LENGTH_VARIANCE])
    simd.store(planes[rest + 3], p, select(tailed, std, nan))
    simd.store(planes[rest + 4], p, select(usable, found[choice.CHI_SQUARE], nan))
    std = root(choice.average_variance(numbers, found))
    simd.store(planes[rest + 5], p, select(keys[0] < far, found[choice.MEAN], nan))
    simd.store(planes[rest + 6], p, select(keys[0] < far, std, nan))
    simd.store(planes[rest + 7], p, select(tailed, found[choice.SHAPE], 0.0))
    unknowns = select(with_tail, 4.0 * one, 2.0 * found[choice.COUNT])
    simd.store(free, p, select(usable, numbers - unknowns, 0.0))
    simd.store(count, p, there)


@njit(forceinline=True, error_model="numpy")
def fit_one(
    order: Length, turns: Reals, b: Complexes, variance: Reals, error: float, p: int, one: Plane,
    data_r: Bank, data_i: Bank, weight: Bank, x: Bank, y: Bank, w: Bank, pr: Bank, pi: Bank,
    rr: Bank, ri: Bank, threshold: float, found: Bank,
) -> Any:  # fmt: skip
    """Load pixels and put one return in `found`; return their scale, numbers, use and penalty."""
    far = infinity(one)
    scale, numbers, usable = _prepare(order, b, variance, error, p, one, data_r, data_i, weight)
    penalty = logarithm(numbers) + choice.MARGIN
    choice.nothing(one, far, found)
    cost, _ = fit(
        order, (0,), (0, 0), choice.STEPS[0], turns, data_r, data_i, weight, x, y, w, pr, pi, rr,
        ri, usable, far,
    )  # fmt: skip
    choice.offer_returns(
        order, (0,), (0, 0), weight, x, y, w, cost, penalty, threshold, one > 0.0, found
    )
    return scale, numbers, usable, penalty
