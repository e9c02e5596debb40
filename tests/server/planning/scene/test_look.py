"""Looks: light, ambiguity and motion of a scene."""

import dataclasses
from typing import Any, cast

import numpy as np
import pytest

from tests.server.planning.looks import SCENE, SETTINGS, looked
from transientcam_driver import AppliedSequence, Camera, RawFrame, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera import sensor_of
from transientcam_server.errors import Problem
from transientcam_server.planning import Goal, Planner, Progress
from transientcam_server.planning._scene.look import FRAMES, STILL_FRAMES, STILL_SHARE
from transientcam_server.planning._search.words import conditions
from transientcam_server.settings import SensorSettings


def test_a_look_knows_the_range_beyond_the_unambiguous_one_and_the_light_of_the_sun(
    tmp_path: Any,
) -> None:
    path = tmp_path / "far.toml"
    path.write_text(SCENE.format(light=4e8, ambient=6e6, away_m=9.0, width_m=9.0))

    planner, scene = looked(f"sim:{path}?seed=7")

    assert np.median(scene.direct_m) == pytest.approx(9.0, abs=0.3)
    assert np.median(scene.ambient_dn_per_s) == pytest.approx(0.8 * 6e6 / 9.0, rel=0.5)
    assert scene.ambiguity_checked
    best = planner.plan(Goal(capture_s=0.1), scene).recommended
    assert best.applied.unambiguous_range_m > 9.0


def test_a_look_counts_lit_pixels_alone(tmp_path: Any) -> None:
    path = tmp_path / "panel.toml"
    path.write_text(SCENE.format(light=5e7, ambient=0.0, away_m=2.0, width_m=0.6))

    _, scene = looked(f"sim:{path}?seed=7")

    with open_camera(f"sim:{path}", clock=VirtualClock()) as camera:
        assert camera.simulation is not None
        lit_share = np.isfinite(camera.simulation.truth().first_return_m).mean()
    assert scene.lit_share == pytest.approx(lit_share, rel=0.02)


def test_a_dark_scene_is_refused(tmp_path: Any) -> None:
    path = tmp_path / "dark.toml"
    path.write_text(SCENE.format(light=1.0, ambient=0.0, away_m=2.0, width_m=3.0))

    with pytest.raises(Problem, match="No pixel has light"):
        looked(f"sim:{path}?seed=7")


def test_a_look_can_be_ended() -> None:
    class EnoughError(Exception):
        pass

    shares = []

    def report(share: float, step: str) -> None:
        shares.append(share)
        if step == "all frequencies":
            raise EnoughError

    with open_camera("sim:wall", clock=VirtualClock()) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        with pytest.raises(EnoughError):
            planner.look(camera, Sequence(), progress=Progress(report))

    assert shares == sorted(shares)
    assert 0 < shares[-1] < 0.5


class Carried:
    """A camera that is turned by so many pixels from frame to frame."""

    def __init__(self, camera: Camera, pixels: int) -> None:
        self.capabilities = camera.capabilities
        self.start, self.stop = camera.start, camera.stop
        self.applied, self.simulation = camera.applied, None
        self.asked: list[Sequence] = []
        self.waited_s: list[float] = []
        self._camera, self._pixels, self._read = camera, pixels, 0

    def configure(self, sequence: Sequence) -> AppliedSequence:
        self.asked.append(sequence)
        return self._camera.configure(sequence)

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        self.waited_s.append(timeout_s)
        raw = self._camera.read_frame(timeout_s=timeout_s)
        self._read += 1
        images = np.roll(np.asarray(raw.images), self._pixels * self._read, axis=2)
        return dataclasses.replace(raw, images=images)


