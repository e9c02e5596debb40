"""Whether pixels without light have no range, and lit ones have one: halves of a picture."""

import itertools
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.accuracy.capturing import CAPTURE_SEED, SETTINGS
from benchmarks.common.tables import Table, heads
from transientcam_driver import Sequence
from transientcam_experiments.tradeoff import camera_before
from transientcam_experiments.tradeoff.capture import capture
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Recipe
from transientcam_server.imaging._errors_of_range.accuracy import SPARSE_PX, range_accuracy
from transientcam_server.settings import SensorSettings

_Array = NDArray[Any]
EXPOSURES_S: Final = (0.0002, 0.0005, 0.001, 0.00192, 0.004)
ZEROTHS: Final = ("estimated", "on-off", "low-frequency")
ESTIMATORS: Final = ("likelihood", "pisarenko", "maximum-entropy", "single-frequency")
_SEAM_PX: Final = 4  # that smoothing and mixed pixels reach across
_SEEN: Final = 5.0
_BARS: Final = (0.99, 0.01, 2 / 3)


class Halves(NamedTuple):
    """Walls in the left and the right half of the picture, and other light."""

    left_albedo: float
    left_m: float
    right_m: float
    ambient_e_per_s: float = 0.0


SCENES: Final = {
    "black": Halves(0.0, 1.0, 2.0),
    "dim": Halves(0.004, 2.0, 2.0),
    "sunny": Halves(0.0, 1.0, 2.0, 4e6),
    "far": Halves(0.0, 1.0, 7.4),
}


def table(folder: Path, exposures_s: tuple[float, ...] = EXPOSURES_S) -> Table:
    """Capture each scene at each exposure and with each b_0, and judge each estimator."""
    found = Table(
        "Pixels with and without light",
        heads(
            "scene, b_0 | estimator | unlit without a range:.1% | with an SNR above 5 lost:.2% | "
            "errors within their deviation:.1%"
        ),
        notes=[
            f"The worst of {len(exposures_s)} exposures. SNR: b_0 over the deviation of a part of "
            "b_1 in one pixel. Without a low frequency a range is right in any turn of the phase. "
            "Bars: 99 %, 1 % and two thirds.",
        ],
    )
    kept = 0
    for (name, scene), zeroth in itertools.product(SCENES.items(), ZEROTHS):
        path = folder / f"{name}.toml"
        path.write_text(_toml(scene))
        each = np.array([_shares(str(path), zeroth, exposure_s) for exposure_s in exposures_s])
        kept += int(_within(each).sum())
        with np.errstate(all="ignore"):
            worst = [np.fmin.reduce(each[..., 0]), np.fmax.reduce(each[..., 1])]
            worst.append(np.fmin.reduce(each[..., 2]))
        for estimator, *figures in zip(ESTIMATORS, *worst, strict=True):
            known = [float(figure) if np.isfinite(figure) else None for figure in figures]
            found.rows.append((f"{name}, {zeroth}", estimator, *known))
    total = len(SCENES) * len(ZEROTHS) * len(ESTIMATORS) * len(exposures_s)
    found.notes.append(f"{kept} of {total} captures are within all bars.")
    return found


def _within(shares: _Array) -> _Array:
    unlit, lost, held = np.moveaxis(shares, -1, 0)
    return ~(unlit < _BARS[0]) & ~(lost > _BARS[1]) & ~(held < _BARS[2])


def _shares(path: str, zeroth: str, exposure_s: float) -> _Array:
    """Return the three shares (estimators, 3) of one capture, NaN of no pixels."""
    with camera_before(path, seed=CAPTURE_SEED) as camera:
        applied = camera.configure(Sequence(zeroth=zeroth, exposure_s=exposure_s))  # type: ignore[arg-type]
        sensor = sensor_of(camera, SensorSettings())
        (frame,) = capture(camera, 1, middle=True)
    found = []
    for estimator in ESTIMATORS:
        settings = SETTINGS.model_copy(update={"estimator": estimator})
        recipe = Recipe(applied, settings, float(sensor.highest_dn), sensor=sensor)
        image = recipe.reconstruct(frame.raw)
        range_m, std_m = image.range_m, range_accuracy(recipe, image, SPARSE_PX, frame.raw).std_m
        light, truth_m = frame.truth.brightness, frame.truth.range_m
        apart = np.abs(np.arange(light.shape[1]) - light.shape[1] / 2) > _SEAM_PX
        dark, slope, _ = recipe.moment_variance[:, 1]
        seen = (light > _SEEN * np.sqrt(dark + slope * light)) & apart
        off_m = range_m - truth_m
        if zeroth != "low-frequency":
            turn_m = float(tm.range_m(2 * np.pi, recipe.base_frequency_hz))
            off_m = np.remainder(off_m + turn_m / 2, turn_m) - turn_m / 2
        none = ~np.isfinite(range_m)
        held = np.abs(off_m) <= std_m
        shares = none[(light == 0) & apart], none[seen], held[~none & np.isfinite(std_m) & apart]
        found.append([each.mean() if each.size else np.nan for each in shares])
    return np.array(found)


def _toml(scene: Halves) -> str:
    """Return a scene file of a camera that looks along y, its lamp in it."""
    left, right = -5.0, 50.0
    return f"""name = "halves"
[camera]
position_m = [0.0, 0.0, 0.0]
look_at_m = [0.0, 2.0, 0.0]
field_of_view_deg = 60.0
[light]
position_m = [0.0, 0.0, 0.0]
aim_at_m = [0.0, 2.0, 0.0]
electrons_per_s = 5.0e7
[ambient]
electrons_per_s = {scene.ambient_e_per_s}
[[surface]]
name = "left"
kind = "diffuse"
centre_m = [{left}, {scene.left_m}, 0.0]
normal = [0.0, -1.0, 0.0]
size_m = [10.0, 20.0]
albedo = {scene.left_albedo}
[[surface]]
name = "right"
kind = "diffuse"
centre_m = [{right}, {scene.right_m}, 0.0]
normal = [0.0, -1.0, 0.0]
size_m = [100.0, 100.0]
albedo = 0.8
"""
