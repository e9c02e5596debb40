"""Capture time against accuracy: one sequence on a scene, compared with the scene's truth."""

import math
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import AppliedSequence, Camera, RawFrame, Truth
from transientcam_experiments.tradeoff.truth import Sample, count_returns, cumulative
from transientcam_server.imaging import MEDIAN_OF_NORMAL, Recipe
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
PHASES: Final = 128
"""Times of flight over one period at which densities are compared."""
OUTLIER_M: Final = 0.1
"""A range further off than this is an outlier."""
LONGEST_S: Final = 1e3
"""Any capture has come by then."""

_WORDS: Final = tomllib.loads(Path(__file__).with_name("quantities.toml").read_text("utf-8"))


def words_of(part: str, **constants: float) -> dict[str, str]:
    """Return what the quantities of a part are, by their names."""
    return {name: words.format(**constants) for name, words in _WORDS[part].items()}


QUANTITIES: Final = words_of("captures", outlier_m=OUTLIER_M)
"""What is measured, for the page."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameWithTruth:
    """A frame, and the truth."""

    raw: RawFrame
    truth: Truth


def capture(camera: Camera, frames: int, *, middle: bool = False) -> Iterator[FrameWithTruth]:
    """Capture frames with the sequence that is set, each with its truth: of its end, or middle."""
    simulation = camera.simulation
    assert simulation is not None  # noqa: S101 - only simulated cameras are measured
    camera.start()
    for _ in range(frames):
        raw = camera.read_frame(timeout_s=LONGEST_S)
        time_s = raw.device_time_s + raw.capture_s / 2 if middle else None
        yield FrameWithTruth(raw, simulation.truth(device_time_s=time_s))
    camera.stop()


def accuracy(
    frames: Iterable[FrameWithTruth],
    sample_of: Callable[[Truth], Sample],
    applied: AppliedSequence,
    *,
    settings: ReconstructionSettings,
    bits: int,
) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """Return mean and spread over the frames of each of `QUANTITIES`.

    ``sample_of`` gives the pixels whose whole impulse responses are compared.
    """
    recipe = Recipe(applied, settings, 2.0**bits - 1.0)
    ranges, each = [], []
    for frame in frames:
        range_m, values = _of_frame(frame, sample_of(frame.truth), recipe)
        ranges.append(range_m)
        each.append(values)
    means, spreads = summarised(each)
    means["range_std_m"], spreads["range_std_m"] = repeatability(np.stack(ranges)), None
    fixed = {"capture_s": applied.capture_s, "frame_rate_hz": applied.frame_rate_hz}
    return means | fixed, spreads | dict.fromkeys(fixed)


def summarised(
    each: list[dict[str, float]],
) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """Return mean and deviation over repetitions; None where not finite, or of one alone."""
    means: dict[str, float | None] = {}
    spreads: dict[str, float | None] = {}
    for name in each[0]:
        values = np.array([repetition[name] for repetition in each], dtype=float)
        finite = bool(np.isfinite(values).all())
        means[name] = float(values.mean()) if finite else None
        spreads[name] = float(values.std(ddof=1)) if finite and len(values) > 1 else None
    return means, spreads


def repeatability(ranges: _Array) -> float | None:
    """Return the deviation of ranges (repetitions, ...) of the same: typical difference of two.

    The median, over pixels and pairs of successive repetitions, of their absolute difference, as
    the standard deviation of the normal variable that has the same. Where few values stray far, as
    where an estimate splits a return, a standard deviation itself would measure those alone.
    None with less than two repetitions.
    """
    difference = np.abs(np.diff(ranges, axis=0))
    difference = difference[np.isfinite(difference)]
    if not difference.size:
        return None
    return float(np.median(difference) / (math.sqrt(2) * MEDIAN_OF_NORMAL))


def _of_frame(
    frame: FrameWithTruth, sample: Sample, recipe: Recipe
) -> tuple[_Array, dict[str, float]]:
    found: tm.Reconstruction = recipe.reconstruct(frame.raw)
    truth = frame.truth
    f_hz = recipe.base_frequency_hz
    lit = truth.lit
    seen = lit & np.asarray(found.has_range)
    range_m = np.where(lit, found.range_m, np.nan)
    single = np.remainder(np.angle(found.moments[1]), 2 * np.pi)
    values = _range_errors(range_m, truth.range_m, lit)
    others = {"maximum_entropy": found.peaks.first_rad, "single_frequency": single}
    for name, phase_rad in others.items():
        values[f"{name}_rmse_m"] = _rmse(tm.range_m(phase_rad, f_hz), truth.range_m, seen)
    values["returns_right"] = _returns_right(found.returns, truth, seen, recipe)
    values |= _density_errors(found.moments[:, sample.y, sample.x], sample, truth, f_hz)
    flags = np.asarray(found.flags)[lit]
    values["valid"] = float((flags == 0).mean())
    for flag in (tm.Flags.BIASED, tm.Flags.SATURATED):
        values[str(flag.name).lower()] = float(((flags & np.uint8(flag)) != 0).mean())
    return range_m, values


def _range_errors(range_m: _Array, true_m: _Array, lit: _Array) -> dict[str, float]:
    there = lit & np.isfinite(range_m)
    error_m = np.abs(range_m - true_m)[there]
    if not error_m.size:
        error_m = np.array([np.nan])
    return {
        "range_rmse_m": float(np.sqrt(np.mean(error_m**2))),
        "range_median_m": float(np.median(error_m)),
        "range_outliers": float(np.mean(error_m > OUTLIER_M)),
        "range_missing": 1.0 - float(there.sum() / lit.sum()),
    }


def _rmse(range_m: _Array, true_m: _Array, where: _Array) -> float:
    error_m = (range_m - true_m)[where & np.isfinite(range_m)]
    return float(np.sqrt(np.mean(error_m**2))) if error_m.size else float("nan")


def _returns_right(returns: tm.Returns, truth: Truth, seen: _Array, recipe: Recipe) -> float:
    """NaN where the truth is no set of returns."""
    if truth.kind != "sparse":
        return float("nan")
    threshold = recipe.settings.return_threshold
    found = count_returns(returns.weight, threshold=threshold)
    there = count_returns(truth.weight, threshold=threshold)
    return float((found == there)[seen].mean())


def _density_errors(b: _Array, sample: Sample, truth: Truth, f_hz: float) -> Mapping[str, float]:
    phase = 2 * np.pi * np.arange(PHASES) / PHASES
    brightness = truth.brightness[sample.y, sample.x]
    coefficients = tm.levinson(b)
    share = tm.cumulative(coefficients, phase) / brightness
    error = np.abs(share - cumulative(sample, phase, base_frequency_hz=f_hz))
    lower, upper = tm.bounds(b, phase)
    width = 2 * np.pi * (upper - lower).mean(axis=0) / b[0].real
    return {
        "cumulative_mean": float(np.nanmean(error)),
        "cumulative_worst": float(np.nanmean(error.max(axis=0))),
        "bound_width": float(np.nanmean(width)),
    }
