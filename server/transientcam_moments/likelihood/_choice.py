"""Of several models of a pixel the one that explains its moments with the fewest unknowns.

What is found of a pixel is a bank of planes, whose places are below. Three returns at most. The
range is an average over all models that were fitted, each of which counts exp(-s / 2): s is
chi-square with log n for each unknown, and `MARGIN` for each component beside the first.
"""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_moments.arrays import (
    Array,
    Bank,
    Length,
    bank,
    larger,
    least,
    logarithm,
    magnitude,
    root,
    root_eps,
    select,
    smaller,
)
from transientcam_moments.likelihood import _sharp as sharp, _tail as tail
from transientcam_moments.moment_problem import phase_of

MOST_RETURNS: Final = 3
X, Y, WEIGHT = 0, 3, 6
"""First plane of the points of the unit circle and the weights of each return."""
TAIL, LENGTH = 9, 10
"""Light v of the tail, and d; both 0 where there is no tail."""
CHI_SQUARE, SCORE, COUNT = 11, 12, 13
SHAPE: Final = 14
"""p of the tail; 0 where there is none."""
MEAN, SPREAD, LEAST_SCORE, TOTAL = 15, 16, 17, 18
"""Of the average over models: mean and variance of the direct return's phase, the least score of
it so far, and the sum of all weights over that one's."""
WEIGHT_VARIANCE, PHASE_VARIANCE = 19, 22
"""First plane of the variances of weights and phases of each return."""
TAIL_VARIANCE, LENGTH_VARIANCE = 25, 26
"""The variances of v and of log d."""
PLANES: Final = 27
STEPS: Final = (4, 8, 10)
"""Of the fits of one, two and three returns."""
LATE_STEPS: Final = 60
"""Of fits of two and three returns that go on, or begin anew, where noise isn't all they leave."""
TAIL_STEPS: Final = 10
MORE_TAIL_STEPS: Final = 5
"""Of the fit of each further shape, which begins with what the one before found."""
LONE_SHAPE, LONE_STEPS = 1, 5
"""Of the tail that is fitted without a return as well, from what it is with one on."""
TAIL_SHAPES: Final = (3, 2, 1, 5)
"""Shapes of the gamma distribution of the tail, the first one tried first."""
WORTH: Final = 3.0
"""Further shapes are tried where the first leaves less than so often what the best model does."""
SPLIT: Final = 1.6
"""Over m, in radians: half of the distance of two returns in their second start."""
DELAY_RAD: Final = 0.75
"""Mean of the prior of the tail's mean delay; its standard deviation is a factor e."""
PRIOR: Final = 1.0
"""Inverse variance of log d."""
MARGIN: Final = 6.0
"""Added to log n of the Bayesian information criterion for each unknown. Many positions are tried
where the criterion counts one; with this margin fewer than 1 of 1000 single returns are split."""
LEAST_RATIO, MOST_RATIO = 0.05, 4.0
"""Of a tail's first d over its mean in the prior."""


def turns_of(m: int) -> NDArray[np.float64]:
    """Return cosines, then sines, of j t, j = 1 to m, at phases t from 0 to a quarter of a turn.

    They, -t, pi - t and pi + t are 4 m + 6 phases around the turn, which are tried for a start.
    """
    angle = np.arange(m + 2)[:, None] * (2 * np.pi / (4 * m + 6)) * np.arange(1, m + 1)
    return np.concatenate([np.cos(angle), np.sin(angle)], axis=1)


def nothing(like: Array, score: Array, found: Bank) -> None:
    """Begin with no return, at a score that every model is better than."""
    for i in range(PLANES):
        found[i] = 0.0 * like
    found[SCORE], found[LEAST_SCORE] = score, score


def decay(x: Array) -> Array:
    """Return exp(-x), x >= 0, to single precision or 1e-15."""
    t = smaller(0.0625 * x, 1.0 / root_eps(x))  # beyond it, nothing is left
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


