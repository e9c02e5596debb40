"""Noise and bias of ranges: one definition for what is predicted and what is measured."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.imaging import typical_deviation

_Array = NDArray[Any]
TOLERANCES_M: Final = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
"""How far off ranges may be in the shares that are stated of any prediction."""


@dataclass(frozen=True, slots=True, eq=False)
class PixelErrors:
    """Errors of the range of P pixels.

    ``std_m``: (P) standard deviation between captures: the typical difference of two captures, as
    the deviation of the normal variable that has the same (decision 8).
    ``bias_m``: (P) how far the median of the captures is off, without sign. The noise of that
    median is part of it: with 30 captures and no bias it is 0.15 of the deviation.
    ``centre_m``: (P) median of the captures; 0 where there are no two.
    ``apart_m``: (D, P) range less truth of each capture; infinite where it has none.
    ``signed_m``: (P) that of the median of the captures.
    """

    std_m: _Array
    bias_m: _Array
    centre_m: _Array
    apart_m: _Array
    signed_m: _Array

    @property
    def error_m(self) -> _Array:
        """(P) root sum of squares of deviation and bias."""
        return np.hypot(self.std_m, self.bias_m)

    def off_m(self, bias_m: _Array) -> _Array:
        """Return how far each range (P, D) is off, without sign, were the bias (P) this one."""
        noise_m = np.where(self.signed_m < 0, -1.0, 1.0) * (self.apart_m - self.signed_m)
        known = np.isfinite(noise_m) & np.isfinite(bias_m)
        return np.where(known, np.abs(np.where(known, noise_m + bias_m, 0.0)), np.inf).T

    def farthest_m(self, earliest_m: _Array, latest_m: _Array) -> _Array:
        """Return the bias (P) if the truth is the one of two ranges (P) that is farther away."""
        off_m = np.maximum(np.abs(self.centre_m - earliest_m), np.abs(self.centre_m - latest_m))
        return np.asarray(np.maximum(off_m, self.bias_m))


def pixel_errors(
    range_m: _Array, true_m: _Array, uncertainty_m: _Array | float = 0.0
) -> PixelErrors:
    """Measure the errors of captured or drawn ranges.

    ``range_m``: (D, P), D >= 2 ranges of each pixel; NaN where a capture has none. A pixel without
    two ranges has infinite errors.
    ``true_m``: (P) what they should be.
    ``uncertainty_m``: (P) by how much that may itself be wrong; counts as bias.
    """
    count = np.isfinite(range_m).sum(axis=0)
    enough = count >= 2
    known = np.where(enough, range_m, 0.0)
    std_m = typical_deviation(known)
    centre_m = np.nanmedian(known, axis=0)
    bias_m = np.hypot(centre_m - true_m, uncertainty_m)
    std_m = np.where(enough, std_m, np.inf)
    bias_m = np.where(enough, bias_m, np.inf)
    apart_m = np.where(enough & np.isfinite(range_m), range_m - true_m, np.inf)
    return PixelErrors(std_m, bias_m, centre_m, apart_m, np.where(enough, centre_m - true_m, 0.0))
