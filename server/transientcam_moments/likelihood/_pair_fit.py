"""Weighted least squares of two returns at few multiples: b_j = w_1 z_1^j + w_2 z_2^j, w >= 0.

What `sharp` does for any number of returns at all multiples up to m, written out for two at those
that were measured. ``places`` are their multiples j, ascending, b_0 among them where it was
measured. ``share`` holds the weights of the moments over their sum, so that the normal equations
of the weights are those of [[1, s], [s, 1]]; those of the phases are closed as well.

Powers z^j of both returns are in one bank, those of the second behind those of the first.
"""

from typing import Any

from transientcam_moments.arrays import Array, Bank, larger, least, rounding, select
from transientcam_moments.likelihood._sharp import FIRST_DAMPING, REACH, SETTLED, judge, turned

DIRECT_SHARE = 0.1
"""Of the brighter return's weight, what the earlier one has to have to be the direct return."""


def powers(places: Any, x: Array, y: Array, start: int, pr: Bank, pi: Bank) -> None:
    """Put the powers of a point of the unit circle in banks, from the place `start` on."""
    p, q = 1.0 + 0.0 * x, 0.0 * x
    reached = 0
    for k in range(len(places)):
        gap = places[k] - reached
        a, b = x, y
        while gap > 0:
            if gap & 1:
                p, q = p * a - q * b, p * b + q * a
            a, b = a * a - b * b, 2.0 * a * b
            gap >>= 1
        reached = places[k]
        pr[start + k], pi[start + k] = p, q


def weigh(
    places: Any, data_r: Bank, data_i: Bank, share: Bank, pr: Bank, pi: Bank, w: Bank
) -> None:
    """Put the weights >= 0 in `w` that explain most with given phases."""
    n = len(places)
    first, second, same = 0.0 * pr[0], 0.0 * pr[0], 0.0 * pr[0]
    for k in range(n):
        first = first + share[k] * (pr[k] * data_r[k] + pi[k] * data_i[k])
        second = second + share[k] * (pr[n + k] * data_r[k] + pi[n + k] * data_i[k])
        same = same + share[k] * (pr[k] * pr[n + k] + pi[k] * pi[n + k])
    apart = larger((1.0 - same) * (1.0 + same), rounding(same))
    inverse = 1.0 / apart
    u, v = (first - same * second) * inverse, (second - same * first) * inverse
    both = (u >= 0.0) & (v >= 0.0)
    brighter = first >= second  # which of them alone explains more
    none = 0.0 * first
    w[0] = select(both, u, select(brighter, larger(first, none), none))
    w[1] = select(both, v, select(brighter, none, larger(second, none)))


def chi_square(
    places: Any, data_r: Bank, data_i: Bank, weight: Bank, pr: Bank, pi: Bank, w: Bank
) -> Array:
    """Return the weighted sum of squares of what two returns leave."""
    n = len(places)
    total = 0.0 * w[0]
    for k in range(n):
        re = data_r[k] - w[0] * pr[k] - w[1] * pr[n + k]
        im = data_i[k] - w[0] * pi[k] - w[1] * pi[n + k]
        total = total + weight[k] * (re * re + im * im)
    return total


