"""Noise and bias of a frame's range, pixel by pixel, as far as the frame itself shows them.

Noise is that of the sensor, drawn and put through the estimator. Bias is known by disagreement
(decision 8): the frame's own estimator without its highest harmonic and the likelihood resolve
returns differently, and where nothing is left to resolve they agree. Noise makes them disagree,
too, but in neighbouring pixels independently, so that the median over these is taken. It is a
figure of the frame alone; a plan rests on a look at more frequencies.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam.documents import RangeAccuracyDocument, TrustCountsDocument
from transientcam.wire import Trust
from transientcam_driver import RawFrame
from transientcam_moments.reconstruction import least_harmonics
from transientcam_server.imaging._errors_of_range.deviation import (
    MEDIAN_OF_NORMAL,
    typical_deviation,
)
from transientcam_server.imaging._errors_of_range.evidence import median_around
from transientcam_server.imaging._errors_of_range.noise import moment_noise
from transientcam_server.imaging._errors_of_range.ranging import ranges_m
from transientcam_server.imaging._errors_of_range.trust import judged, not_judged
from transientcam_server.imaging._recipe.recipe import Recipe

_Array = NDArray[Any]
WITHIN: Final = 0.9
"""Share of the trusted pixels that the metadata's interval is of."""
DRAWS, QUICK_DRAWS = 4, 16
"""Noisy copies of a frame; where the estimator is the phase of one moment."""
SPARSE_PX: Final = 4
"""Rows and columns between pixels, where there is no time for all of them."""
_QUICK: Final = ("likelihood", "pisarenko", "single-frequency")
"""Estimators that compiled kernels make quick."""
_UNMOVED: Final = ("likelihood", "single-frequency")
"""Estimators whose range noise scatters around where it would be without."""
OF_FEW_DRAWS: Final = 1.07
"""So that two thirds of normal errors are within a deviation that few copies tell."""
_SEED: Final = 0


@dataclass(frozen=True, eq=False)
class RangeAccuracy:
    """Predicted errors of a frame's range."""

    std_m: _Array
    """(H, W) standard deviation by the noise of the sensor; NaN without a range."""
    bias_m: _Array
    """(H, W) how far the range is off for good, without sign, as far as the frame shows it; NaN
    without a range, and where there is one frequency alone."""
    error_m: _Array
    """(H, W) half width of the interval that holds the range of this pixel with 90 % probability;
    NaN where the bias is."""
    trust: _Array
    """(H, W) `Trust`: why a range is not to be trusted, 0 where it is."""
    every_px: int = 1
    """The errors are of one pixel in so many rows and columns, and stand for those around it."""
    not_judged: tuple[str, ...] = ()
    """The reasons that no pixel can have, as nothing that is known would tell them."""

    def to_document(self) -> RangeAccuracyDocument:
        """Return shares, and errors of the median pixel with a range, as a frame's metadata do."""
        counts = np.bincount(self.trust.ravel(), minlength=len(Trust)).tolist()
        trusted_m = self.error_m[(self.trust == Trust.TRUSTED) & np.isfinite(self.error_m)]
        return {
            "trusted_share": counts[Trust.TRUSTED] / self.trust.size,
            "within_m": float(np.quantile(trusted_m, WITHIN)) if trusted_m.size else None,
            "trust": cast("TrustCountsDocument", {t.name.lower(): counts[t] for t in Trust}),
            "range_error_m": _median(self.error_m),
            "range_std_m": _median(self.std_m),
            "range_bias_m": _median(self.bias_m),
            "every_px": self.every_px,
            "not_judged": list(self.not_judged),
        }


def spacing_px(recipe: Recipe, *, ready: Callable[[str, int], bool] = tm.kernels.ready) -> int:
    """Return how far apart the pixels are whose errors a live frame has time for.

    All of them where every estimator that is needed is compiled (0.1 s at 163 x 120 pixels); in
    NumPy, and by maximum entropy, that takes 1 to 5 s, and `SPARSE_PX` a sixteenth of it.
    ``ready`` says whether the kernel of an estimator and an order is compiled, and prepares it.
    """
    m, own = recipe.applied.sequence.harmonics, recipe.technique
    orders = [m] if m > 1 else []  # nothing else is asked where m = 1
    if own == "likelihood":
        orders += [1] if m == 1 else [m - 1]
    compiled = [ready("likelihood", order) for order in orders]  # each is asked for, and prepared
    return 1 if own in _QUICK and all(compiled) else SPARSE_PX


