"""Weighted least squares of K sharp returns: b_j = sum_k w_k exp(i j phi_k).

A return is kept as a point z = x + i y of the unit circle and a weight w, so that its moments are
powers: z^j of return k is at place k m + j - 1 of the banks ``pr`` and ``pi``. The unknowns of a
step are the weights and the phases times their weights, as in `noise.cramer_rao`: with
u = exp(i j (phi_l - phi_k)) the normal equations are sums of weight_j (Re u, j^2 Re u, j Im u), and
no column vanishes with its return.

``order`` is a tuple of length m, ``returns`` one of length K; ``weight`` holds the inverse variance
of each moment's real part, 0 where it was not measured; ``rr``, ``ri`` hold what is left of the
moments. Sums are written so that each product fuses with the sum so far.
"""

from typing import Any

from transientcam_moments.arrays import (
    Array,
    Bank,
    Length,
    bank,
    larger,
    least,
    product_bank,
    rounding,
    select,
    smaller,
    square_bank,
)
from transientcam_moments.likelihood._linear import decompose, solve, variances

FIRST_DAMPING = 1e-2
LESS_DAMPING, MORE_DAMPING = 0.15, 6.0
LEAST_DAMPING, MOST_DAMPING = 1e-7, 300.0
SETTLED = 1e9
"""The damping of pixels that take no further step, as those do that reach `MOST_DAMPING`."""
ENOUGH, ENOUGH_SHARE = 0.1, 3e-3
"""A step that changes chi-square by less, or by less of it, is the last one: noise moves the
unknowns by ten times as much."""
FINER = 0.05
"""Share of these for several returns: where they are close, many small steps follow each other."""
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


def judge(
    cost: Array, tried: Array, damping: Array, bar: Array, share: float = 1.0
) -> tuple[Any, Array]:
    """Return where a step is taken, and the damping of the next one.

    `bar` is the chi-square from which on the model is not the best; infinite where that is open.
    `share` is that of the change that is enough.
    """
    moving = damping < SETTLED
    lower = tried < cost
    change = select(lower, cost - tried, tried - cost)
    missing = larger(tried - bar, 0.0 * cost)
    enough = share * (ENOUGH + ENOUGH_SHARE * tried) + HOPELESS * missing
    little = (change < enough) & (damping < 1.0)
    factor = select(lower, LESS_DAMPING + 0.0 * cost, MORE_DAMPING + 0.0 * cost)
    damping = larger(damping * factor, LEAST_DAMPING + 0.0 * cost)
    going_on = moving & ~little & (damping < MOST_DAMPING)
    return lower & moving, select(going_on, damping, SETTLED + 0.0 * cost)


def powers(order: Length, x: Array, y: Array, k: int, pr: Bank, pi: Bank) -> None:
    """Put the powers 1 to m of a point of the unit circle in the place of return `k`."""
    m = len(order)
    p, q = x, y
    pr[k * m], pi[k * m] = p, q
    for j in range(1, m):
        p, q = p * x - q * y, p * y + q * x
        pr[k * m + j], pi[k * m + j] = p, q


def remains(
    order: Length,
    returns: Length,
    data_r: Bank,
    data_i: Bank,
    pr: Bank,
    pi: Bank,
    w: Bank,
    rr: Bank,
    ri: Bank,
) -> None:
    """Put what returns leave of the data in `rr` and `ri`."""
    m, count = len(order), len(returns)
    for j in range(m + 1):
        re, im = data_r[j], data_i[j]
        for k in range(count):
            if j == 0:
                re = re - w[k]
            else:
                re = re - w[k] * pr[k * m + j - 1]
                im = im - w[k] * pi[k * m + j - 1]
        rr[j], ri[j] = re, im


def weigh_what_is_left(
    order: Length, weight: Bank, rr: Bank, ri: Bank, re: Bank, im: Bank
) -> Array:
    """Put what is left times its weight in `re` and `im`; return the sum of the weights."""
    total = weight[0]
    re[0], im[0] = weight[0] * rr[0], weight[0] * ri[0]
    for j in range(1, len(order) + 1):
        re[j], im[j] = weight[j] * rr[j], weight[j] * ri[j]
        total = total + weight[j]
    return larger(total, least(total))


def overlaps(
    order: Length, returns: Length, weight: Bank, total: Array, pr: Bank, pi: Bank, kr: Bank,
    ki: Bank,
) -> None:  # fmt: skip
    """Put the coefficients of what a return at any phase shares with all but the last in banks.

    Of return k they are the Fourier coefficients of sum_j weight_j cos(j (phi - phi_k)) over the
    sum of the weights, j = 0 to m, at the places from k (m + 1) on.
    """
    m = len(order)
    inverse = 1.0 / total
    for k in range(len(returns) - 1):
        at = k * (m + 1)
        kr[at], ki[at] = weight[0] * inverse, 0.0 * inverse
        for j in range(1, m + 1):
            share = weight[j] * inverse
            kr[at + j], ki[at + j] = share * pr[k * m + j - 1], share * pi[k * m + j - 1]


