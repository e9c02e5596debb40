"""What chi-square exceeds by chance."""

import math
from functools import lru_cache
from typing import Final

import numpy as np

from transientcam_moments.arrays import MAX_HARMONICS, Array, namespace
from transientcam_moments.errors import ParameterError

SIGNIFICANCE: Final = 1e-3
"""Share of the pixels of which it is wrongly denied that noise explains them."""


def checked(significance: float) -> float:
    """Return a significance; raises ParameterError outside of 0 to 1."""
    if not 0 < significance < 1:
        raise ParameterError("significance", significance, "0 < significance < 1")
    return significance


def explained(chi_square: Array, degrees_of_freedom: Array, significance: float) -> Array:
    """Say where chi-square (...) is not above what noise exceeds with a probability.

    Without degrees of freedom nothing can contradict; NaN is not explained. Raises ParameterError
    for a significance outside of 0 to 1.
    """
    xp = namespace(chi_square)
    checked(significance)
    limits = [chi_square_quantile(free, significance) for free in range(2 * MAX_HARMONICS + 2)]
    limit = xp.asarray(np.array(limits))[degrees_of_freedom]
    return (chi_square <= limit) | ((degrees_of_freedom == 0) & (chi_square >= 0))


def ambiguous(lead: Array, significance: float) -> Array:
    """Say where another hypothesis may be the right one, by how much larger its chi-square is.

    That is where exp(-lead / 2), the ratio of their likelihoods, is above a significance. Raises
    ParameterError for one outside of 0 to 1.
    """
    return lead < -2 * math.log(checked(significance))


def reduced(chi_square: Array, degrees_of_freedom: Array) -> Array:
    """Return chi-square (...) over its degrees of freedom; NaN where there are none."""
    xp = namespace(chi_square)
    there = degrees_of_freedom > 0
    usable = xp.where(there, degrees_of_freedom, 1).astype(chi_square.dtype)
    return xp.where(there, chi_square / usable, np.nan).astype(chi_square.dtype)


@lru_cache(maxsize=256)
def chi_square_quantile(free: int, significance: float) -> float:
    """Return what chi-square of so many degrees of freedom exceeds with a given probability.

    By bisection on the distribution's closed form for whole numbers of degrees of freedom.
    """
    if free < 1:
        return 0.0
    low, high = 0.0, free + 10.0
    while _exceeding(free, high) > significance:
        high *= 2
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if _exceeding(free, middle) > significance else (low, middle)
    return high


def _exceeding(free: int, value: float) -> float:
    """Return the probability that chi-square exceeds a value (Abramowitz and Stegun, 26.4.4-5)."""
    half, odd = value / 2, free % 2
    total = math.erfc(math.sqrt(half)) if odd else 0.0
    for k in range(free // 2):
        power = k + odd / 2
        total += math.exp(power * math.log(half) - half - math.lgamma(power + 1))
    return total
