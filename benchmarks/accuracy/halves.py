"""Whether pixels without light have no range, and lit ones have one: halves of a picture."""

import itertools
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.accuracy.capturing import CAPTURE_SEED, SETTINGS
from benchmarks.common.tables import Table, heads
from transientcam_driver import Sequence
from transientcam_driver.sequence import Zeroth
from transientcam_experiments.tradeoff import camera_before
from transientcam_experiments.tradeoff.capture import capture
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Recipe
from transientcam_server.imaging._errors_of_range.accuracy import SPARSE_PX, range_accuracy
from transientcam_server.settings import SensorSettings

EXPOSURES_S: Final = (0.0002, 0.0005, 0.001, 0.00192, 0.004)
ZEROTHS: Final = get_args(Zeroth)
ESTIMATORS: Final = ("likelihood", "pisarenko", "maximum-entropy", "single-frequency")
_SCENE: Final = """
camera = {{ position_m = [0.0, 0.0, 0.0], look_at_m = [0.0, 2.0, 0.0], field_of_view_deg = 60.0 }}
ambient = {{ electrons_per_s = {3} }}
light = {{ position_m = [0.0, 0.0, 0.0], aim_at_m = [0.0, 2.0, 0.0], electrons_per_s = 5e7 }}
surface = [
{{ kind = "diffuse", normal = [0, -1, 0], centre_m = [-4, {1}, 0], size_m = [8, 9], albedo = {0} }},
{{ kind = "diffuse", normal = [0, -1, 0], centre_m = [9, {2}, 0], size_m = [18, 9], albedo = 0.8 }}
]
"""
SCENES: Final = {
    "black": (0.0, 1.0, 2.0, 0.0),
    "dim": (0.004, 2.0, 2.0, 0.0),
    "sunny": (0.0, 1.0, 2.0, 2e6),
    "far": (0.0, 1.0, 7.4, 0.0),
}
"""Albedo and distance of a wall in the left half of the picture, distance of one in the right half
whose albedo is 0.8, in m, and other light in electrons a second."""


def tables(*, exposures_s: tuple[float, ...] = EXPOSURES_S) -> Iterator[Table]:
    """Capture each scene at each exposure and with each b_0, and judge each estimator."""
    found = Table(
        "Pixels with and without light",
        heads(
            "scene, b_0 | estimator | unlit without a range:.1% | with an SNR above 5 lost:.2% | "
            "errors within their deviation:.1%"
        ),
    )
    found.notes.append(
        f"The worst of {len(exposures_s)} exposures. SNR: b_0 over the deviation of a part of b_1 "
        "in one pixel. Bars: 99 %, 1 % and two thirds. Without a low frequency any turn is right."
    )
    cases = [*itertools.product(SCENES, ZEROTHS)]
    with tempfile.TemporaryDirectory() as folder:
        of = partial(_shares, Path(folder))
        shares = np.array([[of(*case, each) for each in exposures_s] for case in cases])
    unlit, lost, held = np.moveaxis(shares, -1, 0)
    kept = ~(unlit < 0.99) & ~(lost > 0.01) & ~(held < 2 / 3)
    worst = np.fmin.reduce(unlit, 1), np.fmax.reduce(lost, 1), np.fmin.reduce(held, 1)
    for row, at in np.ndindex(*worst[0].shape):
        figures = (float(of[row, at]) if np.isfinite(of[row, at]) else None for of in worst)
        found.rows.append((", ".join(cases[row]), ESTIMATORS[at], *figures))
    found.notes.append(f"{kept.sum()} of {kept.size} captures are within all bars.")
    yield found


def _shares(folder: Path, scene: str, zeroth: Zeroth, exposure_s: float) -> NDArray[Any]:
    """Return the three shares (estimators, 3) of one capture, NaN of no pixels."""
    path = folder / f"{scene}.toml"
    path.write_text(_SCENE.format(*SCENES[scene]))
    with camera_before(str(path), seed=CAPTURE_SEED) as camera:
        applied = camera.configure(Sequence(zeroth=zeroth, exposure_s=exposure_s))
        sensor = sensor_of(camera, SensorSettings())
        (frame,) = capture(camera, 1, middle=True)
    found = []
    for estimator in ESTIMATORS:
        settings = SETTINGS.model_copy(update={"estimator": estimator})
        recipe = Recipe(applied, settings, float(sensor.highest_dn), sensor=sensor)
        image = recipe.reconstruct(frame.raw)
        range_m, std_m = image.range_m, range_accuracy(recipe, image, SPARSE_PX, frame.raw).std_m
        light, truth_m = frame.truth.brightness, frame.truth.range_m
        # smoothing and mixed pixels reach across the seam
        apart = np.abs(np.arange(light.shape[1]) - light.shape[1] / 2) > 4
        dark, slope, other = recipe.moment_variance[:, 1]
        variance = dark + slope * light + other * (0.0 if image.ambient is None else image.ambient)
        seen = (light > 5.0 * np.sqrt(variance)) & apart
        off_m = range_m - truth_m
        if zeroth != "low-frequency":
            turn_m = float(tm.range_m(2 * np.pi, recipe.base_frequency_hz))
            off_m = np.remainder(off_m + turn_m / 2, turn_m) - turn_m / 2
        none, known = np.isnan(range_m), np.isfinite(std_m) & np.isfinite(range_m) & apart
        shares = none[(light == 0) & apart], none[seen], (np.abs(off_m) <= std_m)[known]
        found.append([each.mean() if each.size else np.nan for each in shares])
    return np.array(found)