def four_sums(
    order: Length, turns: Any, row: Any, at: int, re: Bank, im: Bank
) -> tuple[Array, Array, Array, Array]:
    """Return a Fourier series at the phases t, -t, pi - t and pi + t of a row of `turns`.

    ``turns`` has cos(j t), then sin(j t), j = 1 to m, in each row. The even and the odd terms of
    cosines and sines are the same in all four but for their signs.
    """
    m = len(order)
    even, odd = re[at], re[at + 1] * turns[row, 0]
    even_sine, odd_sine = 0.0 * even, im[at + 1] * turns[row, m]
    for j in range(2, m + 1):
        c, s = turns[row, j - 1], turns[row, m + j - 1]
        if j % 2 == 0:
            even, even_sine = even + re[at + j] * c, even_sine + im[at + j] * s
        else:
            odd, odd_sine = odd + re[at + j] * c, odd_sine + im[at + j] * s
    near, far = even + odd, even - odd
    near_sine, far_sine = odd_sine + even_sine, odd_sine - even_sine
    return near + near_sine, near - near_sine, far + far_sine, far - far_sine


def kept(
    returns: Length,
    along: Array,
    apart: Array,
    x: Any,
    y: Any,
    best: Array,
    best_apart: Array,
    bx: Array,
    by: Array,
) -> tuple[Array, Array, Array, Array]:
    """Return the better one of two points: what lies along it, its own share, and the point.

    It explains along^2 / apart, which is compared without a quotient; `best` is 0 or more.
    """
    if len(returns) == 1:
        better = along > best
    else:
        better = (along > 0.0) & (along * along * best_apart > best * best * apart)
        best_apart = select(better, apart, best_apart)
    best = select(better, along, best)
    return best, best_apart, select(better, x + 0.0 * best, bx), select(better, y + 0.0 * best, by)


def try_phases(
    order: Length,
    returns: Length,
    turns: Any,
    row: Any,
    re: Bank,
    im: Bank,
    kr: Bank,
    ki: Bank,
    best: Array,
    best_apart: Array,
    bx: Array,
    by: Array,
) -> tuple[Array, Array, Array, Array]:
    """Return the best point of a return more, as `kept` does, after trying a row of `four_sums`.

    What such a return explains of the space that one of the others spans is not counted; `kr` and
    `ki` are from `overlaps`.
    """
    m = len(order)
    a, b, c, d = four_sums(order, turns, row, 0, re, im)
    own_a = own_b = own_c = own_d = best_apart
    if len(returns) > 1:
        one, most = 1.0 + 0.0 * a, LEAST_APART + 0.0 * a
        own_a = own_b = own_c = own_d = one
        for k in range(len(returns) - 1):
            sa, sb, sc, sd = four_sums(order, turns, row, k * (m + 1), kr, ki)
            own_a, own_b = smaller(own_a, one - sa * sa), smaller(own_b, one - sb * sb)
            own_c, own_d = smaller(own_c, one - sc * sc), smaller(own_d, one - sd * sd)
        own_a, own_b = larger(own_a, most), larger(own_b, most)
        own_c, own_d = larger(own_c, most), larger(own_d, most)
    x, y = turns[row, 0], turns[row, m]
    best, best_apart, bx, by = kept(returns, a, own_a, x, y, best, best_apart, bx, by)
    best, best_apart, bx, by = kept(returns, b, own_b, x, -y, best, best_apart, bx, by)
    best, best_apart, bx, by = kept(returns, c, own_c, -x, y, best, best_apart, bx, by)
    return kept(returns, d, own_d, -x, -y, best, best_apart, bx, by)


