"""Averaging over frames as the settings have it, from raw images to range and its deviation."""

from dataclasses import replace

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.reconstruction.test_detection import captured, halves
from tests.moments.reconstruction.test_neighbours import GAINS, SETTINGS
from transientcam_moments.reconstruction import NEIGHBOURS

COUNT = 9


def averaged(settings: tm.Settings, count: int = COUNT) -> tm.Reconstruction:
    reconstructor = tm.Reconstructor(settings, calibration=GAINS)
    frame = None
    for seed in range(count):
        raw = captured(halves(900.0, 700.0), "low-frequency", seed=seed)
        frame = reconstructor.average(reconstructor.measure(raw), frame)
    assert frame is not None
    return reconstructor(frame)


def spread_m(found: tm.Reconstruction) -> float:
    range_m = found.range_m[:, 6:26]  # away from the step in brightness
    return float(np.median(abs(range_m - np.median(range_m))))


@pytest.mark.parametrize("neighbours", NEIGHBOURS)
def test_the_deviation_falls_with_the_frames_as_stated(neighbours: str) -> None:
    settings = replace(SETTINGS, neighbours=neighbours, still_frames=16)

    found, single = averaged(settings), averaged(settings, 1)

    frames = found.frames_averaged
    assert frames is not None
    assert np.mean(frames == COUNT) > 0.99
    spread, before = (spread_m(each) for each in (found, single))
    assert spread == pytest.approx(before / np.sqrt(COUNT), rel=0.3)
    assert found.noise is not None
    assert single.noise is not None
    ratio = found.noise.variance[1:] / single.noise.variance[1:]
    assert np.median(ratio) == pytest.approx(1 / COUNT, rel=0.2)
    alone = replace(settings, neighbours="none")
    assert np.array_equal(found.measured, averaged(alone).measured)


def test_without_a_sensor_the_images_tell_the_noise_and_moments_alone_stay_alone() -> None:
    settings = replace(SETTINGS, sensor=None, still_frames=16)

    found = averaged(settings)

    assert found.frames_averaged is not None
    assert np.mean(found.frames_averaged == COUNT) > 0.99
    reconstructor = tm.Reconstructor(settings)
    measured = tm.Measured(found.measured)
    assert reconstructor.average(measured, reconstructor.average(measured)).still is None
    assert reconstructor(reconstructor.average(measured)).frames_averaged is None


def test_a_saturated_pixel_is_alone_and_a_frame_with_corrupt_images_does_not_enter() -> None:
    reconstructor = tm.Reconstructor(replace(SETTINGS, still_frames=16), calibration=GAINS)
    raws = [captured(halves(900.0, 700.0), "low-frequency", seed=seed) for seed in range(3)]
    raws[0][:, 20, 20] = 4095
    corrupt = raws[1].copy()
    corrupt[9] = corrupt[9] // 2

    first = reconstructor.average(reconstructor.measure(raws[0]))
    second = reconstructor.average(reconstructor.measure(corrupt), first)
    third = reconstructor.average(reconstructor.measure(raws[2]), second)

    assert second.corrupt
    assert third.still is not None
    assert np.median(third.still.frames) == 2
    assert third.still.frames[20, 20] == 1
