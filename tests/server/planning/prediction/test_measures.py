"""Errors of ranges, scenes and returns as plans measure them."""

import math

import numpy as np
import pytest

import transientcam_moments as tm
from transientcam_server.planning import uniform_scene
from transientcam_server.planning._prediction.measures import pixel_errors
from transientcam_server.planning._prediction.resolving import both_found

FREQUENCY_HZ = 23e6


def test_errors_of_drawn_ranges_are_their_deviation_and_their_bias() -> None:
    random = np.random.default_rng(1)
    true_m = np.linspace(1.0, 2.0, 500)
    range_m = true_m + 0.02 + 0.003 * random.standard_normal((40, 500))

    errors = pixel_errors(range_m, true_m)

    assert np.median(errors.std_m) == pytest.approx(0.003, rel=0.05)
    assert np.median(errors.bias_m) == pytest.approx(0.02, rel=0.05)
    assert np.median(errors.error_m) == pytest.approx(math.hypot(0.003, 0.02), rel=0.05)
    assert errors.outlier_share == 0.0


def test_strays_and_missing_ranges_are_outliers_and_leave_the_median_pixel_alone() -> None:
    random = np.random.default_rng(2)
    range_m = 1.0 + 0.003 * random.standard_normal((20, 100))
    range_m[::20] += 1.0  # 5 % of the captures
    range_m[:, :5] = np.nan

    errors = pixel_errors(range_m, np.ones(100))

    assert np.median(errors.error_m) == pytest.approx(0.003, rel=0.35)
    assert errors.outlier_share == pytest.approx(0.05 + 0.95 * 0.05, abs=0.01)
    assert np.isinf(errors.error_m[:5]).all()


def test_a_given_scene_has_the_moments_of_its_returns() -> None:
    scene = uniform_scene(1e6, [(1.5, 3.0), (3.0, 1.0)])
    period_m = tm.SPEED_OF_LIGHT_M_S / (2 * FREQUENCY_HZ)

    b = scene.relative_moments(2, FREQUENCY_HZ)

    expected = 0.75 * np.exp(4j * np.pi * 1.5 / period_m) + 0.25 * np.exp(
        4j * np.pi * 3.0 / period_m
    )
    assert b[0, 0] == pytest.approx(1.0)
    assert b[2, 0] == pytest.approx(expected)
    np.testing.assert_allclose(scene.direct_m, 1.5)
    assert scene.ambiguous(2.0)
    assert not scene.ambiguous(3.5)


def test_both_returns_count_as_found_only_near_their_places() -> None:
    phase = np.array([[1.0, 1.0, 1.0], [2.0, 1.6, 2.0]])
    weight = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 0.05]])
    returns = tm.Returns(phase, weight, np.zeros(3), np.full(3, 2))

    found = both_found(returns, np.array([1.0, 2.0]), threshold=0.1)

    np.testing.assert_array_equal(found, [True, False, False])
