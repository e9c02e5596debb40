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
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from statistics import NormalDist
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from transientcam_server.imaging import MEDIAN_OF_NORMAL, typical_deviation
from transientcam_server.planning._scene.scene import STRATUM

_Array = NDArray[Any]
TOLERANCES_M: Final = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
"""How far off ranges may be in the shares that are stated of any prediction."""
OUTLYING: Final = 4.0
"""What noise of the look adds to one pixel, over what those alike have, at most."""
KINDS_SPREAD: Final = 0.03
"""Standard deviation of the share of pixels that are predicted to be of another kind than they are:
as far as predicted and measured shares of outliers are apart (docs/plans.md)."""
_FEW_DRAWS: Final = 3
"""Every third draw tells the intervals of shares."""
_OF_MEDIAN: Final = math.pi / 2
"""Variance of the median of draws, which is in their bias, over that of one, times their number."""
_NORMAL: Final = np.array([NormalDist().inv_cdf(0.5 + (k + 0.5) / 64) for k in range(32)])
"""Absolute values of a standard normal variable, each as likely."""


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

    def without_noise_of_look(self, squares: Sequence[_Array]) -> "PixelErrors":
        """Return errors whose bias has no noise of the look in it, by what pixels alike share.

        What noise adds to the square of a bias it adds once more to that of what was seen with more
        noise: extrapolated to none (Cook and Stefanski 1994).
        ``squares``: Squares (P) of the bias as it was seen, and of each that was seen with more.
        """
        here = np.maximum(uniform_filter1d(squares[0], STRATUM), 1e-18)
        noise = np.minimum(np.mean(squares[1:], axis=0) - squares[0], OUTLYING * here)
        left = np.sqrt(np.clip(1 - uniform_filter1d(noise, STRATUM) / here, 0.0, 1.0))
        left = np.where(np.isfinite(self.bias_m), left, 1.0)
        centre_m = self.centre_m - (1 - left) * self.signed_m
        return replace(self, bias_m=left * self.bias_m, centre_m=centre_m)


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


def summed_up(
    std_m: _Array, bias_m: _Array, share: float | None, draws: int
) -> tuple[float, float, float]:
    """Return typical deviation and median bias of pixels (P), and the error of both together.

    ``share``: Of the ranges that are within the error; None for that of the median pixel.
    ``draws``: Of each pixel, whose noise is in the bias.
    """
    if share is None:
        error_m = np.median(np.hypot(std_m, bias_m))
    else:
        both = np.concatenate([_NORMAL, -_NORMAL])
        own_m = np.sqrt(np.maximum(bias_m**2 - _OF_MEDIAN / draws * std_m**2, 0.0))
        error_m = np.quantile(np.abs(own_m + both[:, None] * std_m), share)
    return float(typical(std_m)), float(np.median(bias_m)), float(error_m)


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
    value_of: Callable[[_Array], _Array],
    picks: _Array,
    spread: float = MODEL_SPREAD,
) -> Figure:
    """Return the figure of the errors (P) of pixels.

    ``value_of``: Errors (..., P): an array (...).
    ``picks``: Indices (`RESAMPLED`, P) of pixels, drawn with replacement: samples of the same
    scene.
    ``spread``: Standard deviation of the logarithm of measured over predicted errors.
    """
    value = max(float(value_of(errors_m)), _LEAST_M)
    sampled = np.maximum(value_of(errors_m[picks]), _LEAST_M)
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


def resampled(count: int, samples: int, seed: int) -> _Array:
    """Return places (samples, count) of other samples of as many pixels.

    Each is of the same kinds, but these are as much more or less frequent as a prediction may be
    wrong about them: the first ones by a share that has the deviation `KINDS_SPREAD`, at most.
    """
    random = np.random.default_rng(seed)
    place = (np.arange(count) + 0.5) / count
    tilt = 4 * KINDS_SPREAD * random.normal(size=(samples, 1))
    tilted = np.clip(place + tilt * place * (1 - place), 0.0, 1.0 - 1e-9)
    first = (tilted * count).astype(int) // STRATUM * STRATUM
    width = np.minimum(STRATUM, count - first)
    return np.asarray(first + random.integers(0, width))


def error_figure(
    errors: PixelErrors, farthest_m: _Array | None, picks: _Array, drift_m: float
) -> Figure:
    """Return the figure of noise and bias together of the median pixel."""
    of = errors, farthest_m, picks, drift_m
    return _error(lambda bias_m: np.hypot(errors.std_m, bias_m), median, *of)


def share_figure(
    share: float, errors: PixelErrors, farthest_m: _Array | None, picks: _Array, drift_m: float
) -> Figure:
    """Return the figure of what a share of the ranges is within; few draws tell its interval."""

    def value(off_m: _Array) -> _Array:
        return quantiles(share, off_m)

    few = replace(errors, apart_m=errors.apart_m[::_FEW_DRAWS])
    found = _error(few.off_m, value, few, farthest_m, picks, drift_m)
    whole = float(value(errors.off_m(np.hypot(errors.bias_m, drift_m))))
    scale = whole / found.median if 0 < found.median < math.inf else 1.0
    return Figure(*(scale * getattr(found, each.name) for each in fields(Figure)))


def _error(
    of_bias: Callable[[_Array], _Array],
    value: Callable[[_Array], _Array],
    errors: PixelErrors,
    farthest_m: _Array | None,
    picks: _Array,
    drift_m: float,
) -> Figure:
    """Return the figure of an error; ``farthest_m`` (P) is the most bias, where none is known.

    ``of_bias``: Returns the errors of pixels (P, ...) were their bias (P) the one given.
    ``value``: Of errors (..., P, ...), the figure (...).
    ``drift_m``: Expected; there may be none, and twice as much.
    """
    expected = figure(of_bias(np.hypot(errors.bias_m, drift_m)), value, picks)
    reach = KNOWN if farthest_m is None else UNKNOWN
    least_m = reach.least_bias * errors.bias_m
    most_m = np.hypot(reach.most_bias * errors.bias_m, 2 * drift_m)
    least, most = (
        figure(of_bias(bias_m), value, picks, reach.spread) for bias_m in (least_m, most_m)
    )
    found = between(expected, least, most)
    if farthest_m is not None:  # how much more than the least this look cannot tell
        return replace(found, high=math.inf)
    # with the most bias it is known as closely as intervals say
    return replace(found, with_margin=min(found.with_margin, most.with_margin))


def quantiles(shares: _Array | float, off_m: _Array) -> _Array:
    """Return how far shares (S) of the ranges (..., P, D) are off at most: (S, ...)."""
    flat = off_m.reshape((*off_m.shape[:-2], -1))
    return np.asarray(np.quantile(flat, shares, axis=-1, method="higher"))


def typical(deviations: _Array) -> _Array:
    """Return the typical difference of two captures over pixels (..., P), as a deviation (...).

    The same measure as of captured frames, whose bright and dark pixels are mixed.
    """
    mixed = (_NORMAL[:, None] * deviations[..., None, :]).reshape((*deviations.shape[:-1], -1))
    return median(mixed) / MEDIAN_OF_NORMAL


def median(values: _Array) -> _Array:
    """Return the median over pixels (..., P), which are last."""
    return np.asarray(np.median(values, axis=-1))
