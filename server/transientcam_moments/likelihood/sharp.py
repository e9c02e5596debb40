"""Weighted least squares of K sharp returns: b_j = sum_k w_k exp(i j phi_k).

A return is kept as a point z = x + i y of the unit circle and a weight w, so that its moments are
powers. The unknowns of a step are the weights and the phases times their weights, as in
`noise.cramer_rao`: with u = exp(i j (phi_l - phi_k)) the normal equations are sums of
weight_j (Re u, j^2 Re u, j Im u), and no column vanishes with its return.

``order`` is a tuple of length m, ``returns`` one of length K; ``weight`` holds the inverse variance
of each moment's real part, 0 where it was not measured; ``rr``, ``ri`` hold what is left of the
moments.
"""

from typing import Any

from transientcam_moments._arrays import Array
from transientcam_moments.likelihood.arithmetic import (
    Bank,
    Length,
    bank,
    larger,
    least,
    rounding,
    select,
    smaller,
    square_bank,
)
from transientcam_moments.likelihood.linear import decompose, solve, variances

FIRST_DAMPING = 1e-2
LESS_DAMPING, MORE_DAMPING = 0.15, 6.0
LEAST_DAMPING, MOST_DAMPING = 1e-7, 1e7
SETTLED = 1e9
"""The damping of pixels that take no further step; above `MOST_DAMPING`."""
ENOUGH, ENOUGH_SHARE = 0.1, 3e-3
"""A step that changes chi-square by less, or by less of it, is the last one: noise moves the
unknowns by ten times as much."""
HOPELESS = 0.1
"""So is one that takes less than this share of what a model would still have to gain."""
LEAST_APART = 0.02
"""Of the square of a new return's moments, the least that counts as its own."""
REACH = 1.5
"""Over m: the most that a phase moves in a step, in radians; a basin is pi / m wide."""


def chi_square(order: Length, weight: Bank, rr: Bank, ri: Bank) -> Array:
    """Return the weighted sum of squares of what is left."""
    total = weight[0] * rr[0] * rr[0]
    for j in range(1, len(order) + 1):
        total = total + weight[j] * (rr[j] * rr[j] + ri[j] * ri[j])
    return total


def judge(cost: Array, tried: Array, damping: Array, bar: Array) -> tuple[Any, Array]:
    """Return where a step is taken, and the damping of the next one.

    `bar` is the chi-square from which on the model is not the best; infinite where that is open.
    """
    moving = damping < SETTLED
    lower = tried < cost
    change = select(lower, cost - tried, tried - cost)
    missing = larger(tried - bar, 0.0 * cost)
    little = (change < ENOUGH + ENOUGH_SHARE * tried + HOPELESS * missing) & (damping < 1.0)
    factor = select(lower, LESS_DAMPING + 0.0 * cost, MORE_DAMPING + 0.0 * cost)
    damping = smaller(
        larger(damping * factor, LEAST_DAMPING + 0.0 * cost), MOST_DAMPING + 0.0 * cost
    )
    return lower & moving, select(moving & ~little, damping, SETTLED + 0.0 * cost)


def take_away(order: Length, x: Array, y: Array, w: Array, rr: Bank, ri: Bank) -> None:
    """Take a return out of what is left."""
    rr[0] = rr[0] - w
    a, b = w, 0.0 * w
    for j in range(1, len(order) + 1):
        a, b = a * x - b * y, a * y + b * x
        rr[j] = rr[j] - a
        ri[j] = ri[j] - b


def weigh_what_is_left(
    order: Length, weight: Bank, rr: Bank, ri: Bank, re: Bank, im: Bank
) -> Array:
    """Put what is left times its weight in `re` and `im`; return the sum of the weights."""
    total = 0.0 * weight[0]
    for j in range(len(order) + 1):
        re[j], im[j] = weight[j] * rr[j], weight[j] * ri[j]
        total = total + weight[j]
    return larger(total, least(total))