def information(order: Length, returns: Length, weight: Bank, pr: Bank, pi: Bank, a: Bank) -> None:
    """Fill the lower half of the information matrix of weights, then phases times weights."""
    m, count = len(order), len(returns)
    n = 2 * count
    all_flat, all_curved = weight[0], 0.0 * weight[0]
    for j in range(1, m + 1):
        all_flat = all_flat + weight[j]
        all_curved = all_curved + (float(j) * j) * weight[j]
    for k in range(count):
        a[k * n + k] = all_flat
        a[(count + k) * n + count + k] = all_curved
        a[(count + k) * n + k] = 0.0 * all_flat
        for i in range(k):
            flat, curved, skew = weight[0], 0.0 * all_flat, 0.0 * all_flat
            # powers of z_k / z_i, by the recurrence of cosines and sines of multiples
            zr, zi, wr, wi = pr[k * m], pi[k * m], pr[i * m], pi[i * m]
            p, q = zr * wr + zi * wi, zi * wr - zr * wi
            twice, before, sine_before = 2.0 * p, 1.0 + 0.0 * p, 0.0 * p
            for j in range(1, m + 1):
                along = weight[j] * p
                flat = flat + along
                curved = curved + (float(j) * j) * along
                skew = skew + (float(j) * weight[j]) * q
                p, before = twice * p - before, p
                q, sine_before = twice * q - sine_before, q
            a[k * n + i] = flat
            a[(count + k) * n + count + i] = curved
            a[(count + k) * n + i] = -skew
            a[(count + i) * n + k] = skew


def gradient(
    order: Length, returns: Length, weight: Bank, pr: Bank, pi: Bank, rr: Bank, ri: Bank, g: Bank
) -> None:
    """Put what is left along each return, then across it, in `g`."""
    m, count = len(order), len(returns)
    level = weight[0] * rr[0]
    for k in range(count):
        g[k], g[count + k] = level, 0.0 * level
    for j in range(1, m + 1):
        re, im = weight[j] * rr[j], weight[j] * ri[j]
        steep_re, steep_im = float(j) * re, float(j) * im
        for k in range(count):
            p, q = pr[k * m + j - 1], pi[k * m + j - 1]
            g[k] = g[k] + p * re + q * im
            g[count + k] = g[count + k] + p * steep_im - q * steep_re


def weigh(
    order: Length,
    returns: Length,
    data_r: Bank,
    data_i: Bank,
    weight: Bank,
    pr: Bank,
    pi: Bank,
    w: Bank,
) -> None:
    """Put the weights in `w` that explain most with given phases; those below 0 become 0."""
    m, count = len(order), len(returns)
    a = square_bank(weight[0], returns, 0)
    total = weight[0]
    for j in range(1, m + 1):
        total = total + weight[j]
    total = total * (1.0 + rounding(total))
    for k in range(count):
        along = weight[0] * data_r[0]
        for j in range(1, m + 1):
            p, q = pr[k * m + j - 1], pi[k * m + j - 1]
            along = along + weight[j] * (p * data_r[j] + q * data_i[j])
        w[k] = along
        a[k * count + k] = total
        for i in range(k):
            same = weight[0]
            for j in range(m):
                u, v = k * m + j, i * m + j
                same = same + weight[j + 1] * (pr[u] * pr[v] + pi[u] * pi[v])
            a[k * count + i] = same
    decompose(returns, a)
    solve(returns, a, w, 0)
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
    pr: Bank,
    pi: Bank,
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
    information(order, returns, weight, pr, pi, a)
    for i in range(n):
        a[i * n + i] = a[i * n + i] * (1.0 + damping)
    gradient(order, returns, weight, pr, pi, rr, ri, g)
    decompose(unknowns, a)
    solve(unknowns, a, g, count)
    tr, ti, tw = bank(cost, order, 1), bank(cost, order, 1), bank(cost, returns, 0)
    qr, qi = product_bank(cost, order, returns), product_bank(cost, order, returns)
    reach = 0.5 * REACH / m
    for k in range(count):
        x, y = turned(pr[k * m], pi[k * m], w[k], g[count + k], reach)
        powers(order, x, y, k, qr, qi)
    weigh(order, returns, data_r, data_i, weight, qr, qi, tw)
    remains(order, returns, data_r, data_i, qr, qi, tw, tr, ti)
    tried = chi_square(order, weight, tr, ti)
    lower, damping = judge(cost, tried, damping, bar, FINER if count > 1 else 1.0)
    for i in range(count * m):
        pr[i], pi[i] = select(lower, qr[i], pr[i]), select(lower, qi[i], pi[i])
    for k in range(count):
        w[k] = select(lower, tw[k], w[k])
    for j in range(m + 1):
        rr[j], ri[j] = select(lower, tr[j], rr[j]), select(lower, ti[j], ri[j])
    return select(lower, tried, cost), damping


def deviations(
    order: Length, returns: Length, unknowns: Length, weight: Bank, x: Bank, y: Bank, out: Bank
) -> None:
    """Put the variances of weights, then of phases times weights, in `out`."""
    pr, pi = product_bank(weight[0], order, returns), product_bank(weight[0], order, returns)
    for k in range(len(returns)):
        powers(order, x[k], y[k], k, pr, pi)
    a = square_bank(weight[0], unknowns, 0)
    information(order, returns, weight, pr, pi, a)
    decompose(unknowns, a)
    variances(unknowns, a, out)
