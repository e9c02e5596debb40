"""Weighted least squares of a return with a tail that begins with it.

b_j = exp(i j phi) (w + v / (1 - i j d)^p): light w at phase phi and light v that comes later, with
the density of a gamma distribution of shape p and mean delay p d. A normal prior on log d ties d
down where there is no tail to measure it by.

Names as in `sharp`; ``power`` is p. The unknowns are w, v, phi and log d, and
``t`` is log(d) less its mean in the prior, kept beside d. ``lone`` is 0, or `LONE` for a tail
without a return, whose w it keeps at 0. The data are turned back by
exp(-i j phi), in ``ur`` and ``ui``, which changes no weighted sum of squares; the moments of the
tail are then in ``qr`` and ``qi``, and 1 / (1 + (j d)^2) in ``lag``.
"""

from transientcam_moments.arrays import (
    Array,
    Bank,
    Length,
    bank,
    larger,
    rounding,
    select,
    smaller,
    square_bank,
)
from transientcam_moments.likelihood._linear import decompose, solve, variances
from transientcam_moments.likelihood._sharp import REACH, chi_square, judge

LONE = 1e9
"""How much more than the moments tell of w is known of it then."""
LONGER = 0.7
"""The most that log d changes in a step."""
SHORTEST, LONGEST = -3.2, 2.4
"""Limits of t: d within the prior's mean times their exponentials."""


def shape(order: Length, power: int, d: Array, lag: Bank, qr: Bank, qi: Bank) -> None:
    """Put the moments of a tail that begins at phase 0 in `qr` and `qi`."""
    qr[0], qi[0], lag[0] = 1.0 + 0.0 * d, 0.0 * d, 1.0 + 0.0 * d
    for j in range(1, len(order) + 1):
        lag[j] = 1.0 / (1.0 + (float(j) * j) * d * d)
        a, b = lag[j], float(j) * d * lag[j]  # 1 / (1 - i j d)
        p, q = a, b
        for _ in range(power - 1):
            p, q = p * a - q * b, p * b + q * a
        qr[j], qi[j] = p, q


def turn_back(
    order: Length, data_r: Bank, data_i: Bank, x: Array, y: Array, ur: Bank, ui: Bank
) -> None:
    """Put the data turned back by the phase of x + i y in `ur` and `ui`."""
    ur[0], ui[0] = data_r[0], data_i[0]
    p, q = x, y
    for j in range(1, len(order) + 1):
        ur[j], ui[j] = p * data_r[j] + q * data_i[j], p * data_i[j] - q * data_r[j]
        p, q = p * x - q * y, p * y + q * x


def weigh(
    order: Length, weight: Bank, lone: float, ur: Bank, ui: Bank, qr: Bank, qi: Bank
) -> tuple[Array, Array]:
    """Return the light w and v >= 0 that explains most with given phase and tail."""
    ww, wv, vv = weight[0], weight[0] * qr[0], weight[0] * qr[0] * qr[0]
    gw = weight[0] * ur[0]
    gv = gw * qr[0]
    for j in range(1, len(order) + 1):
        ww = ww + weight[j]
        wv = wv + weight[j] * qr[j]
        vv = vv + weight[j] * (qr[j] * qr[j] + qi[j] * qi[j])
        gw = gw + weight[j] * ur[j]
        gv = gv + weight[j] * (ur[j] * qr[j] + ui[j] * qi[j])
    ww, vv = ww * (1.0 + lone + rounding(ww)), vv * (1.0 + rounding(ww))
    inverse = 1.0 / (ww * vv - wv * wv)
    w, v = (vv * gw - wv * gv) * inverse, (ww * gv - wv * gw) * inverse
    alone, late = gw / ww, gv / vv
    zero = 0.0 * w
    w, v = select(v < 0.0, alone, w), larger(v, zero)
    return larger(w, zero), larger(select(w < 0.0, late, v), zero)


def remains(
    order: Length, ur: Bank, ui: Bank, w: Array, v: Array, qr: Bank, qi: Bank, rr: Bank, ri: Bank
) -> None:
    """Put what is left of the data, turned back as they are, in `rr` and `ri`."""
    rr[0], ri[0] = ur[0] - (w + v), ui[0]
    for j in range(1, len(order) + 1):
        rr[j], ri[j] = ur[j] - w - v * qr[j], ui[j] - v * qi[j]


