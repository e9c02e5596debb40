"""Newton's method on returns."""

import numpy as np

from tests.moments import oracles
from transientcam_moments.moment_problem._polishing import polish, residual, size


def test_residual_is_what_returns_leave_of_the_moments() -> None:
    rng = np.random.default_rng(0)
    phase, weight = oracles.random_returns(rng, returns=3, pixels=5)
    b = oracles.moments_of_returns(phase, weight, 3)
    b[0] += 0.5
    b[2] += 0.125

    left = residual(b, phase, weight, np.full(5, 0.5))

    assert np.allclose(left[2], 0.125)
    assert np.abs(left[[0, 1, 3]]).max() < 1e-13 * b[0].real.max()
    assert np.allclose(size(left, b), 0.125 / b[0].real)


def test_polishing_converges_from_rough_returns() -> None:
    rng = np.random.default_rng(1)
    phase, weight = oracles.random_returns(rng, returns=4, pixels=50, apart_rad=0.3)
    b = oracles.moments_of_returns(phase, weight, 4)
    b[0] += 0.1

    rough = phase + rng.normal(size=phase.shape) * 1e-4
    found = polish(b, rough, weight * 1.001, np.zeros(50), tolerance=1e-15)

    assert oracles.around(found[0] - phase).max() < 1e-10
    assert np.abs(found[1] / weight - 1).max() < 1e-9
    assert np.allclose(found[2], 0.1, atol=1e-12)


def test_unused_slots_stay_unused() -> None:
    phase, weight = np.array([[1.0], [np.nan]]), np.array([[2.0], [0.0]])
    b = oracles.moments_of_returns(np.nan_to_num(phase) + 1e-5, weight, 2)

    found = polish(b, phase, weight, np.zeros(1), tolerance=1e-15)

    assert abs(found[0][0, 0] - 1.00001) < 1e-12
    assert np.isnan(found[0][1, 0])
    assert found[1][1, 0] == 0


def test_a_step_that_does_not_help_is_not_taken() -> None:
    # coinciding returns: the linear system says nothing
    phase, weight = np.array([[1.0], [1.0]]), np.array([[1.0], [1.0]])
    b = oracles.moments_of_returns(np.array([[1.0], [2.0]]), weight, 2)
    before = size(residual(b, phase, weight, np.zeros(1)), b)

    found = polish(b, phase, weight, np.zeros(1), tolerance=1e-15)

    assert size(residual(b, *found), b) <= before
    assert np.isfinite(found[0]).all()
    assert np.all(found[1] > 0)


def test_weights_that_are_off_alone_are_right_after_one_solution() -> None:
    """They are linear in the moments, however far off they are: Newton's method need not begin."""
    rng = np.random.default_rng(2)
    phase, weight = oracles.random_returns(rng, returns=3, pixels=40, apart_rad=0.5)
    b = oracles.moments_of_returns(phase, weight, 3)

    off = weight * rng.uniform(0.2, 5, weight.shape)
    found = polish(b, phase, off, np.zeros(40), tolerance=1e-9)

    assert np.array_equal(found[0], phase)
    assert np.abs(found[1] / weight - 1).max() < 1e-9