def offer_returns(
    order: Length, returns: Length, unknowns: Length, weight: Bank, x: Bank, y: Bank, w: Bank,
    cost: Array, penalty: Array, threshold: float, allowed: Any, found: Bank,
) -> None:  # fmt: skip
    """Put K returns in `found` wherever their score is better and they are `allowed`.

    They go into the average unless one of them has come to 0.
    """
    count = len(returns)
    score = cost + (2.0 * count) * penalty
    better = (score < found[SCORE]) & allowed
    zero = 0.0 * cost
    spread = bank(cost, unknowns, 0)
    sharp.deviations(order, returns, unknowns, weight, x, y, spread)
    strongest, faintest = w[0], w[0]
    for k in range(1, count):
        strongest, faintest = larger(strongest, w[k]), smaller(faintest, w[k])
    phase, square = 9.0 + zero, zero
    for k in range(count):
        size = larger(w[k], least(w[k]))
        variance = spread[count + k] / (size * size)
        at = phase_of(x[k], y[k])
        first = (w[k] >= threshold * strongest) & (at < phase)
        phase, square = select(first, at, phase), select(first, variance, square)
        found[X + k] = select(better, x[k], found[X + k])
        found[Y + k] = select(better, y[k], found[Y + k])
        found[WEIGHT + k] = select(better, w[k], found[WEIGHT + k])
        found[WEIGHT_VARIANCE + k] = select(better, spread[k], found[WEIGHT_VARIANCE + k])
        found[PHASE_VARIANCE + k] = select(better, variance, found[PHASE_VARIANCE + k])
    for k in range(count, MOST_RETURNS):
        for plane in (X, Y, WEIGHT):
            found[plane + k] = select(better, zero, found[plane + k])
    for plane in (TAIL, LENGTH, SHAPE):
        found[plane] = select(better, zero, found[plane])
    found[CHI_SQUARE] = select(better, cost, found[CHI_SQUARE])
    found[SCORE] = select(better, score, found[SCORE])
    found[COUNT] = select(better, float(count) + zero, found[COUNT])
    join(phase, square, score - (count + 1.0) * MARGIN, allowed & (faintest > 0.0), found)


def split(x2: Bank, y2: Bank, w2: Bank, cosine: float, sine: float, xs: Bank, ys: Bank) -> None:
    """Put two points in `xs` and `ys`, as far before the stronger one of two returns as behind.

    The third one is that of the other return.
    """
    first = w2[0] >= w2[1]
    x, y = select(first, x2[0], x2[1]), select(first, y2[0], y2[1])
    xs[0], ys[0] = x * cosine + y * sine, y * cosine - x * sine
    xs[1], ys[1] = x * cosine - y * sine, y * cosine + x * sine
    xs[2], ys[2] = select(first, x2[1], x2[0]), select(first, y2[1], y2[0])


def missed(cost: Array, free: Array) -> Any:
    """Say where a fit leaves more than noise does, to 1 %: another start may do better."""
    return cost > 2.0 * free + 4.0


def start_of_tail(x: Bank, y: Bank, w: Bank, mean: float) -> tuple[Array, ...]:
    """Return point, light, light of the tail, d over the prior's mean, and its logarithm.

    From two returns, of which the earlier one, within half a turn, is the direct one. A second one
    without weight says nothing about the delay, which is then the prior's `mean`.
    """
    dx, dy = x[0] * x[1] + y[0] * y[1], y[1] * x[0] - x[1] * y[0]
    first = dy >= 0.0
    sx, sy = select(first, x[0], x[1]), select(first, y[0], y[1])
    sw, sv = select(first, w[0], w[1]), select(first, w[1], w[0])
    # an angle up to its third power: enough for a start
    sine = select(dy < 0.0, -dy, dy)
    angle = select(dx > 0.0, sine * (1.0 + sine * sine / 6.0), 1.5 + 0.0 * sine)
    lone = smaller(w[0], w[1]) < 0.02 * (w[0] + w[1])
    strong = w[0] > w[1]
    sx, sy = select(lone & strong, x[0], sx), select(lone & strong, y[0], sy)
    sx, sy = select(lone & ~strong, x[1], sx), select(lone & ~strong, y[1], sy)
    sw, sv = select(lone, larger(w[0], w[1]), sw), select(lone, 0.0 * sv, sv)
    delay = select(lone, mean + 0.0 * angle, angle)
    ratio = larger(smaller(delay / mean, MOST_RATIO + 0.0 * delay), LEAST_RATIO + 0.0 * delay)
    return sx, sy, sw, sv, ratio, logarithm(ratio)


def worth_more_shapes(cost: Array, found: Bank) -> Any:
    """Say where a tail that leaves `cost` is near enough to the best model for other shapes."""
    return cost < WORTH * (found[CHI_SQUARE] + 10.0)


