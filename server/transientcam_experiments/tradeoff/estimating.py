"""Computing time against the error of the range: every technique on the same noisy moments."""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_experiments.tradeoff.capture import OUTLIER_M, words_of
from transientcam_moments.comparisons import PLUGINS, TECHNIQUES, Technique, separated
from transientcam_moments.moment_problem import DIRECT_THRESHOLD

_Array = NDArray[Any]
_Clock = Callable[[], float]
SAMPLE_PIXELS: Final = 96
"""Pixels whose range is compared with the truth; slow techniques are timed on them alone."""
ENOUGH_S: Final = 0.5
"""Techniques that take longer are timed once."""

QUANTITIES: Final = words_of("estimators", sample_pixels=SAMPLE_PIXELS, outlier_m=OUTLIER_M)
"""What is measured, for the page."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The moments of a frame, and its true range."""

    moments: _Array
    """(m + 1, H, W), biased."""
    base_frequency_hz: float
    """Of the moments."""
    truth_m: _Array
    """(H, W) range of the first return, NaN where no light is."""
    variance: _Array | None = None
    """(m + 1, H, W) of the moments, where it is known."""


def points(harmonics: int) -> Iterator[tuple[Technique, Mapping[str, Any]]]:
    """Yield the techniques that a number of harmonics is enough for, as points."""
    others = (each for each in PLUGINS.statements().values() if isinstance(each, Technique))
    for technique in (*TECHNIQUES.values(), *others):
        if technique.measures == "moments" and technique.least_harmonics <= harmonics:
            yield (
                technique,
                {
                    "estimator": technique.name,
                    "label": technique.label,
                    "harmonics": harmonics,
                    "planar": technique.planar,
                },
            )


def measure(
    technique: Technique,
    scene: Scene,
    *,
    repetitions: int,
    seed: int,
    clock: _Clock = time.perf_counter,
) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """Return the `QUANTITIES` of a technique, and the spread of its time.

    A technique that looks at neighbours has none in the sample.
    Raises PluginFailed where one of another package does.
    """
    lit = np.flatnonzero(np.isfinite(scene.truth_m))
    chosen = np.random.default_rng(seed).permutation(lit)[:SAMPLE_PIXELS]
    flat = scene.moments.reshape((scene.moments.shape[0], -1))
    sample = np.ascontiguousarray(flat[:, chosen])
    variance, of_sample = scene.variance, None
    if variance is not None:
        of_sample = variance.reshape(flat.shape)[:, chosen]
    frequencies_hz = scene.base_frequency_hz * np.arange(len(flat))

    def first_rad(b: _Array, variance: _Array | None) -> _Array:
        name = technique.name
        if name in TECHNIQUES:
            return np.asarray(technique.estimate(b).first_phase_rad())
        found = separated(name, b, variance, frequencies_hz, DIRECT_THRESHOLD)
        return np.asarray(found.phase_rad)

    phase = first_rad(sample, of_sample)  # fills caches, too
    whole, known = (scene.moments, variance) if technique.planar else (sample, of_sample)
    times = []
    for _ in range(repetitions if technique.planar else 1):
        begin_s = clock()
        first_rad(whole, known)
        taken_s = clock() - begin_s
        times.append(taken_s * flat.shape[1] / whole[0].size)
        if taken_s > ENOUGH_S:
            break  # so long a time needs no average
    values: dict[str, float | None] = {"seconds": float(np.median(times))}
    values |= _errors(tm.range_m(phase, scene.base_frequency_hz), scene.truth_m.reshape(-1)[chosen])
    spread: dict[str, float | None] = dict.fromkeys(values)
    spread["seconds"] = float(np.std(times, ddof=1)) if len(times) > 1 else None
    return values, spread


def measure_any(
    technique: Technique, scene: Scene, *, repetitions: int, seed: int
) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """Do as `measure`; of another package's technique that fails no range is there."""
    try:
        return measure(technique, scene, repetitions=repetitions, seed=seed)
    except tm.PluginFailed:
        nothing: dict[str, float | None] = dict.fromkeys(QUANTITIES)
        return nothing | {"range_missing": 1.0}, nothing


def _errors(range_m: _Array, truth_m: _Array) -> dict[str, float | None]:
    error_m = np.abs(range_m - truth_m)
    there = np.isfinite(error_m)
    found = error_m[there]
    return {
        "range_median_m": float(np.median(found)) if found.size else None,
        "range_p90_m": float(np.quantile(found, 0.9)) if found.size else None,
        "range_outliers": float(np.mean(found > OUTLIER_M)) if found.size else None,
        "range_missing": 1.0 - float(there.mean()),
    }
