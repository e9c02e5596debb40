"""The cumulative density."""

import numpy as np
import pytest
from scipy.integrate import quad

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_moments.moment_problem._cumulative import _TOLERANCE, _closed_form, _quadrature


@pytest.mark.parametrize("m", [1, 2, 3, 4, 8, 16, 32])
def test_cumulative_is_the_integral_of_the_density(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 8)
    b[0] *= 1.05  # wide enough for a plain rule to be exact
    c = tm.levinson(b)
    limits = np.array([0.0, 0.3, 2.5, 6.0, 2 * np.pi])
    n = 1 << 16

    found = tm.cumulative(c, limits)

    # composite Gauss-Legendre of two points on n panels up to each limit
    for limit, row in zip(limits, found, strict=True):
        middle = (np.arange(n) + 0.5) * limit / n
        offset = limit / n / 2 / np.sqrt(3)
        h = tm.density(c, middle - offset) + tm.density(c, middle + offset)
        assert np.allclose(row, h.sum(axis=0) * limit / n / 2, atol=1e-9 * b[0].real.max())


def test_cumulative_agrees_with_adaptive_quadrature_at_a_sharp_peak() -> None:
    c = tm.levinson(np.array([1 + 1e-6, np.exp(1j), np.exp(2j)]))

    expected, _ = quad(
        lambda x: float(tm.density(c, x)[0]),
        0,
        1.5,
        points=[1.0, 1 - 1e-6, 1 + 1e-6, 1 - 1e-4, 1 + 1e-4],
        epsabs=1e-12,
        limit=500,
    )

    assert tm.cumulative(c, 1.5) == pytest.approx(expected, abs=1e-9)


def test_a_turn_holds_all_light_and_more_turns_more_of_it() -> None:
    b = oracles.random_moments(np.random.default_rng(2), 3, 20)
    c = tm.levinson(b)

    found = tm.cumulative(c, [0.0, 2 * np.pi, 4 * np.pi, -2 * np.pi, 1.0, 1.0 + 2 * np.pi])

    b0 = b[0].real
    assert np.allclose(found[:4], np.outer([0, 1, 2, -1], b0), atol=1e-10 * b0.max())
    assert np.allclose(found[5] - found[4], b0, atol=1e-10 * b0.max())


def test_cumulative_never_falls() -> None:
    c = tm.levinson(tm.bias(oracles.random_moments(np.random.default_rng(3), 4, 50)).moments)

    steps = np.diff(tm.cumulative(c, np.linspace(0, 2 * np.pi, 400)), axis=0)

    assert steps.min() > -1e-9 * c.brightness.max()


def test_single_precision_is_integrated_in_double() -> None:
    b = oracles.random_moments(np.random.default_rng(4), 3, 50)
    phase = np.linspace(0, 6, 50)

    found = tm.cumulative(tm.levinson(b.astype(np.complex64)), phase)

    assert found.dtype == np.float32
    assert np.allclose(found, tm.cumulative(tm.levinson(b), phase), atol=1e-4 * b[0].real.max())


@pytest.mark.parametrize("apart", [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 0.0])
@pytest.mark.parametrize("radius", [0.3, 0.9, 0.999])
def test_coinciding_poles_do_not_hurt(apart: float, radius: float) -> None:
    poles = np.array([radius, radius + apart * 0.3, -0.4j]) * np.exp(1j)
    poles[1] = poles[0] * np.exp(1j * apart)
    a = np.poly(poles)[:, None]
    reflection = step_down(a[1:, 0])
    c = tm.from_reflection(np.ones(1), reflection[:, None])
    phase = np.linspace(0, 2 * np.pi, 33)

    found = tm.cumulative(c, phase)

    exact = _quadrature(c, phase)
    assert np.abs(found - exact).max() < 1e-10
    assert found[-1] == pytest.approx(1, abs=1e-11)


def test_closed_form_and_quadrature_meet_where_one_takes_over() -> None:
    phase = np.linspace(0, 2 * np.pi, 33)
    estimates = []
    for apart in np.geomspace(1e-6, 1e-1, 60):
        poles = 0.95 * np.exp(1j * np.array([1.0, 1.0 + apart, 4.0]))
        c = tm.from_reflection(np.ones(1), step_down(np.poly(poles)[1:])[:, None])
        closed, estimate = _closed_form(c, phase)
        estimates.append(estimate[0])
        if _TOLERANCE / 30 < estimate[0] < _TOLERANCE * 30:
            assert np.abs(closed - _quadrature(c, phase)).max() < 30 * _TOLERANCE

    assert min(estimates) < _TOLERANCE < max(estimates)  # both sides of the switch were visited


def test_dark_and_invalid_pixels_stay_by_themselves() -> None:
    c = tm.levinson(np.array([[1, 0, np.nan], [0.5, 0, 0], [0.1, 0, 0]], complex))

    found = tm.cumulative(c, [1.0, 2 * np.pi])

    assert found[1, 0] == pytest.approx(1)
    assert np.all(found[:, 1] == 0)
    assert np.isnan(found[:, 2]).all()


def step_down(a: np.ndarray) -> np.ndarray:
    """Reflection coefficients of a polynomial a_1 .. a_m."""
    reflection = []
    a = np.asarray(a, complex)
    while a.size:
        g = a[-1]
        reflection.append(g)
        a = (a[:-1] - g * a[-2::-1].conj()) / (1 - abs(g) ** 2)
    return np.array(reflection[::-1])
