"""The truth of simulated scenes: cumulative light and number of returns."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Truth
from transientcam_experiments.tradeoff.truth import count_returns, cumulative, sample_pixels
from transientcam_simulation.base import SparseResponses

Array = NDArray[Any]


def truth_of(delay_s: Array, weight: Array) -> Truth:
    shape = (len(delay_s), 1, 1)
    responses = SparseResponses(delay_s.reshape(shape), weight.reshape(shape))
    delays, weights = responses.returns()
    return Truth(delays, weights, "sparse", responses.of_pixel, 1.0)


def test_true_cumulative_light_steps_up_at_each_return() -> None:
    truth = truth_of(np.array([10e-9, 25e-9]), np.array([3.0, 1.0]))
    sample = sample_pixels(truth, pixels=5, seed=0)
    phase = 2 * np.pi * 20e6 * np.array([0.0, 9.9e-9, 10.1e-9, 24.9e-9, 25.1e-9, 49e-9])

    share = cumulative(sample, phase, base_frequency_hz=20e6)

    np.testing.assert_allclose(share[:, 0], [0, 0, 0.75, 0.75, 1, 1])


def test_a_pixel_with_hardly_any_light_is_not_compared() -> None:
    brightness = np.array([[100.0, 80.0, 2.0], [0.5, 0.0, 120.0]])
    responses = SparseResponses(np.full((1, 2, 3), 10e-9), brightness[None])
    truth = Truth(*responses.returns(), "sparse", responses.of_pixel, 1.0)

    sample = sample_pixels(truth, pixels=10, seed=0)

    assert set(zip(sample.y.tolist(), sample.x.tolist(), strict=True)) == {
        (0, 0),
        (0, 1),
        (0, 2),
        (1, 2),
    }


def test_returns_are_counted_from_a_share_of_the_strongest() -> None:
    weight = np.array([[1.0, 0.0, 0.05], [0.2, 0.0, 1.0], [0.05, 0.0, 0.2]])

    np.testing.assert_array_equal(count_returns(weight, threshold=0.1), [2, 0, 2])
