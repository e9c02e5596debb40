"""Captures against the truth of the scene."""

from collections.abc import Iterator

import numpy as np
import pytest

from transientcam_driver import Camera, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.tradeoff import capture
from transientcam_experiments.tradeoff.truth import sample_pixels
from transientcam_server.settings import ReconstructionSettings


def test_repeatability_of_normal_ranges_is_their_deviation() -> None:
    ranges = np.random.default_rng(0).normal(2.0, 0.03, (4, 20_000))
    ranges[0, :50] += 5.0  # a few strays say nothing of a typical pixel
    ranges[:, -7] = np.nan

    assert capture.repeatability(ranges) == pytest.approx(0.03, rel=0.02)
    assert capture.repeatability(ranges[:1]) is None


@pytest.fixture(scope="module")
def camera() -> Iterator[Camera]:
    with open_camera("sim:mirrors?noise=off", clock=VirtualClock()) as opened:
        yield opened


def measured(camera: Camera, sequence: Sequence) -> dict[str, float | None]:
    applied = camera.configure(sequence)
    values, _ = capture.accuracy(
        capture.capture(camera, 2),
        lambda truth: sample_pixels(truth, pixels=100, seed=1),
        applied,
        settings=ReconstructionSettings(neighbours="none"),
        bits=camera.capabilities.bits,
    )
    assert set(values) == set(capture.QUANTITIES)
    return values


def test_without_noise_three_returns_are_measured_as_they_are(camera: Camera) -> None:
    values = measured(camera, Sequence(harmonics=3))

    assert (values["range_median_m"] or 0) < 1e-3
    assert (values["returns_right"] or 0) > 0.9
    assert (values["cumulative_mean"] or 0) < 0.03
    assert values["range_missing"] == 0
    assert (values["single_frequency_rmse_m"] or 0) > 0.3  # a mean of three returns


def test_the_cumulative_density_is_better_with_more_harmonics(camera: Camera) -> None:
    few, many = (measured(camera, Sequence(harmonics=m)) for m in (2, 4))

    for name in ("cumulative_mean", "bound_width"):
        assert (many[name] or 0) < (few[name] or 0)
