"""Captures of the bench: calibrated, warm, and made once."""

import numpy as np
import pytest

from transientcam_driver import Sequence
from transientcam_experiments.paper import Bench
from transientcam_experiments.paper.bench import WITHOUT_OUTLIERS, ReconstructedShot

SEQUENCE = Sequence(harmonics=3, takes=20)


@pytest.fixture(scope="module")
def wall(bench: Bench) -> ReconstructedShot:
    return bench.shot("wall", SEQUENCE)


def test_the_device_has_a_pattern_that_the_calibration_removes(
    bench: Bench, wall: ReconstructedShot
) -> None:
    error_m = np.abs(wall.found.range_m - wall.truth.range_m)[wall.lit]
    gains = bench.calibration(wall.applied.sequence).gains.planes

    # 10 degrees at 23 MHz from pixel to pixel, which are 0.18 m
    assert np.degrees(np.angle(gains[1] / gains[1].mean())).std() == pytest.approx(10, rel=0.2)
    assert np.median(error_m) < 0.005


def test_captures_are_averaged_and_estimated_as_in_the_paper(wall: ReconstructedShot) -> None:
    used = wall.found.settings

    assert (used.neighbours, used.smoothing_sigma_px) == ("gaussian", 0.6)
    assert used.estimator == "pisarenko"


def test_a_capture_is_made_once_and_a_calibration_once_for_all_takes(bench: Bench) -> None:
    calibration = bench.calibration(SEQUENCE)

    assert bench.shot("wall", SEQUENCE) is bench.shot("wall", SEQUENCE)
    assert bench.calibration(Sequence(harmonics=3, takes=2)) is calibration
    assert bench.calibration(SEQUENCE, options=WITHOUT_OUTLIERS) is not calibration


def test_quick_means_few_takes(bench: Bench, wall: ReconstructedShot) -> None:
    assert (bench.few(100, 3), Bench().few(100, 3)) == (3, 100)
    assert wall.applied.sequence.takes == 3


def test_captures_begin_when_they_are_asked_for(bench: Bench) -> None:
    single = Sequence(harmonics=1, zeroth="estimated")

    one, other = bench.shots("wall", single, frames=2, at_s=7.6)

    assert one.time_s == pytest.approx(7.6, abs=0.1)
    assert other.time_s - one.time_s == pytest.approx(1 / one.applied.frame_rate_hz, rel=0.01)


def test_the_same_seed_captures_the_same() -> None:
    single = Sequence(harmonics=1, zeroth="estimated")

    one, other = (Bench(quick=True, seed=3).shot("wall", single) for _ in range(2))
    third = Bench(quick=True, seed=4).shot("wall", single)

    assert np.array_equal(one.found.measured, other.found.measured)
    assert not np.array_equal(one.found.measured, third.found.measured)
