"""Noise, bias and outliers of ranges: one definition for what is predicted and what is measured."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.imaging import typical_deviation

_Array = NDArray[Any]
OUTLIER_DEVIATIONS: Final = 5.0
"""A range further off than so many times the error of the median pixel is an outlier."""
_LEAST_ERROR_M: Final = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class PixelErrors:
    """Errors of the range of P pixels.

    Attributes
    ----------
    std_m
        (P) standard deviation between captures: the typical difference of two captures, as the
        deviation of the normal variable that has the same (decision 8).
    bias_m
        (P) how far the median of the captures is off, without sign. The noise of that median is
        part of it: with 30 captures and no bias it is 0.15 of the deviation.
    centre_m
        (P) median of the captures; 0 where there are no two.
    outlier_share
        Share of the ranges that are off by more than `OUTLIER_DEVIATIONS` times the error of the
        median pixel, by noise or for good.
    """

    std_m: _Array
    bias_m: _Array
    centre_m: _Array
    outlier_share: float

    @property
    def error_m(self) -> _Array:
        """(P) root sum of squares of deviation and bias."""
        return np.hypot(self.std_m, self.bias_m)

    def farthest_m(self, earliest_m: _Array, latest_m: _Array) -> _Array:
        """Return the bias (P) if the truth is the one of two ranges (P) that is farther away."""
        off_m = np.maximum(np.abs(self.centre_m - earliest_m), np.abs(self.centre_m - latest_m))
        return np.asarray(np.maximum(off_m, self.bias_m))


def pixel_errors(
    range_m: _Array, true_m: _Array, uncertainty_m: _Array | float = 0.0
) -> PixelErrors:
    """Measure the errors of captured or drawn ranges.

    Parameters
    ----------
    range_m
        (D, P), D >= 2 ranges of each pixel; NaN where a capture has none. A pixel without two
        ranges has infinite errors.
    true_m
        (P) what they should be.
    uncertainty_m
        (P) by how much that may itself be wrong; counts as bias.
    """
    count = np.isfinite(range_m).sum(axis=0)
    enough = count >= 2
    known = np.where(enough, range_m, 0.0)
    std_m = typical_deviation(known)
    centre_m = np.nanmedian(known, axis=0)
    bias_m = np.hypot(centre_m - true_m, uncertainty_m)
    std_m = np.where(enough, std_m, np.inf)
    bias_m = np.where(enough, bias_m, np.inf)
    limit_m = OUTLIER_DEVIATIONS * max(float(np.median(np.hypot(std_m, bias_m))), _LEAST_ERROR_M)
    near = np.abs(range_m - true_m) <= limit_m  # a range that is missing is an outlier, too
    return PixelErrors(std_m, bias_m, centre_m, 1.0 - float(near.mean()))
