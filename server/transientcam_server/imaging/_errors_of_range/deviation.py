"""The deviation between few captures, which strays do not blow up (decision 8)."""

import warnings
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[Any]
MEDIAN_OF_NORMAL: Final = 0.674490
"""Median of the absolute value of a standard normal variable."""
OF_FEW: Final = (
    *(1.0, 1.1978, 1.1063, 1.0575, 1.0651, 1.0406),
    *(1.0398, 1.0364, 1.0313, 1.0290, 1.0271),
)
"""How many times too large the median difference of 2, 3, ... 12 captures is in the median pixel;
of four million pixels drawn for each, known to 0.0005."""
_OF_MORE: Final = 0.32
"""By how much of itself it is too large with more of them, times their number."""


def typical_deviation(values: _Array) -> _Array:
    """Return the deviation (P) between captures (D, P), which outliers do not blow up.

    It is the median difference of two captures, as the deviation of the normal variable whose
    median difference is the same in the median pixel with as many captures. Captures without a
    value are NaN; so is the deviation where there are not two with one.
    """
    first, second = np.triu_indices(len(values), 1)
    apart = np.abs(values[first] - values[second])
    captures = np.isfinite(values).sum(axis=0)
    of_one = np.sqrt(2) * MEDIAN_OF_NORMAL * _too_large(len(values))[captures]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of pixels without two
        deviation: _Array = np.nanmedian(apart, axis=0) / of_one
    return deviation


@lru_cache(maxsize=64)
def _too_large(most: int) -> _Array:
    """Return by which factor the median difference of 0 to at least ``most`` captures is too large.

    Few captures make many differences that go together: of three, the middle one is the larger one
    of two gaps, which is more than the typical difference whatever the deviation.
    """
    more = [1 + _OF_MORE / captures for captures in range(2 + len(OF_FEW), most + 1)]
    return np.array([1.0, 1.0, *OF_FEW, *more])
