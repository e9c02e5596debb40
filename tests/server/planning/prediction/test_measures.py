"""Errors of ranges, scenes and returns as plans measure them."""

import math

import numpy as np
import pytest

import transientcam_moments as tm
from transientcam_server.planning import uniform_scene
from transientcam_server.planning._prediction.measures import pixel_errors
from transientcam_server.planning._prediction.resolving import LEVELS, _interpolated, both_found

FREQUENCY_HZ = 23e6


def test_errors_of_drawn_ranges_are_their_deviation_and_their_bias() -> None:
    random = np.random.default_rng(1)
    true_m = np.linspace(1.0, 2.0, 500)
    range_m = true_m + 0.02 + 0.003 * random.standard_normal((40, 500))

    errors = pixel_errors(range_m, true_m)

    assert np.median(errors.std_m) == pytest.approx(0.003, rel=0.05)
    assert np.median(errors.bias_m) == pytest.approx(0.02, rel=0.05)
    assert np.median(errors.error_m) == pytest.approx(math.hypot(0.003, 0.02), rel=0.05)


def test_strays_and_missing_ranges_are_far_off_and_leave_the_median_pixel_alone() -> None:
    random = np.random.default_rng(2)
    range_m = 1.0 + 0.003 * random.standard_normal((20, 100))
    range_m[::20] += 1.0  # 5 % of the captures
    range_m[:, :5] = np.nan

    errors = pixel_errors(range_m, np.ones(100))

    assert np.median(errors.error_m) == pytest.approx(0.003, rel=0.35)
    assert (errors.off_m(errors.bias_m) > 0.5).mean() == pytest.approx(0.05 + 0.95 * 0.05)
    assert np.isinf(errors.error_m[:5]).all()


def test_two_ranges_are_enough_and_one_is_not() -> None:
    nothing = np.nan
    range_m = np.array([[1.0, 1.0, nothing], [3.0, nothing, nothing], [nothing] * 3])

    errors = pixel_errors(range_m, np.ones(3), uncertainty_m=np.array([0.0, 1.0, 2.0]))

    assert errors.centre_m == pytest.approx([2.0, 0.0, 0.0])
    assert errors.bias_m == pytest.approx([1.0, np.inf, np.inf])
    # two normal variables differ by 0.954 deviations in the median, and these do by 2
    assert errors.std_m == pytest.approx([2 / 0.9539, np.inf, np.inf], rel=1e-3)


def test_what_the_truth_is_off_by_counts_as_bias() -> None:
    range_m = np.array([[1.3, 0.7], [1.3, 0.7]])

    errors = pixel_errors(range_m, np.ones(2), uncertainty_m=0.4)

    assert errors.bias_m == pytest.approx(0.5)
    assert errors.error_m == pytest.approx(0.5)


def test_ranges_are_as_far_off_as_they_are_and_as_another_bias_would_put_them() -> None:
    range_m = np.array([[1.25, 0.5], [1.5, 0.5], [1.75, 0.75]])

    errors = pixel_errors(range_m, np.ones(2))

    assert errors.bias_m == pytest.approx([0.5, 0.5])
    np.testing.assert_allclose(errors.off_m(errors.bias_m), np.abs(range_m - 1).T)
    np.testing.assert_allclose(
        errors.off_m(np.array([0.0, 1.0])), [[0.25, 0.0, 0.25], [1.0, 1.0, 0.75]]
    )


def test_the_farthest_of_two_truths_is_the_most_that_a_range_may_be_off() -> None:
    errors = pixel_errors(np.tile([2.0, 2.0, 2.0], (2, 1)), np.array([2.0, 2.0, 2.6]))

    farthest_m = errors.farthest_m(np.array([1.9, 1.6, 1.9]), np.array([2.3, 2.1, 2.1]))

    assert farthest_m == pytest.approx([0.3, 0.4, 0.6])


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


@pytest.mark.parametrize(
    ("off_rad", "weight", "found"),
    [
        (0.0, 0.1, True),
        (0.0, 0.0999, False),
        (0.2499, 1.0, True),
        (-0.2499, 1.0, True),
        (0.2501, 1.0, False),
        (-0.2501, 1.0, False),
    ],
)
def test_a_return_counts_within_a_quarter_of_the_distance_and_from_the_threshold_on(
    off_rad: float, weight: float, *, found: bool
) -> None:
    for phase, weights in (
        ([1.0, 2.0 + off_rad], [1.0, weight]),
        ([1.0 + off_rad, 2.0], [weight, 1.0]),
    ):
        returns = tm.Returns(
            np.array(phase)[:, None], np.array(weights)[:, None], np.zeros(1), np.full(1, 2)
        )
        assert both_found(returns, np.array([1.0, 2.0]), threshold=0.1).tolist() == [found]


def test_pixels_without_light_have_no_returns() -> None:
    returns = tm.Returns(np.array([[1.0], [2.0]]), np.zeros((2, 1)), np.zeros(1), np.zeros(1, int))

    assert both_found(returns, np.array([1.0, 2.0]), threshold=0.1).tolist() == [False]


def test_between_levels_of_noise_a_table_is_interpolated_by_their_logarithms() -> None:
    noise = np.array([5e-5, 1.234e-4, 0.01, 0.3, 0.5])
    power = np.repeat(LEVELS[:, None] ** 1.5, 5, axis=1)
    linear = np.repeat(np.log(LEVELS)[:, None], 5, axis=1)

    assert _interpolated(noise, power, log=True) == pytest.approx(noise**1.5)
    assert _interpolated(noise, linear, log=False) == pytest.approx(np.log(noise))
    beyond = np.array([1e-6, 1e-5, 0.6, 1.0, 9.0])
    ends = np.array([5e-5, 5e-5, 0.5, 0.5, 0.5])
    assert _interpolated(beyond, power, log=True) == pytest.approx(ends**1.5)


def test_each_pixel_is_looked_up_in_its_own_column() -> None:
    table = np.arange(5) + np.zeros((len(LEVELS), 1))

    assert _interpolated(np.full(5, 0.01), table, log=False) == pytest.approx(np.arange(5))