def range_accuracy(
    recipe: Recipe, found: tm.Reconstruction, every_px: int = 1, raw: RawFrame | None = None
) -> RangeAccuracy:
    """Predict noise and bias of a frame's range (H, W), and judge each pixel.

    By a recipe with a sensor. One pixel in every ``every_px`` rows and columns stands for those
    around it. Temperature and motion are those of ``raw``, the capture; None leaves these out.
    """
    if not recipe.applied.sequence.sampling.consecutive:
        return _of_gaps(found)
    grid = np.s_[..., every_px // 2 :: every_px, every_px // 2 :: every_px]
    has_range = np.asarray(found.has_range)
    seen = has_range[grid]
    range_m = np.asarray(found.range_m)[grid]
    frame = _Frame(
        recipe,
        np.asarray(found.smoothed)[grid][:, seen],
        np.asarray(moment_noise(recipe, found).variance, dtype=np.float32)[grid][:, seen],
    )
    turn_m = float(tm.range_m(2 * np.pi, recipe.base_frequency_hz))

    def shift_m(other_m: _Array) -> Any:  # whatever turn a range is in
        return np.remainder(other_m - range_m[seen] + turn_m / 2, turn_m) - turn_m / 2

    drawn_m = shift_m(frame.drawn_m())
    unmoved = recipe.technique in _UNMOVED
    if unmoved:
        std_m = typical_deviation(drawn_m)
    else:  # a copy is off as the frame itself is
        std_m = np.median(np.nan_to_num(np.abs(drawn_m)), axis=0) / MEDIAN_OF_NORMAL
    # few draws tell the deviation over that of the first moment in a neighbourhood, not in a pixel
    with np.errstate(all="ignore"):
        of_first = np.sqrt(frame.variance[1]) / np.abs(frame.b[1])
        times = median_around(_placed(std_m / of_first, seen))[seen]
    std_m = OF_FEW_DRAWS * np.fmax(times * of_first, 0.0 if unmoved else std_m)
    std_m = _placed(std_m, seen)
    shifts_m = [_placed(shift_m(other_m), seen) for other_m in frame.others_m()]
    unknown = np.full(seen.shape, np.nan, dtype=np.float32)
    bias_m = np.max([np.abs(median_around(each)) for each in shifts_m], axis=0, initial=0.0)
    bias_m = np.where(np.isfinite(range_m), bias_m, np.nan) if shifts_m else unknown
    std_m, bias_m = (_around(each, has_range, every_px) for each in (std_m, bias_m))
    error_m, trust = judged(recipe, found, std_m, bias_m, raw, every_px)
    return RangeAccuracy(std_m, bias_m, error_m, trust, every_px, not_judged(recipe, raw))


def _around(plane: _Array, has_range: _Array, every_px: int) -> _Array:
    """Let pixels of a coarser grid stand for those around them that have a range."""
    if every_px == 1:
        return plane
    nearest = [
        np.minimum(np.arange(n) // every_px, m - 1)
        for n, m in zip(has_range.shape, plane.shape, strict=True)
    ]
    return np.where(has_range, plane[np.ix_(*nearest)], np.float32(np.nan))


def _of_gaps(found: tm.Reconstruction) -> RangeAccuracy:
    """Return what an estimate of any multiples says of itself; nothing disagrees with it."""
    shape = np.shape(found.range_m)
    std_m = np.asarray(found.range_scatter_m(), dtype=np.float32).reshape(shape)
    unknown_m = np.full_like(std_m, np.nan)
    trust = np.where(found.has_range, Trust.TRUSTED, Trust.NO_RANGE).astype(np.uint8)
    return RangeAccuracy(std_m, unknown_m, unknown_m, trust)


@dataclass(frozen=True, eq=False)
class _Frame:
    """Smoothed moments (m + 1, P) of the pixels with a range, and the variance of their parts."""

    recipe: Recipe
    b: _Array
    variance: _Array

    def drawn_m(self) -> _Array:
        """Return the ranges (D, P) of noisy copies."""
        variance = self.variance.copy()
        if self.recipe.applied.sequence.zeroth == "estimated":
            variance[0] = 0
        random = np.random.default_rng(_SEED)
        own = self.recipe.technique
        draws = QUICK_DRAWS if own == "single-frequency" else DRAWS
        drawn = tm.noise.draw(self.b, tm.noise.MomentNoise(variance), random, draws=draws)
        spread = np.broadcast_to(self.variance[:, None], drawn.shape)
        flat = (len(self.b), -1)
        return self._ranges_m(drawn.reshape(flat), spread.reshape(flat), own).reshape((draws, -1))

    def others_m(self) -> list[_Array]:
        """Return the range (P) by every other way that there is; none where m = 1."""
        m = len(self.b) - 1
        if m == 1:
            return []
        own = self.recipe.technique
        fewer = own if m > least_harmonics(own) and m > 2 else "single-frequency"
        found = [self._ranges_m(self.b[:m], self.variance[:m], fewer)]
        if own != "likelihood":
            found.append(self._ranges_m(self.b, self.variance, "likelihood"))
        return found

    def _ranges_m(self, b: _Array, variance: _Array, estimator: str) -> _Array:
        sequence = self.recipe.applied.sequence
        return ranges_m(
            b,
            variance,
            estimator,
            sequence.base_frequency_hz,
            self.recipe.settings,
            zeroth=sequence.zeroth,
        )


def _placed(values: _Array, seen: _Array) -> _Array:
    """Return values of the pixels that are seen in their places, NaN elsewhere."""
    plane = np.full(seen.shape, np.nan, dtype=np.float32)
    plane[seen] = values
    return plane


def _median(plane: _Array) -> float | None:
    known = plane[np.isfinite(plane)]
    return float(np.median(known)) if known.size else None
