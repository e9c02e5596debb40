"""What all parts of the measurement share: scenes, frames of them, and errors of the range."""

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Camera, Sequence
from transientcam_experiments.tradeoff import camera_before
from transientcam_experiments.tradeoff.capture import capture
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Gains, Recipe, ranges_m
from transientcam_server.imaging._errors_of_range.noise import moment_noise
from transientcam_server.planning import Planner, SceneStatistics
from transientcam_server.planning._prediction.measures import pixel_errors
from transientcam_server.settings import ReconstructionSettings, SensorSettings

SEED = 1
LOOK_SEED, CAPTURE_SEED = 7, 11
PIXELS = 2000
OUTLIER_ERRORS = 5.0
"""A range further off than so many times the error of the median pixel is an outlier."""
_NO_LIGHT = 1e-12
SETTINGS = ReconstructionSettings()


def recipe_of(
    camera: Camera, gains: Gains | None = None, settings: ReconstructionSettings = SETTINGS
) -> Recipe:
    """Return how frames of the present sequence are reconstructed."""
    sensor = sensor_of(camera, SensorSettings())
    return Recipe(camera.applied, settings, float(sensor.highest_dn), gains, sensor=sensor)


def captured(
    camera: Camera, sequence: Sequence, frames: int, settings: ReconstructionSettings = SETTINGS
) -> tuple[Recipe, list[tm.Reconstruction]]:
    """Capture and reconstruct frames with a sequence."""
    camera.configure(sequence)
    recipe = recipe_of(camera, settings=settings)
    return recipe, [recipe.reconstruct(each.raw) for each in capture(camera, frames)]


def short(sequence: Sequence) -> str:
    """Name a sequence in a few characters."""
    takes = f", {sequence.takes} takes" if sequence.takes > 1 else ""
    frequency = (
        "" if sequence.base_frequency_hz == 23e6 else f", {sequence.base_frequency_hz / 1e6:g} MHz"
    )
    return (
        f"m = {sequence.harmonics}{frequency}, {sequence.exposure_s * 1e3:.3g} ms{takes}, "
        f"{sequence.zeroth}"
    )


def looked(scene: str) -> tuple[Planner, SceneStatistics]:
    """Look at a scene."""
    with camera_before(scene, seed=LOOK_SEED) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        return planner, planner.look(camera, Sequence())


def dimmest_dn_per_s(statistics: SceneStatistics) -> float:
    """Return how much light the dimmest pixel has that a plan is for: the others are not lit."""
    return float(statistics.brightness_dn_per_s.min())


def measured(
    scene: str, sequence: Sequence, estimator: str, captures: int, dimmest: float = 0.0
) -> tuple[dict[str, float], float, float]:
    """Capture, and return noise, bias, error and outliers, the device's time, and saturation.

    Each range is held against the truth in the middle of its own capture: scenes may move. Pixels
    with less light than the dimmest are left out, in DN for each second of exposure.
    """
    pixels, errors_m, device_s, full = None, [], 0.0, 0.0
    with camera_before(scene, seed=CAPTURE_SEED) as camera:
        applied = camera.configure(sequence)
        recipe = recipe_of(camera)
        for each in capture(camera, captures, middle=True):
            truth, device_s = each.truth, each.raw.capture_s
            if pixels is None:
                least = max(dimmest * applied.sequence.exposure_s, _NO_LIGHT)
                lit = np.flatnonzero(truth.lit & (truth.brightness >= least))
                random = np.random.default_rng(1)
                pixels = np.sort(random.choice(lit, min(PIXELS, lit.size), replace=False))
                brightest = each.raw.images.max(axis=0).ravel()[lit]
                full = float((brightest >= recipe.full_scale).mean())
            found = recipe.reconstruct(each.raw)
            b = np.asarray(found.smoothed)
            variance = np.asarray(moment_noise(recipe, found).variance)
            part, noise = (of.reshape((len(of), -1))[:, pixels] for of in (b, variance))
            found_m = ranges_m(part, noise, estimator, recipe.base_frequency_hz, SETTINGS)
            errors_m.append(found_m - truth.range_m.ravel()[pixels])
    errors = pixel_errors(np.stack(errors_m), np.zeros_like(errors_m[0]))
    off_m = errors.off_m(errors.bias_m)
    values = {
        "std": float(np.median(errors.std_m)),
        "bias": float(np.median(errors.bias_m)),
        "error": float(np.median(errors.error_m)),
        "outliers": float((off_m > OUTLIER_ERRORS * np.median(errors.error_m)).mean()),
    }
    return values, device_s, full
