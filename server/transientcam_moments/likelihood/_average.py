"""The range as an average over models, weighted by how well each explains the moments.

A model of score s counts exp(-s / 2): chi-square with log n for each unknown (the Bayesian
information criterion) and `MARGIN` for each component beside the first. The models are one to
three sharp returns, and a return with a tail of several shapes, which share one prior.

The average is kept in planes of `found` (see `choice`) and grows model by model: mean and variance
of the direct return's phase, the least score so far, and the sum of all weights over that one's.
"""

import math

from transientcam_moments.arrays import (
    Array,
    Bank,
    Length,
    bank,
    larger,
    least,
    magnitude,
    select,
    smaller,
)
from transientcam_moments.likelihood import _sharp as sharp, _tail as tail
from transientcam_moments.likelihood._choice import (
    CHI_SQUARE,
    LEAST_SCORE,
    MARGIN,
    MEAN,
    SPREAD,
    TOTAL,
)
from transientcam_moments.moment_problem import phase_of


def decay(x: Array) -> Array:
    """Return exp(-x), x >= 0, to single precision or 1e-15."""
    t = 0.0625 * x
    inverse = 1.0 / (1.0 + t * (1.0 + t * (0.5 + t * (1 / 6 + t * (1 / 24 + t * (1 / 120))))))
    for _ in range(4):
        inverse = inverse * inverse
    return inverse


def join(phase: Array, square: Array, score: Array, there: Array, found: Bank) -> None:
    """Take a direct return, its phase's variance `square`, into the average where it is `there`."""
    there = there & (square < 1e30)
    gain = found[LEAST_SCORE] - score
    better = gain > 0.0
    factor = decay(0.5 * magnitude(gain))
    total = select(better, found[TOTAL] * factor + 1.0, found[TOTAL] + factor)
    share = select(better, 1.0 + 0.0 * factor, factor) / total
    apart = phase - found[MEAN]
    apart = select(apart > math.pi, apart - 2.0 * math.pi, apart)
    apart = select(apart < -math.pi, apart + 2.0 * math.pi, apart)
    mean = found[MEAN] + share * apart
    mean = select(mean < 0.0, mean + 2.0 * math.pi, mean)
    mean = select(mean >= 2.0 * math.pi, mean - 2.0 * math.pi, mean)
    rest = 1.0 - share
    spread = rest * found[SPREAD] + share * (square + rest * apart * apart)
    found[SPREAD] = select(there, spread, found[SPREAD])
    found[MEAN] = select(there, mean, found[MEAN])
    found[TOTAL] = select(there, total, found[TOTAL])
    found[LEAST_SCORE] = select(there & better, score, found[LEAST_SCORE])


def join_returns(
    order: Length,
    returns: Length,
    unknowns: Length,
    weight: Bank,
    x: Bank,
    y: Bank,
    w: Bank,
    cost: Array,
    penalty: Array,
    threshold: float,
    allowed: Array,
    found: Bank,
) -> None:
    """Take K returns into the average, or begin it with one; none of them may have come to 0."""
    count = len(returns)
    spread = bank(cost, unknowns, 0)
    sharp.deviations(order, returns, unknowns, weight, x, y, spread)
    strongest, faintest = w[0], w[0]
    for k in range(1, count):
        strongest = larger(strongest, w[k])
        faintest = smaller(faintest, w[k])
    phase, square = 9.0 + 0.0 * cost, 0.0 * cost
    for k in range(count):
        size = larger(w[k], least(w[k]))
        at = phase_of(x[k], y[k])
        first = (w[k] >= threshold * strongest) & (at < phase)
        phase = select(first, at, phase)
        square = select(first, spread[count + k] / (size * size), square)
    score = cost + (2.0 * count) * penalty - ((count + 1.0) * MARGIN)
    if count == 1:
        found[MEAN], found[SPREAD] = phase, square
        found[LEAST_SCORE], found[TOTAL] = score, 1.0 + 0.0 * cost
    else:
        join(phase, square, score, allowed & (faintest > 0.0), found)


def join_tail(
    order: Length,
    power: int,
    unknowns: Length,
    weight: Bank,
    prior: float,
    shapes: int,
    x: Array,
    y: Array,
    w: Array,
    v: Array,
    d: Array,
    t: Array,
    cost: Array,
    penalty: Array,
    allowed: Array,
    found: Bank,
) -> None:
    """Take a return with a tail, of one of so many `shapes`, into the average."""
    spread = bank(cost, unknowns, 0)
    tail.deviations(order, power, unknowns, weight, prior, w, v, d, spread)
    score = cost - prior * t * t + 4.0 * penalty - (3.0 * MARGIN - 2.0 * math.log(shapes))
    join(phase_of(x, y), spread[2], score, allowed & (v > 0.0), found)


def bar_of_returns(unknowns: int, penalty: Array, found: Bank) -> Array:
    """Return the chi-square at which sharp returns weigh as much as the best model so far."""
    return found[LEAST_SCORE] - float(unknowns) * penalty + (0.5 * unknowns + 1.0) * MARGIN


def bar_of_tail(penalty: Array, found: Bank) -> Array:
    """Return the same of a return with a tail, but for the share of its shape."""
    return found[LEAST_SCORE] - 4.0 * penalty + 3.0 * MARGIN


def variance(numbers: Array, found: Bank) -> Array:
    """Return the average's variance, larger where no model explains the moments.

    By what the best one leaves over the numbers measured (Birge 1932).
    """
    return found[SPREAD] * larger(found[CHI_SQUARE] / numbers, 1.0 + 0.0 * numbers)
