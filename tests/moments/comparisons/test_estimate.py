"""Cumulative responses and first returns of the forms that techniques answer in."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_moments.comparisons import (
    GridEstimate,
    MaximumEntropyEstimate,
    SparseEstimate,
    grid_rad,
)


def test_returns_come_one_after_the_other_over_what_is_uniform() -> None:
    estimate = SparseEstimate(
        np.array([[1.0], [4.0], [np.nan]]), np.array([[2.0], [3.0], [0.0]]), np.array([0.5])
    )

    come = estimate.cumulative([0.0, 1.0, 3.0, 4.0, 2 * np.pi, 2 * np.pi + 1.0])

    uniform = 0.5 * np.array([0, 1, 3, 4, 2 * np.pi, 2 * np.pi + 1]) / (2 * np.pi)
    assert come[:, 0] == pytest.approx(uniform + np.array([0, 2, 2, 5, 5, 7]))
    assert estimate.separate() == tm.Separation(2.0, 3.0, 1.0)
    assert estimate.first_phase_rad(threshold=0.9) == 4.0


def bump(centre_rad: float, *, bins: int = 256) -> np.ndarray:
    """Light 1 around a phase, around the turn."""
    density: np.ndarray = np.exp(20 * (np.cos(grid_rad(bins) - centre_rad) - 1))
    normal: np.ndarray = density / (density.mean() * 2 * np.pi)
    return normal


@pytest.mark.parametrize("first", [0.001, 1.0, 2.5, 6.28])
def test_the_first_peak_of_a_density_is_separated_from_valley_to_valley(first: float) -> None:
    later = first + 2.0 if first < 4 else first - 2.0
    estimate = GridEstimate((2 * bump(first) + 3 * bump(later))[:, None])

    separation = estimate.separate()

    earlier, direct = (first, 2.0) if first < later else (later, 3.0)
    assert oracles.around(separation.phase_rad - earlier).max() < 1e-4
    assert separation.direct == pytest.approx(direct, rel=1e-3)
    assert separation.indirect == pytest.approx(5.0 - direct, rel=1e-3)


def test_the_cumulative_density_is_that_of_its_bins() -> None:
    density = np.array([[1.0], [0.0], [3.0], [-1.0]])
    estimate = GridEstimate(density)

    come = estimate.cumulative(np.array([0, 0.5, 1, 2, 2.5, 3, 4, 5]) * np.pi / 2)[:, 0]

    assert come == pytest.approx(np.array([0, 0.5, 1, 1, 2.5, 4, 3, 4]) * np.pi / 2)


def test_a_density_without_a_peak_has_no_first_one() -> None:
    separation = GridEstimate(np.ones((16, 2)) * [1.0, 0.0]).separate()

    assert np.isnan(separation.phase_rad).all()
    assert np.array_equal(separation.direct, [0, 0])


def test_maximum_entropy_answers_as_its_own_functions_do() -> None:
    b = oracles.random_moments(np.random.default_rng(1), 4, 5)
    coefficients = tm.levinson(b)
    estimate = MaximumEntropyEstimate(coefficients)

    assert np.array_equal(estimate.cumulative([2.0]), tm.cumulative(coefficients, [2.0]))
    assert np.array_equal(estimate.first_phase_rad(), tm.peaks(coefficients).first_rad)
    separation = estimate.separate()
    assert separation.direct + separation.indirect == pytest.approx(b[0].real, rel=2e-2)
