"""Noise and bias of ranges, and intervals of predicted errors: where a capture is expected to be.

One definition of both serves what is predicted and what is measured. The interval of the noise
covers the sampling of pixels and what the model is wrong by. That of an error has two ends of its
own: the error with the least bias that may be expected, and that with the most. Where the moments
tell the bias, these are shares of the predicted one (`KNOWN`). Where they do not, the light may
begin at any range that they do not contradict (`plausible`), and what is predicted of the bias is
worth less (`UNKNOWN`). ``python -m benchmarks promises`` measures what both hold, with ``--seed``
on random scenes.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import NormalDist
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


COVERAGE: Final = 0.9
"""Of the intervals."""
LIKELY: Final = 0.9
"""Share of the captures that are to meet a target. It is more than the 80 % that docs/plans.md
holds plans to: those on scenes with an unknown bias fail whatever the margin (decision 12)."""
MODEL_SPREAD: Final = 0.08
"""Standard deviation of the logarithm of measured over predicted errors beyond what the sampling
of pixels explains (docs/accuracy.md)."""


@dataclass(frozen=True, slots=True)
class Reach:
    """How far the interval of an error reaches (docs/plans.md, decision 14).

    ``least_bias``, ``most_bias``: Measured over predicted bias.
    ``spread``: As `MODEL_SPREAD`.
    """

    least_bias: float
    most_bias: float
    spread: float


KNOWN: Final = Reach(least_bias=0.5, most_bias=1.5, spread=0.03)
"""Where the moments tell the bias."""
UNKNOWN: Final = Reach(least_bias=0.5, most_bias=3.0, spread=0.06)
"""Where they do not."""
DOUBTFUL: Final = 2.0
"""A bias is not known where ranges that the moments do not contradict make the error larger than so
many times the predicted one."""
DISAGREEING: Final = 0.25
"""Nor where the estimators of the look disagree about the direct range by more than this share of
the predicted error (docs/plans.md, decision 14)."""
RESAMPLED: Final = 100
_LEAST_M: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Figure:
    """A predicted error in m and its interval.

    ``median``: Of the median lit pixel.
    ``low``, ``high``: `COVERAGE` of the captures measure a value between them. An infinite end is
    not known.
    ``p90``: 90 % of the pixels are predicted to be better.
    ``with_margin``: What `LIKELY` of the captures measure less than: what a target is held against.
    """

    median: float
    low: float
    high: float
    p90: float
    with_margin: float

    def to_document(self) -> dict[str, float | None]:
        """Return it as JSON, where an open end is null."""
        high = self.high if math.isfinite(self.high) else None
        return {"median": self.median, "low": self.low, "high": high, "p90": self.p90}


def figure(
    errors_m: _Array,
    median: Callable[[_Array], _Array],
    picks: _Array,
    spread: float = MODEL_SPREAD,
) -> Figure:
    """Return the figure of the errors (P) of pixels.

    ``median``: Of errors (..., P): an array (...).
    ``picks``: Indices (`RESAMPLED`, P) of pixels, drawn with replacement: samples of the same
    scene.
    ``spread``: Standard deviation of the logarithm of measured over predicted errors.
    """
    value = max(float(median(errors_m)), _LEAST_M)
    sampled = np.maximum(median(errors_m[picks]), _LEAST_M)
    low, high, likely = (
        _widened(value, float(np.quantile(sampled, part)), NormalDist().inv_cdf(part), spread)
        for part in (0.5 - COVERAGE / 2, 0.5 + COVERAGE / 2, LIKELY)
    )
    return Figure(value, low, high, float(np.quantile(errors_m, 0.9)), likely)


def between(error: Figure, least: Figure, most: Figure) -> Figure:
    """Return the figure of an error, with the interval from its least to its most."""
    return replace(error, low=least.low, high=most.high)


def _widened(value: float, sampled: float, deviations: float, spread: float) -> float:
    """Add what the model may be wrong by to a quantile of the median of sampled pixels.

    Both as logarithms, as independent: ``deviations`` is the quantile of a normal variable.
    """
    if not (0 < sampled < math.inf and value < math.inf):
        return sampled
    by_sampling, by_model = math.log(sampled / value), deviations * spread
    outwards = max(by_sampling, 0.0) if deviations > 0 else min(by_sampling, 0.0)
    return value * math.exp(math.copysign(math.hypot(outwards, by_model), deviations))
