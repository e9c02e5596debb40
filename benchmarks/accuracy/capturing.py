"""What all parts of the measurement share: scenes, frames of them, and errors of the range."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Camera, Sequence, capture_calibration, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.tradeoff.capture import capture
from transientcam_experiments.tradeoff.measuring import BEGINS_S, spec_of
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Gains, Recipe, evaluate, ranges_m
from transientcam_server.imaging._errors_of_range.noise import moment_noise
from transientcam_server.planning import SHARE, Planner, SceneStatistics
from transientcam_server.planning._prediction.measures import pixel_errors
from transientcam_server.planning._scene.look import look_of_frame
from transientcam_server.settings import ReconstructionSettings, SensorSettings

SEED = 1
LOOK_SEED, CAPTURE_SEED = 7, 11
PIXELS = 2000
OUTLIER_ERRORS = 5.0
"""A range further off than so many times the error of the median pixel is an outlier."""
_NO_LIGHT = 1e-12
SETTINGS = ReconstructionSettings()


def captured(
    camera: Camera, sequence: Sequence, frames: int, settings: ReconstructionSettings = SETTINGS
) -> tuple[Recipe, list[tm.Reconstruction]]:
    """Capture and reconstruct frames with a sequence."""
    applied = camera.configure(sequence)
    sensor = sensor_of(camera, SensorSettings())
    recipe = Recipe(applied, settings, float(sensor.highest_dn), sensor=sensor)
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


class Way(NamedTuple):
    """How a scene is planned for and captured: the camera's device, and what is seen of it."""

    device: str = ""
    warmer_c: float = 0.0
    one_frame: bool = False

    @contextmanager
    def camera_before(
        self, scene: str, *, seed: int, sequence: Sequence | None = None
    ) -> Iterator[tuple[Camera, Gains | None, float | None]]:
        """Open the camera; also return its calibration for a sequence, and its temperature then."""
        clock = VirtualClock()
        mark = "&" if "?" in scene else "?"
        spec = f"{scene}{mark}device={self.device}" if self.device else scene
        with open_camera(spec_of(spec, seed=seed), clock=clock) as camera:
            clock.sleep(BEGINS_S)
            gains, then_c = None, camera.status().temperature_c
            if self.device and sequence is not None:
                gains = calibrated(camera, replace(sequence, takes=1))
            while self.warmer_c and camera.status().temperature_c < then_c + self.warmer_c:
                clock.sleep(20.0)
            yield camera, gains, then_c if self.device else None


IDEAL = Way()


def calibrated(camera: Camera, sequence: Sequence) -> Gains:
    """Return the gains of a simulated camera for a sequence, through its diffuser."""
    there, highest_dn = camera.simulation, 2.0**camera.capabilities.bits
    assert there is not None
    there.change(diffuser=True)
    camera.configure(replace(sequence, exposure_s=5e-4))
    brightest_dn = np.quantile(capture_calibration(camera, takes=2).images, 0.999)
    exposure_s = 0.6 * 5e-4 * highest_dn / brightest_dn
    camera.configure(camera.capabilities.nearest(replace(sequence, exposure_s=exposure_s)))
    found = evaluate(capture_calibration(camera, takes=16, average=tm.average_takes))
    there.change(diffuser=False)
    return found.gains


def looked(scene: str, way: Way = IDEAL) -> tuple[Planner, SceneStatistics]:
    """Look at a scene, or at one frame of the default sequence."""
    default = Sequence() if way.one_frame else None
    with way.camera_before(scene, seed=LOOK_SEED, sequence=default) as (camera, gains, then_c):
        sensor = sensor_of(camera, SensorSettings())
        planner = Planner(camera.capabilities, sensor, SETTINGS)
        if not way.one_frame:
            return planner, planner.look(camera, Sequence(), calibrated_c=then_c)
        applied = camera.configure(Sequence())
        recipe = Recipe(applied, SETTINGS, float(sensor.highest_dn), gains, sensor=sensor)
        (frame,) = capture(camera, 1)
        return planner, look_of_frame(recipe, recipe.reconstruct(frame.raw), frame.raw, None)


def dimmest_dn_per_s(statistics: SceneStatistics) -> float:
    """Return how much light the dimmest pixel has that a plan is for: the others are not lit."""
    return float(statistics.brightness_dn_per_s.min())


def measured(
    scene: str,
    sequence: Sequence,
    estimator: str,
    captures: int,
    dimmest: float = 0.0,
    way: Way = IDEAL,
    tolerance_m: float = 0.0,
) -> tuple[dict[str, float], float, float]:
    """Capture, and return noise, bias, error and outliers, the device's time, and saturation.

    ``within`` is how far `SHARE` of the ranges are off at most, ``share`` how many are within the
    tolerance.

    Each range is held against the truth in the middle of its own capture: scenes may move. Pixels
    with less light than the dimmest are left out, in DN for each second of exposure.
    """
    pixels, errors_m, device_s, full = None, [], 0.0, 0.0
    with way.camera_before(scene, seed=CAPTURE_SEED, sequence=sequence) as (camera, gains, _):
        applied = camera.configure(sequence)
        sensor = sensor_of(camera, SensorSettings())
        recipe = Recipe(applied, SETTINGS, float(sensor.highest_dn), gains, sensor=sensor)
        for each in capture(camera, captures, middle=True):
            truth, device_s = each.truth, each.raw.capture_s
            if pixels is None:
                least = max(dimmest * applied.sequence.exposure_s, _NO_LIGHT)
                lit = np.flatnonzero(truth.lit & (truth.brightness >= least))
                random = np.random.default_rng(1)
                pixels = np.sort(random.choice(lit, min(PIXELS, lit.size), replace=False))
                brightest = each.raw.images.max(axis=0).ravel()[lit]
                full = float((brightest >= sensor.highest_dn).mean())
            found = recipe.reconstruct(each.raw)
            b = tm.smooth(np.asarray(found.measured), SETTINGS.smoothing_px)
            variance = np.asarray(moment_noise(recipe, found).variance)
            part, noise = (of.reshape((len(of), -1))[:, pixels] for of in (b, variance))
            found_m = ranges_m(part, noise, estimator, recipe.base_frequency_hz, SETTINGS)
            errors_m.append(found_m - truth.range_m.ravel()[pixels])
    errors = pixel_errors(np.stack(errors_m), np.zeros_like(errors_m[0]))
    off_m = errors.off_m(errors.bias_m)
    all_off_m = np.nan_to_num(np.abs(np.stack(errors_m)), nan=np.inf)
    values = {
        "within": float(np.quantile(all_off_m, SHARE, method="higher")),
        "share": float((all_off_m <= tolerance_m).mean()),
        "std": float(np.median(errors.std_m)),
        "bias": float(np.median(errors.bias_m)),
        "error": float(np.median(errors.error_m)),
        "outliers": float((off_m > OUTLIER_ERRORS * np.median(errors.error_m)).mean()),
    }
    return values, device_s, full
