"""Sharp bounds and the smoothed density."""

import numpy as np
import pytest
from scipy.optimize import linprog

import transientcam_moments as tm
from tests.moments import oracles


def poisson(phase: np.ndarray, radius: float) -> np.ndarray:
    """P_r of Sec. 5.2."""
    kernel: np.ndarray = (1 - radius**2) / np.abs(1 - radius * np.exp(1j * phase)) ** 2
    return kernel / (2 * np.pi)


def printed_bounds(b: np.ndarray, phi: float, radius: float) -> tuple[float, float]:
    """The closed form with a dense solve, for one pixel."""
    m = b.size - 1
    w = radius * np.exp(1j * phi)
    power = w ** np.arange(m + 1)
    p = np.array([sum(w**k * b[j - k] for k in range(j)) + w**j * b[0] / 2 for j in range(m + 1)])
    solve = np.linalg.solve(oracles.toeplitz(b), np.stack([power, p], axis=1))
    kappa = (power.conj() @ solve[:, 0]).real
    centre = 2 / kappa * (1 / (1 - radius**2) - power.conj() @ solve[:, 1])
    spread = 2 * radius ** (m + 1) / ((1 - radius**2) * kappa)
    return (centre.real - spread) / (2 * np.pi), (centre.real + spread) / (2 * np.pi)


@pytest.mark.parametrize("radius", [0.5, 0.93])
def test_bounds_are_the_extremes_of_a_linear_program(radius: float) -> None:
    grid = 2 * np.pi * np.arange(720) / 720
    for m in (1, 2, 3):
        b = oracles.random_moments(np.random.default_rng(m), m, 1)[:, 0]
        b[0] += 0.1 * b[0].real
        b /= b[0].real
        waves = np.exp(1j * np.outer(np.arange(m + 1), grid))
        rows = np.concatenate([waves.real, waves[1:].imag])
        right = np.concatenate([b.real, b[1:].imag])
        for phi in (0.3, 2.0, 4.4):
            cost = poisson(grid - phi, radius)
            least, greatest = (
                linprog(sign * cost, A_eq=rows, b_eq=right, bounds=(0, None), method="highs").fun
                for sign in (1, -1)
            )

            lower, upper = tm.bounds(b, phi, radius)

            width = upper[0] - lower[0]
            # a coarser grid allows less than all positions of light do
            assert lower[0] - 1e-9 <= least <= lower[0] + 2e-2 * width
            assert upper[0] + 1e-9 >= -greatest >= upper[0] - 2e-2 * width


@pytest.mark.parametrize("m", [1, 2, 3, 4, 8, 16, 32])
def test_bounds_are_those_of_the_closed_form(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 5)
    phase = np.array([0.0, 1.0, 3.0, 6.0])

    for radius in (0.0, 0.3, 0.93, 0.999):
        lower, upper = tm.bounds(b, phase, radius)
        scale = upper.max()
        for pixel in range(5):
            printed = [printed_bounds(b[:, pixel], phi, radius) for phi in phase]
            assert np.allclose(lower[:, pixel], [p[0] for p in printed], atol=1e-7 * scale)
            assert np.allclose(upper[:, pixel], [p[1] for p in printed], atol=1e-7 * scale)


@pytest.mark.parametrize("m", [1, 3, 8])
def test_smoothed_density_is_the_convolution(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 5)
    c = tm.levinson(b)
    phase = np.linspace(0, 2 * np.pi, 1 << 14, endpoint=False)
    h = tm.density(c, phase)
    at = np.array([0.5, 2.0, 5.5])

    for radius in (0.0, 0.5, 0.93):
        kernel = poisson(at[:, None] - phase, radius) * 2 * np.pi / phase.size
        assert np.allclose(tm.smoothed_density(c, at, radius), kernel @ h, rtol=1e-7)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_every_density_with_these_moments_lies_between_the_bounds(dtype: type) -> None:
    phase, weight = oracles.random_returns(np.random.default_rng(0), returns=7, pixels=40)
    b = oracles.moments_of_returns(phase, weight, 3)
    at = np.linspace(0, 6, 20)
    truth = (weight * poisson(at[:, None, None] - phase, 0.93)).sum(axis=1)

    lower, upper = tm.bounds(b.astype(dtype), at)
    smoothed = tm.smoothed_density(tm.levinson(b.astype(dtype)), at)

    slack = 1e-3 * truth.max() if dtype == np.complex64 else 1e-10
    assert lower.dtype == np.finfo(dtype).dtype
    for inside in (truth, smoothed):
        assert np.all(lower - slack <= inside)
        assert np.all(inside <= upper + slack)


def test_bounds_close_in_as_the_signal_becomes_sparse() -> None:
    b = oracles.moments_of_returns([[1.0], [3.0]], [[1.0], [0.5]], 2)
    widths = []
    for uniform in (1e-4, 1e-6, 1e-8, 1e-10):
        raised = b + np.array([[uniform], [0], [0]])
        lower, upper = tm.bounds(raised, 1.0)
        widths.append(float(upper[0, 0] - lower[0, 0]))

    assert np.allclose(np.array(widths[1:]) / widths[:-1], 1e-2, rtol=0.2)


def test_invalid_and_dark_pixels_stay_by_themselves() -> None:
    lower, upper = tm.bounds(np.array([[np.nan, 0, 1], [0, 0, 0.5]], complex), [0.0, 1.0])

    assert np.isnan(lower[:, 0]).all()
    assert np.all(upper[:, 1] == 0)
    assert np.isfinite(upper[:, 2]).all()


def test_a_wrong_radius_is_refused() -> None:
    b = np.array([1.0, 0.5])
    for radius in (-0.1, 1.0, 2.0):
        with pytest.raises(tm.ParameterError, match="0 <= radius < 1"):
            tm.bounds(b, 0.0, radius)
        with pytest.raises(tm.ParameterError, match="radius"):
            tm.smoothed_density(tm.levinson(b), 0.0, radius)
