"""Of several models of a pixel the one that explains its moments with the fewest unknowns.

What is found of a pixel is a bank of planes, in the order of `Found`. Three returns at most.
"""

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
    select,
    smaller,
)
from transientcam_moments.likelihood import _sharp as sharp, _tail as tail

MOST_RETURNS: Final = 3
X, Y, WEIGHT = 0, 3, 6
"""First plane of the points of the unit circle and the weights of each return."""
TAIL, LENGTH = 9, 10
"""Light v of the tail, and d; both 0 where there is no tail."""
CHI_SQUARE, SCORE, COUNT = 11, 12, 13
SHAPE: Final = 14
"""p of the tail; 0 where there is none."""
MEAN, SPREAD, LEAST_SCORE, TOTAL = 15, 16, 17, 18
"""Of the average over models; see `average`."""
FITTED: Final = 19
"""So many planes the fits fill; those behind have the variances of what was chosen."""
WEIGHT_VARIANCE, PHASE_VARIANCE = 19, 22
"""First plane of the variances of weights and phases of each return."""
TAIL_VARIANCE, LENGTH_VARIANCE = 25, 26
"""The variances of v and of log d; 0 where there is no tail."""
PLANES: Final = 27
STEPS: Final = (4, 8, 10)
"""Of the fits of one, two and three returns."""
TAIL_STEPS: Final = 10
MORE_TAIL_STEPS: Final = 5
"""Of the fit of each further shape, which begins with what the first one found."""
TAIL_SHAPES: Final = (3, 1, 2, 5)
"""Shapes of the gamma distribution of the tail, the first one tried first."""
WORTH: Final = 100.0
"""Further shapes are tried where the first leaves less than so often what the best model does."""
SPLIT: Final = 1.6
"""Over m, in radians: the second start of two returns is one return split by twice this."""
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
    found[SCORE] = score


def offer_returns(
    returns: Length,
    x: Bank,
    y: Bank,
    w: Bank,
    cost: Array,
    penalty: Array,
    allowed: Any,
    found: Bank,
) -> None:
    """Put K returns in `found` wherever their score is better and they are `allowed`."""
    count = len(returns)
    score = cost + (2.0 * count) * penalty
    better = (score < found[SCORE]) & allowed
    zero = 0.0 * cost
    for k in range(count):
        found[X + k] = select(better, x[k], found[X + k])
        found[Y + k] = select(better, y[k], found[Y + k])
        found[WEIGHT + k] = select(better, w[k], found[WEIGHT + k])
    for k in range(count, MOST_RETURNS):
        for first in (X, Y, WEIGHT):
            found[first + k] = select(better, zero, found[first + k])
    found[TAIL] = select(better, zero, found[TAIL])
    found[LENGTH] = select(better, zero, found[LENGTH])
    found[SHAPE] = select(better, zero, found[SHAPE])
    found[CHI_SQUARE] = select(better, cost, found[CHI_SQUARE])
    found[SCORE] = select(better, score, found[SCORE])
    found[COUNT] = select(better, float(count) + zero, found[COUNT])


def chosen(returns: Length, found: Bank) -> Any:
    """Say where K returns were chosen."""
    return (found[COUNT] == float(len(returns))) & ~has_tail(found)


def has_tail(found: Bank) -> Any:
    """Say where a return with a tail was chosen."""
    return found[LENGTH] > 0.0


def vary_returns(
    order: Length, returns: Length, unknowns: Length, weight: Bank, found: Bank
) -> None:
    """Put the variances of K returns in `found` wherever they were chosen."""
    count = len(returns)
    here = chosen(returns, found)
    spread = bank(weight[0], unknowns, 0)
    x, y = bank(weight[0], returns, 0), bank(weight[0], returns, 0)
    for k in range(count):
        x[k], y[k] = found[X + k], found[Y + k]
    sharp.deviations(order, returns, unknowns, weight, x, y, spread)
    for k in range(count):
        size = larger(found[WEIGHT + k], least(weight[0]))
        found[WEIGHT_VARIANCE + k] = select(here, spread[k], found[WEIGHT_VARIANCE + k])
        variance = spread[count + k] / (size * size)
        found[PHASE_VARIANCE + k] = select(here, variance, found[PHASE_VARIANCE + k])


def split(x: Array, y: Array, cosine: float, sine: float, xs: Bank, ys: Bank) -> None:
    """Put two points as far before a point of the unit circle as behind it in `xs` and `ys`."""
    xs[0], ys[0] = x * cosine + y * sine, y * cosine - x * sine
    xs[1], ys[1] = x * cosine - y * sine, y * cosine + x * sine


def missed(cost: Array, numbers: Array) -> Any:
    """Say where the fit of two returns leaves more than noise does: another start may do better."""
    return cost > numbers


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
    power: int,
    prior: float,
    x: Array,
    y: Array,
    w: Array,
    v: Array,
    d: Array,
    t: Array,
    cost: Array,
    penalty: Array,
    allowed: Any,
    found: Bank,
) -> None:
    """Put a return with a tail in `found` wherever its score is better and it is `allowed`."""
    score = cost + 4.0 * penalty
    better = (score < found[SCORE]) & allowed
    zero = 0.0 * cost
    found[X], found[Y] = select(better, x, found[X]), select(better, y, found[Y])
    found[WEIGHT] = select(better, w, found[WEIGHT])
    for k in range(1, MOST_RETURNS):
        for first in (X, Y, WEIGHT):
            found[first + k] = select(better, zero, found[first + k])
    found[TAIL], found[LENGTH] = select(better, v, found[TAIL]), select(better, d, found[LENGTH])
    found[SHAPE] = select(better, float(power) + zero, found[SHAPE])
    found[CHI_SQUARE] = select(better, larger(cost - prior * t * t, zero), found[CHI_SQUARE])
    found[SCORE] = select(better, score, found[SCORE])
    found[COUNT] = select(better, 1.0 + zero, found[COUNT])


def vary_tail(
    order: Length, power: int, unknowns: Length, weight: Bank, prior: float, found: Bank
) -> None:
    """Put the variances of a return with a tail of one shape in `found` wherever it was chosen."""
    here = has_tail(found) & (found[SHAPE] == float(power))
    spread = bank(weight[0], unknowns, 0)
    w, v, d = found[WEIGHT], found[TAIL], found[LENGTH]
    tail.deviations(order, power, unknowns, weight, prior, w, v, d, spread)
    found[WEIGHT_VARIANCE] = select(here, spread[0], found[WEIGHT_VARIANCE])
    found[PHASE_VARIANCE] = select(here, spread[2], found[PHASE_VARIANCE])
    found[TAIL_VARIANCE] = select(here, spread[1], found[TAIL_VARIANCE])
    found[LENGTH_VARIANCE] = select(here, spread[3], found[LENGTH_VARIANCE])