def overlaps(
    order: Length, returns: Length, weight: Bank, total: Array, x: Bank, y: Bank, kr: Bank, ki: Bank
) -> None:
    """Put the coefficients of what a return at any phase shares with all but the last in banks.

    Of return k they are the Fourier coefficients of sum_j weight_j cos(j (phi - phi_k)) over the
    sum of the weights, j = 1 to m.
    """
    m = len(order)
    inverse = 1.0 / total
    for k in range(len(returns) - 1):
        p, q = x[k], y[k]
        for j in range(1, m + 1):
            share = weight[j] * inverse
            kr[k * m + j - 1], ki[k * m + j - 1] = share * p, share * q
            p, q = p * x[k] - q * y[k], p * y[k] + q * x[k]


def try_phase(
    order: Length,
    returns: Length,
    flat: Array,
    re: Bank,
    im: Bank,
    total: Array,
    kr: Bank,
    ki: Bank,
    c: Any,
    s: Any,
    best: Array,
    bx: Array,
    by: Array,
    bw: Array,
) -> tuple[Array, ...]:
    """Return best gain, point and weight of a return more, after trying the point c + i s.

    What such a return explains of the space that one of the others spans is not counted; `kr` and
    `ki` are from `overlaps`, and `flat` is the weight of b_0 over all weights.
    """
    m = len(order)
    found = re[0]
    a, b = c, s
    for j in range(1, m + 1):
        found = found + (re[j] * a + im[j] * b)
        a, b = a * c - b * s, a * s + b * c
    apart = 0.0 * total
    for k in range(len(returns) - 1):
        same = flat
        a, b = c, s
        for j in range(m):
            same = same + (kr[k * m + j] * a + ki[k * m + j] * b)
            a, b = a * c - b * s, a * s + b * c
        apart = larger(apart, same * same)
    apart = larger(1.0 - apart, LEAST_APART + 0.0 * apart)
    gain = select(found > 0.0, found * found / apart, 0.0 * found)
    better = gain > best
    return (
        select(better, gain, best),
        select(better, c + 0.0 * gain, bx),
        select(better, s + 0.0 * gain, by),
        select(better, larger(found / (apart * total), 0.0 * gain), bw),
    )


def information(order: Length, returns: Length, weight: Bank, x: Bank, y: Bank, a: Bank) -> None:
    """Fill the lower half of the information matrix of weights, then phases times weights."""
    m, count = len(order), len(returns)
    n = 2 * count
    for k in range(count):
        flat, curved = weight[0], 0.0 * weight[0]
        for j in range(1, m + 1):
            flat = flat + weight[j]
            curved = curved + (float(j) * j) * weight[j]
        a[k * n + k] = flat
        a[(count + k) * n + count + k] = curved
        a[(count + k) * n + k] = 0.0 * flat
        for i in range(k):
            dx, dy = x[k] * x[i] + y[k] * y[i], y[k] * x[i] - x[k] * y[i]
            p, q = dx, dy  # z_k / z_i
            flat, curved, skew = weight[0], 0.0 * weight[0], 0.0 * weight[0]
            for j in range(1, m + 1):
                real, imag = weight[j] * p, weight[j] * q
                flat = flat + real
                curved = curved + (float(j) * j) * real
                skew = skew + float(j) * imag
                p, q = p * dx - q * dy, p * dy + q * dx
            a[k * n + i] = flat
            a[(count + k) * n + count + i] = curved
            a[(count + k) * n + i] = -skew
            a[(count + i) * n + k] = skew


