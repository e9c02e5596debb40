"""Frames of a wall in the sun: noise that is stated, against that of many captures."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import transientcam_moments as tm
from transientcam_driver import RawFrame, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera import sensor_of, start_with
from transientcam_server.imaging import Computed, Recipe, compute, frame_meta
from transientcam_server.settings import ReconstructionSettings, SensorSettings, SequenceSettings

CAPTURES = 12
ELECTRONS = 1.2e7
"""A second, of the sun, from what reflects all light."""
WALL = """\
seed = 7
[camera]
position_m = [0.0, 0.0, 0.0]
look_at_m = [0.0, 3.0, 0.0]
field_of_view_deg = 40.0
[light]
position_m = [0.05, 0.0, 0.0]
aim_at_m = [0.0, 3.0, 0.0]
electrons_per_s = 6.0e7
[ambient]
electrons_per_s = {sun}
[[surface]]
kind = "diffuse"
centre_m = [0.0, 3.0, 0.0]
normal = [0.1, -1.0, 0.0]
size_m = [6.0, 4.0]
albedo = 0.5
"""


def captured(
    directory: Path, sun: float, **sequence: Any
) -> tuple[Recipe, list[RawFrame], tm.noise.Sensor]:
    scene = directory / "wall.toml"
    scene.write_text(WALL.format(sun=sun))
    with open_camera(f"sim:{scene}", clock=VirtualClock()) as camera:
        applied = camera.configure(Sequence(exposure_s=2e-3, **sequence))
        sensor = sensor_of(camera, SensorSettings())
        camera.start()
        frames = [camera.read_frame(timeout_s=60.0) for _ in range(CAPTURES)]
    settings = ReconstructionSettings(estimator="likelihood")
    return Recipe(applied, settings, float(sensor.highest_dn), sensor=sensor), frames, sensor


def found_by(recipe: Recipe, raw: RawFrame) -> Computed:
    return compute(Computed(), recipe, raw, None, ["returns"])


@pytest.mark.parametrize("sun", [0.0, ELECTRONS])
@pytest.mark.parametrize(("m", "zeroth"), [(3, "low-frequency"), (4, "estimated")])
def test_the_stated_deviation_is_that_of_captures_with_and_without_sun(
    tmp_path: Path, sun: float, m: int, zeroth: str
) -> None:
    recipe, frames, sensor = captured(tmp_path, sun, harmonics=m, zeroth=zeroth)

    computed = [found_by(recipe, raw) for raw in frames]

    ranges_m = np.stack([np.asarray(_of(each).range_m) for each in computed])
    stated_m = np.stack([_of(each).range_scatter_m() for each in computed])
    stated_m = stated_m.reshape(ranges_m.shape)  # of each pixel: averages are of 1 to 69
    apart = np.abs(np.diff(ranges_m, axis=0)) / np.hypot(stated_m[1:], stated_m[:-1])
    # a frame chooses its neighbours: most pixels differ by less, some by more
    assert np.sqrt(np.mean(apart**2)) == pytest.approx(1.0, rel=0.1)
    assert np.mean(apart > 3) < 0.008
    assert computed[0].range_noise is not None
    assert computed[0].range_noise["median"] == pytest.approx(np.median(stated_m[0]), rel=0.02)
    meta = frame_meta(1, frames[0], recipe, computed[0], 0.1)
    expected_dn = 0.5 * sun * 2e-3 / sensor.gain_e_per_dn  # of a wall that reflects half
    assert meta["ambient_dn"] == pytest.approx(expected_dn, rel=0.05)


def test_the_noise_of_the_sun_contradicts_no_moments(tmp_path: Path) -> None:
    recipe, frames, _ = captured(tmp_path, ELECTRONS, harmonics=3, zeroth="low-frequency")

    flags = np.asarray(_of(found_by(recipe, frames[0])).flags)

    assert ((flags & tm.Flags.CONTRADICTORY) > 0).mean() < 0.005


@pytest.mark.parametrize("name", ["tofcam660", "opt8241", "kinect2"])
def test_differences_of_two_taps_show_no_other_light(name: str) -> None:
    with open_camera(f"{name}:emulated?scene=wall&noise=off") as camera:
        start_with(camera, SequenceSettings())
        sensor = sensor_of(camera, SensorSettings())
        camera.start()
        raw = camera.read_frame(timeout_s=60.0)

    phases = len({label.phase_rad for label in raw.labels if label.harmonic == 1}) or 3
    mean_dn = raw.images[:phases].mean(axis=0)
    usable = (raw.images[:phases] < sensor.highest_dn).all(axis=0)
    assert np.median(mean_dn[usable]) == pytest.approx(sensor.dark_dn, abs=2e-3 * sensor.highest_dn)


def _of(computed: Computed) -> tm.Reconstruction:
    assert computed.reconstruction is not None
    return computed.reconstruction