@pytest.mark.parametrize(("pixels", "frames"), [(0, STILL_FRAMES), (2, FRAMES)])
def test_only_what_stands_still_is_looked_at_for_long(
    pixels: int, frames: int, tmp_path: Any
) -> None:
    path = tmp_path / "panel.toml"
    path.write_text(SCENE.format(light=5e7, ambient=0.0, away_m=2.0, width_m=0.6))
    steps = []

    with open_camera(f"sim:{path}?seed=7", clock=VirtualClock()) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        carried = Carried(camera, pixels)
        scene = planner.look(
            cast(Camera, carried),
            Sequence(),
            progress=Progress(lambda share, step: steps.append(step)),
        )
        highest_hz = camera.capabilities.max_frequency_hz
        rates_hz = [camera.capabilities.apply(each).frame_rate_hz for each in carried.asked]

    first, quick, coarse, fine, *later = carried.asked
    # what is captured before the fine frames is captured after them, too
    assert later == [quick, fine, coarse, *([quick] if pixels else [])]
    assert (first.base_frequency_hz, first.harmonics, first.exposure_s) == (2e6, 1, 5e-4)
    assert (quick.base_frequency_hz, quick.harmonics, quick.takes) == (23e6, 1, 1)
    assert (coarse.base_frequency_hz, coarse.harmonics) == (2e6, 1)
    assert fine.base_frequency_hz == Sequence().base_frequency_hz / 2
    assert fine.harmonics == highest_hz // fine.base_frequency_hz
    assert fine.exposure_s == coarse.exposure_s == quick.exposure_s
    assert {each.zeroth for each in carried.asked} == {"estimated"}
    # four frames more than the ten seconds that a camera may need anyhow
    patience_s = [10 + 4 / rate_hz for rate_hz in rates_hz]
    expected_s = np.repeat(patience_s, [1, 2, 1, 1, 2, frames - 1, 1, *([2] if pixels else [])])
    assert carried.waited_s == pytest.approx(expected_s)
    assert (steps.count("exposure"), steps.count("coarse range")) == (1, 2)
    assert steps.count("all frequencies") == frames
    assert (scene.moving_share > STILL_SHARE) == (frames == FRAMES)


def test_what_a_device_does_is_not_taken_for_the_scene() -> None:
    """High frequencies are modulated less, pixels have delays, images are lost, and it is warm."""
    with open_camera("sim:wall?device=prototype&seed=7", clock=VirtualClock()) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        scene = planner.look(camera, Sequence(), calibrated_c=15.0)
        assert camera.simulation is not None
        true_m = camera.simulation.truth().range_m

    # of its profile: amplitudes at 11.5, 46 and 92 MHz; the delays of its pixels are 1.2 ns
    assert np.array(scene.contrast)[[1, 4, 8]] == pytest.approx([1.0, 0.951, 0.553], abs=0.02)
    assert 0.03 < scene.lost_share < 0.08  # of 7 %, those that differ by more than noise
    assert 0.03 < scene.uncalibrated_m < 0.18
    assert scene.disagreement_m < 1e-3
    assert np.median(scene.direct_m) == pytest.approx(np.median(true_m), abs=0.01)
    # 25 degrees Celsius when it is switched on, and 1.5 mm for each degree at most
    assert scene.drift_m == pytest.approx(0.015, abs=0.002)
    assert "Calibrate with this sequence" in conditions(scene)
    assert "drifted" in conditions(scene)


def test_nominal_gains_of_a_real_camera_are_no_calibration() -> None:
    """What it modulates less is taken from the picture, and nothing is out of reach for certain."""
    with open_camera("sim:wall?device=prototype&seed=7", clock=VirtualClock()) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        scene = planner.look(cast(Camera, Carried(camera, 0)), Sequence())

    assert not scene.calibrated
    assert np.array(scene.contrast)[[1, 4, 8]] == pytest.approx([1.0, 0.951, 0.553], abs=0.06)
    assert scene.disagreement_m < 1e-3
    assert "calibrate first" in conditions(scene)
    goal = Goal(range_error_m=1e-5, estimator="single-frequency")
    with pytest.raises(Problem, match="a look without a calibration does not tell") as refused:
        planner.plan(goal, scene)
    assert refused.value.extensions["decided"] is False


BALL = """
[[motion]]
name = "roll"
period_s = 3.2
repeat = "back"
path_m = [[-0.8, 0.0, 0.0], [0.8, 0.0, 0.0]]
[[surface]]
name = "ball"
kind = "diffuse"
shape = "sphere"
centre_m = [0.0, 1.2, 0.0]
radius_m = 0.18
albedo = 0.7
motion = "roll"
"""


def test_what_moves_is_not_taken_for_what_is_far(tmp_path: Any) -> None:
    path = tmp_path / "ball.toml"
    wall = SCENE.format(light=4e7, ambient=0.0, away_m=2.0, width_m=3.0)
    path.write_text(wall + BALL)

    _, scene = looked(f"sim:{path}?seed=7")

    assert scene.moving_share > 0.1
    # the corners of the wall are farthest
    assert scene.direct_m.min() > 1.9
    assert scene.direct_m.max() < 2.4
    assert scene.swing_m_per_s is not None


def test_a_wall_stands_still_before_two_taps_whose_difference_is_read() -> None:
    # light that both taps collect is in no image, and its noise is in all of them
    with open_camera("tofcam660:emulated?scene=wall") as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        scene = planner.look(camera, Sequence())

    assert scene.moving_share < 0.01