def information(
    order: Length,
    power: int,
    weight: Bank,
    lone: float,
    w: Array,
    v: Array,
    d: Array,
    lag: Bank,
    qr: Bank,
    qi: Bank,
    rr: Bank,
    ri: Bank,
    a: Bank,
    g: Bank,
) -> None:
    """Fill the lower half of the information matrix, and the gradient, of w, v, phi and log d."""
    zero = 0.0 * d
    a[0] = weight[0]
    a[4], a[5] = weight[0], weight[0]
    g[0] = weight[0] * rr[0]
    g[1] = g[0]
    a[8], a[9], a[10], g[2] = zero, zero, zero, zero
    a[12], a[13], a[14], a[15], g[3] = zero, zero, zero, zero, zero
    for j in range(1, len(order) + 1):
        tr, ti = qr[j], qi[j]
        fr, fi = -float(j) * (v * ti), float(j) * (w + v * tr)  # i j (w + v q)
        # v p q i j d / (1 - i j d)
        size = (float(power) * float(j)) * (d * v) * lag[j]
        c, s = -(float(j) * d) * size, size  # i / (1 - i j d) = (i - j d) / (1 + (j d)^2)
        lr, li = tr * c - ti * s, tr * s + ti * c
        # each derivative times the weight: of v, phi and log d
        mr, mi = weight[j] * tr, weight[j] * ti
        nr, ni = weight[j] * fr, weight[j] * fi
        kr, ki = weight[j] * lr, weight[j] * li
        a[0] = a[0] + weight[j]
        a[4] = a[4] + mr
        a[5] = a[5] + mr * tr + mi * ti
        a[8] = a[8] + nr
        a[9] = a[9] + nr * tr + ni * ti
        a[10] = a[10] + nr * fr + ni * fi
        a[12] = a[12] + kr
        a[13] = a[13] + kr * tr + ki * ti
        a[14] = a[14] + kr * fr + ki * fi
        a[15] = a[15] + kr * lr + ki * li
        g[0] = g[0] + weight[j] * rr[j]
        g[1] = g[1] + mr * rr[j] + mi * ri[j]
        g[2] = g[2] + nr * rr[j] + ni * ri[j]
        g[3] = g[3] + kr * rr[j] + ki * ri[j]
    a[0] = a[0] * (1.0 + lone)


def step(
    order: Length,
    power: int,
    unknowns: Length,
    data_r: Bank,
    data_i: Bank,
    weight: Bank,
    prior: float,
    lone: float,
    x: Array,
    y: Array,
    w: Array,
    v: Array,
    d: Array,
    t: Array,
    lag: Bank,
    qr: Bank,
    qi: Bank,
    rr: Bank,
    ri: Bank,
    cost: Array,
    damping: Array,
    bar: Array,
) -> tuple[Array, ...]:
    """Go one step of Levenberg and Marquardt wherever that lowers chi-square with the prior.

    ``prior`` is the inverse variance of t. Returns all that changed but for the banks.
    """
    m = len(order)
    a, g = square_bank(cost, unknowns, 0), bank(cost, unknowns, 0)
    information(order, power, weight, lone, w, v, d, lag, qr, qi, rr, ri, a, g)
    a[15] = a[15] + prior
    g[3] = g[3] - prior * t
    for i in range(4):
        a[i * 4 + i] = a[i * 4 + i] * (1.0 + damping)
    decompose(unknowns, a)
    solve(unknowns, a, g, 2)
    reach = 0.5 * REACH / m
    half = larger(smaller(0.5 * g[2], reach + 0.0 * cost), -reach + 0.0 * cost)
    scale = 1.0 / (1.0 + half * half)
    c, s = (1.0 - half * half) * scale, 2.0 * half * scale
    tx, ty = x * c - y * s, x * s + y * c
    low, high = larger(-LONGER + 0.0 * t, SHORTEST - t), smaller(LONGER + 0.0 * t, LONGEST - t)
    change = 0.5 * larger(smaller(g[3], high), low)
    td = d * ((1.0 + change) / (1.0 - change))
    square = change * change  # log((1 + c) / (1 - c)), below rounding for |c| < 0.35
    series = 1.0 + square * (1 / 3 + square * (1 / 5 + square * (1 / 7 + square * (1 / 9))))
    tt = t + 2.0 * change * series
    ur, ui, late = bank(cost, order, 1), bank(cost, order, 1), bank(cost, order, 1)
    sr, si = bank(cost, order, 1), bank(cost, order, 1)
    tr, ti = bank(cost, order, 1), bank(cost, order, 1)
    shape(order, power, td, late, sr, si)
    turn_back(order, data_r, data_i, tx, ty, ur, ui)
    tw, tv = weigh(order, weight, lone, ur, ui, sr, si)
    remains(order, ur, ui, tw, tv, sr, si, tr, ti)
    tried = chi_square(order, weight, tr, ti) + prior * tt * tt
    lower, damping = judge(cost, tried, damping, bar)
    for j in range(m + 1):
        lag[j] = select(lower, late[j], lag[j])
        qr[j], qi[j] = select(lower, sr[j], qr[j]), select(lower, si[j], qi[j])
        rr[j], ri[j] = select(lower, tr[j], rr[j]), select(lower, ti[j], ri[j])
    return (
        select(lower, tx, x),
        select(lower, ty, y),
        select(lower, tw, w),
        select(lower, tv, v),
        select(lower, td, d),
        select(lower, tt, t),
        select(lower, tried, cost),
        damping,
    )


def deviations(
    order: Length,
    power: int,
    unknowns: Length,
    weight: Bank,
    prior: float,
    lone: float,
    w: Array,
    v: Array,
    d: Array,
    out: Bank,
) -> None:
    """Put the variances of w, v, phi and log d in `out`."""
    lag, qr, qi = bank(d, order, 1), bank(d, order, 1), bank(d, order, 1)
    shape(order, power, d, lag, qr, qi)
    a, g = square_bank(d, unknowns, 0), bank(d, unknowns, 0)
    # the gradient, of what the tail itself would leave, is not asked for
    information(order, power, weight, lone, w, v, d, lag, qr, qi, qr, qi, a, g)
    a[15] = a[15] + prior
    decompose(unknowns, a)
    variances(unknowns, a, out)
