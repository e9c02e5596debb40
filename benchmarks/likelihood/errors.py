"""How far the ranges of all estimators are off, on the same moments."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Sequence
from transientcam_driver.camera import Truth
from transientcam_experiments.paper.bench import WITHOUT_OUTLIERS, Bench, ReconstructedShot
from transientcam_moments.likelihood import MODEL_ERROR

Array = NDArray[Any]
ESTIMATORS: Final[Mapping[str, str]] = {
    "single-frequency": "single frequency",
    "pisarenko": "Pisarenko",
    "pisarenko-merged": "Pisarenko, merged",
    "maximum-entropy": "maximum entropy",
    "likelihood": "likelihood",
}
COLUMNS: Final = tuple(ESTIMATORS.values())
HEAD: Final = "median / 90 % / RMSE / bias, mm"


@dataclass(frozen=True, slots=True)
class Errors:
    """Of the range over pixels, in mm: of its size half and nine of ten, root mean square, mean."""

    median_mm: float
    p90_mm: float
    rmse_mm: float
    bias_mm: float
    missing: float

    def __str__(self) -> str:
        """As in a table."""
        lost = f", {self.missing:.1%} without" if self.missing > 0 else ""
        parts = (self.median_mm, self.p90_mm, self.rmse_mm)
        return " / ".join(map(_short, parts)) + f" / {self.bias_mm:+.1f}{lost}"


class Captured(NamedTuple):
    """A capture, gains and settings to reconstruct it with, and the true range (H, W) if lit."""

    shot: ReconstructedShot
    gains: Array | None
    settings: tm.Settings
    truth_m: Array


def _short(value: float) -> str:
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"


def errors_of(range_m: Array, truth_m: Array, turn_m: float) -> Errors:
    """Compare ranges, of which those a whole turn apart are the same, where there is a truth."""
    known = np.isfinite(truth_m)
    found = np.asarray(range_m, float)[known]
    there = np.isfinite(found)
    off_mm = 1e3 * (found - truth_m[known])[there]
    off_mm = np.remainder(off_mm + 500 * turn_m, 1e3 * turn_m) - 500 * turn_m
    size = np.abs(off_mm)
    return Errors(
        float(np.median(size)),
        float(np.quantile(size, 0.9)),
        float(np.sqrt(np.mean(off_mm**2))),
        float(off_mm.mean()),
        1 - float(there.mean()),
    )


def ranges(
    moments: Array,
    settings: tm.Settings,
    *,
    noise: tm.noise.MomentNoise | None = None,
    calibration: Array | None = None,
) -> dict[str, Array]:
    """Return the range (...) by each estimator; `noise`, where given, stands for the sensor's."""
    found = {}
    for name in ESTIMATORS:
        if noise is not None and name in ("likelihood", "pisarenko-merged"):
            assert settings.base_frequency_hz is not None
            if name == "likelihood":
                model = tm.likelihood(moments, noise, model_error=MODEL_ERROR)
                phase = model.separate(settings.threshold).phase_rad
            else:
                merged = tm.merge_returns(tm.pisarenko(moments), noise)
                phase = tm.separate(merged, settings.threshold).phase_rad
            found[name] = np.asarray(tm.range_m(phase, settings.base_frequency_hz))
            continue
        chosen = replace(settings, estimator=name)
        found[name] = np.asarray(
            tm.Reconstruction(moments, chosen, calibration=calibration).range_m
        )
    return found


def captured(bench: Bench, scene: str, sequence: Sequence) -> Captured:
    """Capture a scene without outliers, for estimators that know the sensor's noise."""
    shot = bench.shot(scene, sequence, options=WITHOUT_OUTLIERS)
    gains = bench.calibration(sequence, options=WITHOUT_OUTLIERS).gains.planes
    settings = replace(shot.found.settings, sensor=tm.noise.Sensor())
    truth_m = _first_return_m(shot.truth, settings.threshold)
    return Captured(shot, gains, settings, np.where(shot.truth.lit, truth_m, np.nan))


def _first_return_m(truth: Truth, threshold: float) -> Array:
    """Return the range (H, W) of the first return that counts, which is that of the surface seen.

    But where less than ``threshold`` of the strongest return's light comes from there.
    """
    if truth.kind != "sparse":
        return truth.range_m
    first = (truth.weight >= threshold * truth.weight.max(axis=0)).argmax(axis=0)
    delay_s = np.take_along_axis(truth.delay_s, first[None], axis=0)[0]
    return np.where(first > 0, tm.SPEED_OF_LIGHT_M_S * delay_s / 2, truth.range_m)


def turn_m(base_frequency_hz: float) -> float:
    """Return the unambiguous range."""
    return float(tm.range_m(np.float64(2 * np.pi), base_frequency_hz))
