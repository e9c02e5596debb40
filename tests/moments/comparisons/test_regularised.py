"""A whole image with priors: its cost, its optimum, and what the priors do to light."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_moments.comparisons._pixels import pixels_of
from transientcam_moments.comparisons._regularised import Problem, regularised


def image(*, noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Moments (5, 6, 8) of a slanted wall with a second return on one half, and its phase."""
    y, x = np.mgrid[:6, :8]
    phase = np.stack([1 + 0.02 * x, 3 + 0.01 * y])
    weight = np.stack([1 + 0 * x, 0.5 * (x > 3)])
    b = oracles.moments_of_returns(phase, weight, 4)
    rng = np.random.default_rng(seed)
    return b + noise * (rng.normal(size=b.shape) + 1j * rng.normal(size=b.shape)), phase[0]


def test_the_gradient_is_that_of_the_cost() -> None:
    b, _ = image(noise=0.05)
    b[2, 1, 1] = np.nan
    problem = Problem(pixels_of(b[:, :3, :4], least=1, name=""), 0.01, 0.02, 0.02, 12)
    x = np.abs(np.random.default_rng(1).normal(size=(12, 12)))

    slope = problem.cost(x)[1]

    measured = approx_fprime(x.ravel(), lambda flat: problem.cost(flat.reshape(x.shape))[0], 1e-7)
    assert slope.ravel() == pytest.approx(measured, abs=2e-5)


def test_the_answer_is_the_optimum() -> None:
    # convex: where the gradient is 0, or positive in a dark bin, there is nothing below
    b, _ = image(noise=0.02)
    problem = Problem(pixels_of(b[:, :2, :3], least=1, name=""), 1e-3, 3e-3, 0.1, 16)

    x = problem.solve(3000)

    slope = problem.cost(x)[1]
    assert x.min() >= 0
    assert slope.min() > -2e-5
    assert np.abs(slope[x > 1e-6]).max() < 2e-5


def test_neighbours_take_noise_away() -> None:
    b, phase = image(noise=0.1)

    alone, together = (
        regularised(b, spatial=spatial).first_phase_rad(threshold=0.5) for spatial in (0.0, 3e-3)
    )

    assert np.std(together - phase) < 0.7 * np.std(alone - phase)


def test_priors_over_time_lose_what_is_sharp() -> None:
    # Sec. 2: "the regularization priors tend to lose high-frequency temporal details"
    b = oracles.moments_of_returns(np.array([[1.5], [2.4]]), np.array([[1.0], [0.4]]), 8)

    sharp, smeared = (regularised(b, temporal=each).density[:, 0] for each in (1e-4, 3e-2))

    assert smeared.max() < 0.7 * sharp.max()
    wide = [np.count_nonzero(each > 0.5 * each.max()) for each in (sharp, smeared)]
    assert wide[1] > 1.3 * wide[0]


def test_a_pixel_that_cannot_be_used_is_no_neighbour() -> None:
    b, phase = image(noise=0.0)
    b[1, 3, 5] = np.inf
    b[:, 4, 5] = 0

    found = regularised(b).first_phase_rad()

    assert np.isnan(found[[3, 4], [5, 5]]).all()
    seen = np.isfinite(found)
    assert seen.sum() == found.size - 2
    assert np.abs(found - phase)[seen].max() < 0.1


@pytest.mark.parametrize(
    "arguments",
    [{"temporal": -1.0}, {"spatial": np.inf}, {"delta": 0.0}, {"bins": 8}, {"iterations": 0}],
    ids=str,
)
def test_arguments_that_it_cannot_work_with_are_refused(arguments: dict[str, float]) -> None:
    with pytest.raises(tm.ParameterError, match=next(iter(arguments))):
        regularised(np.ones((5, 2, 2)), **arguments)  # type: ignore[arg-type]  # by name