def offer_tail(
    order: Length, power: int, unknowns: Length, weight: Bank, prior: float, shapes: int, x: Array,
    y: Array, w: Array, v: Array, d: Array, t: Array, cost: Array, penalty: Array, allowed: Any,
    found: Bank,
) -> None:  # fmt: skip
    """Put a return with a tail in `found` wherever its score is better and it is `allowed`.

    In the average its shape is one of so many `shapes`, which share one prior.
    """
    score = cost + 4.0 * penalty
    better = (score < found[SCORE]) & allowed
    zero = 0.0 * cost
    spread = bank(cost, unknowns, 0)
    tail.deviations(order, power, unknowns, weight, prior, 0.0, w, v, d, spread)
    found[X], found[Y] = select(better, x, found[X]), select(better, y, found[Y])
    found[WEIGHT] = select(better, w, found[WEIGHT])
    for k in range(1, MOST_RETURNS):
        for plane in (X, Y, WEIGHT):
            found[plane + k] = select(better, zero, found[plane + k])
    found[TAIL], found[LENGTH] = select(better, v, found[TAIL]), select(better, d, found[LENGTH])
    found[SHAPE] = select(better, float(power) + zero, found[SHAPE])
    chi_square = larger(cost - prior * t * t, zero)
    found[CHI_SQUARE] = select(better, chi_square, found[CHI_SQUARE])
    found[SCORE] = select(better, score, found[SCORE])
    found[COUNT] = select(better, 1.0 + zero, found[COUNT])
    found[WEIGHT_VARIANCE] = select(better, spread[0], found[WEIGHT_VARIANCE])
    found[TAIL_VARIANCE] = select(better, spread[1], found[TAIL_VARIANCE])
    found[PHASE_VARIANCE] = select(better, spread[2], found[PHASE_VARIANCE])
    found[LENGTH_VARIANCE] = select(better, spread[3], found[LENGTH_VARIANCE])
    score = chi_square + 4.0 * penalty - (3.0 * MARGIN - 2.0 * math.log(shapes))
    allowed = allowed & (v > 0.0)
    join(phase_of(x, y), spread[2], score, allowed, found)


def start_lone(
    power: int, x: Array, y: Array, w: Array, v: Array, d: Array
) -> tuple[Array, Array, Array, Array]:
    """Return point, d and t of a tail without a return that is as late, and spread, as one with it.

    As wax has it, which light leaves only after it was scattered.
    """
    share = v / larger(w + v, least(w))
    late = (share * float(power)) * d
    square = late * ((1.0 + float(power)) * d - late)
    ratio = root(square * float(power)) / DELAY_RAD
    ratio = larger(smaller(ratio, MOST_RATIO + 0.0 * ratio), LEAST_RATIO + 0.0 * ratio)
    # half of the angle for its tangent: enough for a start
    half = 0.5 * (late - DELAY_RAD * ratio)
    scale = 1.0 / (1.0 + half * half)
    c, s = (1.0 - half * half) * scale, 2.0 * half * scale
    return x * c - y * s, x * s + y * c, ratio * (DELAY_RAD / float(power)), logarithm(ratio)


def join_lone(
    order: Length, power: int, unknowns: Length, weight: Bank, prior: float, shapes: int, x: Array,
    y: Array, w: Array, v: Array, d: Array, t: Array, cost: Array, penalty: Array, allowed: Any,
    found: Bank,
) -> None:  # fmt: skip
    """Take a tail without a return into the average, as often as any shape with one."""
    spread = bank(cost, unknowns, 0)
    tail.deviations(order, power, unknowns, weight, prior, tail.LONE, w, v, d, spread)
    score = larger(cost - prior * t * t, 0.0 * cost) + 3.0 * penalty
    score = score - (2.0 * MARGIN - 2.0 * math.log(shapes))
    join(phase_of(x, y), spread[2], score, allowed & (v > 0.0), found)


def bar_of_returns(unknowns: int, penalty: Array, found: Bank) -> Array:
    """Return the chi-square at which sharp returns weigh as much as the best model so far."""
    return found[LEAST_SCORE] - float(unknowns) * penalty + (0.5 * unknowns + 1.0) * MARGIN


def worth_more_returns(penalty: Array, found: Bank) -> Any:
    """Say where three returns may count a fifth of what the best model so far does, or more."""
    return bar_of_returns(6, penalty, found) > -3.0


def bar_of_tail(unknowns: int, penalty: Array, found: Bank) -> Array:
    """Return the same of a tail with a return, 4 unknowns, or none, but for its shape's share."""
    return found[LEAST_SCORE] - float(unknowns) * penalty + (float(unknowns) - 1.0) * MARGIN


def average_variance(numbers: Array, found: Bank) -> Array:
    """Return the average's variance, larger where no model explains the moments.

    By what the best one leaves over the numbers measured (Birge 1932).
    """
    return found[SPREAD] * larger(found[CHI_SQUARE] / numbers, 1.0 + 0.0 * numbers)
