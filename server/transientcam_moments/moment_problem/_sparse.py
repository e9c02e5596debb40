"""Returns at a smallest eigenvalue that is known, and what they leave of the moments (Theorem 2).

Quick rather than careful: what the returns leave says where they are wrong, which few are. Those
pixels are done again by `transientcam_moments.moment_problem.redo`.
"""

from transientcam_moments.arrays import (
    Array,
    Bank,
    Length,
    Plane,
    bank,
    eps,
    infinity,
    larger,
    magnitude,
    not_a_number,
    root,
    select,
    some,
)
from transientcam_moments.moment_problem._circle import circle_roots, doubled, phase_of, weigh
from transientcam_moments.moment_problem._sorting import sort
from transientcam_moments.moment_problem._toeplitz import definite

_FAINT = 1024.0  # times what rounding makes of nothing


def largest_residual(m: int, noise: float) -> float:
    """Return the residual that rounding explains, for moments of the precision `noise`."""
    return 16.0 * (m + 1) * noise


def least_share(m: int, noise: float) -> float:
    """Return the share of the light, and the prediction error, that may be rounding alone."""
    return 4.0 * m * noise


def returns(
    order: Length,
    turns: Array,
    steps: int,
    noise: float,
    one: Plane,
    uniform: Plane,
    re: Bank,
    im: Bank,
    phases: Bank,
    weights: Bank,
) -> tuple[Plane, Plane]:
    """Fill ``phases``, ascending, with those of at most m returns, and ``weights``.

    ``re`` and ``im`` hold the moments and are overwritten, ``one`` is 1 everywhere, ``turns`` is
    from `half_turns`. At most ``steps`` are done towards the roots.

    Returns the number of returns, and the error of all moments that they leave, relative to their
    sum: infinite where they could not be found, 0 where there is no light. Unused phases come last
    and are NaN, their weights 0.
    """
    m = len(order)
    ar, ai = bank(one, order, 1), bank(one, order, 1)
    gr, gi = bank(one, order, 0), bank(one, order, 0)
    wr, wi, inverse = bank(one, order, 0), bank(one, order, 0), bank(one, order, 0)
    floor = least_share(m, noise) * one
    b0 = re[0]
    total = b0 - uniform  # "using b_0 - lambda_m in place of b_0" (Sec. 5.1)
    lit = total > 4.0 * eps(one) * magnitude(b0)  # less is rounding
    factor = 1.0 / total
    re[0], im[0] = one, 0.0 * one
    for k in range(1, m + 1):
        re[k], im[k] = re[k] * factor, im[k] * factor
    fewer = lit & definite(order, re, im, floor, ar, ai, gr, gi, inverse)
    least, doubtful = floor, fewer & ~fewer
    if some(fewer):
        # a little more in the diagonal makes all smaller blocks definite: the surplus returns
        # become as faint as that, wherever they are
        least = select(fewer, 4.0 * floor, floor)
        factor = select(fewer, 1.0 - 2.0 * floor, 1.0)
        for k in range(1, m + 1):
            re[k], im[k] = re[k] * factor, im[k] * factor
        definite(order, re, im, floor, ar, ai, gr, gi, inverse)
        for k in range(1, m + 1):
            re[k], im[k] = re[k] / factor, im[k] / factor
    circle_roots(order, turns, steps, ar, ai, wr, wi)
    count = 0.0 * one
    for i in range(m):
        w, x, y = weigh(order, gr, gi, inverse, wr[i], wi[i])
        zr, zi = doubled(x, y)
        used = lit & (w > least) & (w * total > 0.0)
        # a surplus return next to one of the others takes a share of that one's weight
        doubtful = doubtful | (fewer & used & (w < _FAINT * floor))
        count = count + select(used, one, 0.0)
        weights[i] = select(used, w, 0.0)
        phases[i] = select(used, phase_of(zr, zi), infinity(one))
        # what the returns leave of the moments
        ur, ui = weights[i], im[0]
        re[0] = re[0] - ur
        for k in range(1, m + 1):
            ur, ui = ur * zr - ui * zi, ur * zi + ui * zr
            re[k], im[k] = re[k] - ur, im[k] - ui
    worst = re[0] * re[0]
    for k in range(1, m + 1):
        worst = worst + re[k] * re[k] + im[k] * im[k]  # NaN stays, as in no maximum
    worst = select((worst < 1.0) & ~doubtful, root(worst), infinity(one))
    sort(order, phases, weights)
    for i in range(m):
        unused = phases[i] > 7.0
        phases[i] = select(unused, not_a_number(one), phases[i])
        weights[i] = select(unused, 0.0, weights[i] * total)
    return count, select(lit, worst, 0.0)


def separate(
    order: Length, threshold: float, one: Plane, phases: Bank, weights: Bank
) -> tuple[Plane, Plane, Plane]:
    """Return direct and indirect light, and the phase of the direct return, NaN without one.

    The direct return is the first with a share ``threshold`` of the strongest one's weight.
    """
    m = len(order)
    strongest, total = weights[0], weights[0]
    for i in range(1, m):
        strongest, total = larger(weights[i], strongest), total + weights[i]
    direct, phase = 0.0 * one, not_a_number(one) * one
    for i in range(m - 1, -1, -1):
        enough = (weights[i] >= threshold * strongest) & (weights[i] > 0.0)
        direct = select(enough, weights[i], direct)
        phase = select(enough, phases[i], phase)
    return direct, larger(total - direct, 0.0), phase
