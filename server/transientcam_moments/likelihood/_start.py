"""Another start of the fits: Pisarenko's returns, which are exact where there is no noise."""

from typing import Any

from transientcam_moments.arrays import Bank, Length, bank, larger, rounding, select
from transientcam_moments.moment_problem import circle, eigenvalue, toeplitz

ROOT_STEPS = 12


def pisarenko(order: Length, half_turns: Any, data_r: Bank, data_i: Bank, x: Bank, y: Bank) -> None:
    """Put the points of the brightest three of m returns in `x` and `y` (Sec. 5.1), m >= 3.

    The largest of the data is 1; b_0 need not be measured, only be 0 then. ``half_turns`` is from
    `circle.half_turns`.
    """
    m = len(order)
    one = 1.0 + 0.0 * data_r[0]
    re, im = bank(one, order, 1), bank(one, order, 1)
    ar, ai = bank(one, order, 1), bank(one, order, 1)
    gr, gi = bank(one, order, 0), bank(one, order, 0)
    wr, wi, inverse = bank(one, order, 0), bank(one, order, 0), bank(one, order, 0)
    uniform = eigenvalue.smallest_eigenvalue(order, data_r, data_i)
    floor = rounding(one) * one
    factor = 1.0 / larger(data_r[0] - uniform, floor)
    re[0], im[0] = one, 0.0 * one
    for j in range(1, m + 1):
        re[j], im[j] = data_r[j] * factor, data_i[j] * factor
    toeplitz.definite(order, re, im, floor, ar, ai, gr, gi, inverse)
    circle.circle_roots(order, half_turns, ROOT_STEPS, ar, ai, wr, wi)
    shares = bank(one, (0, 0, 0), 0)
    for k in range(3):
        shares[k], x[k], y[k] = 0.0 * one - 1.0, one, 0.0 * one
    for i in range(m):
        share, ux, uy = circle.weigh(order, gr, gi, inverse, wr[i], wi[i])
        zx, zy = circle.doubled(ux, uy)
        for k in range(3):
            more = share > shares[k]
            share, shares[k] = select(more, shares[k], share), select(more, share, shares[k])
            zx, x[k] = select(more, x[k], zx), select(more, zx, x[k])
            zy, y[k] = select(more, y[k], zy), select(more, zy, y[k])