def turns(
    places: Any,
    data_r: Bank,
    data_i: Bank,
    share: Bank,
    pr: Bank,
    pi: Bank,
    w: Bank,
    damping: Array,
) -> tuple[Array, Array]:
    """Return the step of each phase times its weight, by the damped normal equations.

    Of the unknowns of `sharp`, the weights are eliminated: ``[[d, s], [s, d]]`` is their block,
    ``[[0, k], [-k, 0]]`` the one between phases and weights.
    """
    n = len(places)
    none = 0.0 * w[0]
    s, crossed, skew, curved = none, none, none, none
    g1, g2, h1, h2 = none, none, none, none
    for k in range(n):
        j = float(places[k])
        ar, ai, br, bi = pr[k], pi[k], pr[n + k], pi[n + k]
        real, imag = share[k] * (br * ar + bi * ai), share[k] * (bi * ar - br * ai)
        s, crossed = s + real, crossed + j * j * real
        skew, curved = skew + j * imag, curved + j * j * share[k]
        re = share[k] * (data_r[k] - w[0] * ar - w[1] * br)
        im = share[k] * (data_i[k] - w[0] * ai - w[1] * bi)
        g1, g2 = g1 + (ar * re + ai * im), g2 + (br * re + bi * im)
        h1, h2 = h1 + j * (ar * im - ai * re), h2 + j * (br * im - bi * re)
    d = 1.0 + damping
    inverse = 1.0 / larger((d - s) * (d + s), rounding(s))
    h1 = h1 - skew * (d * g2 - s * g1) * inverse
    h2 = h2 + skew * (d * g1 - s * g2) * inverse
    lost = skew * skew * inverse
    diagonal, beside = d * (curved - lost), crossed - s * lost
    floor = larger(rounding(s) * curved, least(s))
    inverse = 1.0 / (larger(diagonal - beside, floor) * larger(diagonal + beside, floor))
    return (diagonal * h1 - beside * h2) * inverse, (diagonal * h2 - beside * h1) * inverse


def begin(
    places: Any, data_r: Bank, data_i: Bank, weight: Bank, share: Bank, x: Bank, y: Bank, w: Bank,
    pr: Bank, pi: Bank,
) -> Array:  # fmt: skip
    """Put the powers of two points, and the best weights there, in banks; return chi-square."""
    powers(places, x[0], y[0], 0, pr, pi)
    powers(places, x[1], y[1], len(places), pr, pi)
    weigh(places, data_r, data_i, share, pr, pi, w)
    return chi_square(places, data_r, data_i, weight, pr, pi, w)


def step(
    places: Any, data_r: Bank, data_i: Bank, weight: Bank, share: Bank, x: Bank, y: Bank, w: Bank,
    pr: Bank, pi: Bank, tx: Bank, ty: Bank, tw: Bank, tr: Bank, ti: Bank, cost: Array,
    damping: Array, bar: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Go one step of Levenberg and Marquardt wherever that lowers chi-square.

    ``tx`` to ``ti`` are room for what is tried, ``bar`` as of `sharp.judge`. Returns chi-square
    and damping.
    """
    n = len(places)
    reach = 0.5 * REACH / float(places[n - 1])
    turn = turns(places, data_r, data_i, share, pr, pi, w, damping)
    tx[0], ty[0] = turned(x[0], y[0], w[0], turn[0], reach)
    tx[1], ty[1] = turned(x[1], y[1], w[1], turn[1], reach)
    tried = begin(places, data_r, data_i, weight, share, tx, ty, tw, tr, ti)
    lower, damping = judge(cost, tried, damping, bar)
    for k in range(2):
        x[k], y[k] = select(lower, tx[k], x[k]), select(lower, ty[k], y[k])
        w[k] = select(lower, tw[k], w[k])
    for k in range(2 * n):
        pr[k], pi[k] = select(lower, tr[k], pr[k]), select(lower, ti[k], pi[k])
    return select(lower, tried, cost), damping


def first_damping(moving: Any, cost: Array) -> Array:
    """Return the damping of a first step, and that of no step where nothing is `moving`."""
    return select(moving, FIRST_DAMPING + 0.0 * cost, SETTLED + 0.0 * cost)


def direct(x: Bank, y: Bank, w: Bank) -> tuple[Array, Array]:
    """Return the point of the direct return of a pair.

    That is the earlier one, by phases in [0, 2 pi), unless it is below `DIRECT_SHARE`.
    """
    # grows with the phase, from 0 to 4
    first = select(y[0] < 0.0, 3.0 + x[0], 1.0 - x[0])
    second = select(y[1] < 0.0, 3.0 + x[1], 1.0 - x[1])
    early = first <= second
    faint = (w[0] < DIRECT_SHARE * w[1]), (w[1] < DIRECT_SHARE * w[0])
    chosen = (early & ~faint[0]) | (~early & faint[1])
    return select(chosen, x[0], x[1]), select(chosen, y[0], y[1])
