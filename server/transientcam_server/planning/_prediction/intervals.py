"""Intervals of predicted errors: between which values a capture is expected to measure them.

The interval of the noise covers the sampling of pixels and what the model is wrong by. The interval
of an error has two ends of its own: the error with the least bias that may be expected, and that
with the most. Where the moments tell the bias, these are shares of the predicted one (`KNOWN`).
Where they do not, the light may begin at any range that they do not contradict (`plausible`), and
what is predicted of the bias is worth less (`UNKNOWN`). ``python -m benchmarks promises`` measures
what both hold, with ``--seed`` on random scenes.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[Any]
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