def weigh(
    order: Length,
    returns: Length,
    data_r: Bank,
    data_i: Bank,
    weight: Bank,
    x: Bank,
    y: Bank,
    w: Bank,
) -> None:
    """Put the weights in `w` that explain most with given phases; those below 0 become 0."""
    m, count = len(order), len(returns)
    a = square_bank(weight[0], returns, 0)
    for k in range(count):
        along, total = weight[0] * data_r[0], weight[0]
        p, q = x[k], y[k]
        for j in range(1, m + 1):
            along = along + weight[j] * (p * data_r[j] + q * data_i[j])
            total = total + weight[j]
            p, q = p * x[k] - q * y[k], p * y[k] + q * x[k]
        w[k] = along
        a[k * count + k] = total * (1.0 + rounding(total))
        for i in range(k):
            dx, dy = x[k] * x[i] + y[k] * y[i], y[k] * x[i] - x[k] * y[i]
            p, q = dx, dy
            same = weight[0]
            for j in range(1, m + 1):
                same = same + weight[j] * p
                p, q = p * dx - q * dy, p * dy + q * dx
            a[k * count + i] = same
    decompose(returns, a)
    solve(returns, a, w)
    for k in range(count):
        w[k] = larger(w[k], 0.0 * w[k])


def turned(x: Array, y: Array, w: Array, g: Array, reach: float) -> tuple[Array, Array]:
    """Return a return's point after a step `g` of its phase times its weight.

    It is the turn by 2 arctan(g / 2 w), with one quotient; `reach` is the most of that tangent.
    """
    size = larger(w, least(w))
    half = larger(smaller(0.5 * g, reach * size), -reach * size)
    inverse = 1.0 / (size * size + half * half)
    c, s = (size * size - half * half) * inverse, 2.0 * size * half * inverse
    return x * c - y * s, x * s + y * c


def step(
    order: Length,
    returns: Length,
    unknowns: Length,
    data_r: Bank,
    data_i: Bank,
    weight: Bank,
    x: Bank,
    y: Bank,
    w: Bank,
    rr: Bank,
    ri: Bank,
    cost: Array,
    damping: Array,
    bar: Array,
) -> tuple[Array, Array]:
    """Go one step of Levenberg and Marquardt wherever that lowers chi-square; see `judge`.

    Returns chi-square and damping; ``unknowns`` is a tuple of length 2 K.
    """
    m, count = len(order), len(returns)
    n = 2 * count
    a, g = square_bank(cost, unknowns, 0), bank(cost, unknowns, 0)
    information(order, returns, weight, x, y, a)
    for i in range(n):
        a[i * n + i] = a[i * n + i] * (1.0 + damping)
    for k in range(count):
        along, across = weight[0] * rr[0], 0.0 * cost
        p, q = x[k], y[k]
        for j in range(1, m + 1):
            along = along + weight[j] * (p * rr[j] + q * ri[j])
            across = across + (float(j) * weight[j]) * (p * ri[j] - q * rr[j])
            p, q = p * x[k] - q * y[k], p * y[k] + q * x[k]
        g[k], g[count + k] = along, across
    decompose(unknowns, a)
    solve(unknowns, a, g)
    tx, ty, tw = bank(cost, returns, 0), bank(cost, returns, 0), bank(cost, returns, 0)
    tr, ti = bank(cost, order, 1), bank(cost, order, 1)
    for j in range(m + 1):
        tr[j], ti[j] = data_r[j], data_i[j]
    reach = 0.5 * REACH / m
    for k in range(count):
        tx[k], ty[k] = turned(x[k], y[k], w[k], g[count + k], reach)
    weigh(order, returns, data_r, data_i, weight, tx, ty, tw)
    for k in range(count):
        take_away(order, tx[k], ty[k], tw[k], tr, ti)
    tried = chi_square(order, weight, tr, ti)
    lower, damping = judge(cost, tried, damping, bar)
    for k in range(count):
        x[k], y[k] = select(lower, tx[k], x[k]), select(lower, ty[k], y[k])
        w[k] = select(lower, tw[k], w[k])
    for j in range(m + 1):
        rr[j], ri[j] = select(lower, tr[j], rr[j]), select(lower, ti[j], ri[j])
    return select(lower, tried, cost), damping


def deviations(
    order: Length,
    returns: Length,
    unknowns: Length,
    weight: Bank,
    x: Bank,
    y: Bank,
    out: Bank,
) -> None:
    """Put the variances of weights, then of phases times weights, in `out`."""
    a = square_bank(x[0], unknowns, 0)
    information(order, returns, weight, x, y, a)
    decompose(unknowns, a)
    variances(unknowns, a, out)
