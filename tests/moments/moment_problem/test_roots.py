"""Simultaneous roots."""

from typing import Any

import numpy as np
import pytest

from tests.moments import oracles
from transientcam_moments.moment_problem import half_turns
from transientcam_moments.moment_problem._circle import circle_roots, doubled
from transientcam_moments.moment_problem._cumulative import disc_roots


def coefficients(roots: np.ndarray) -> np.ndarray:
    """a_0 = 1, a_1 .. a_m (m + 1, P) of prod (z - p_l)."""
    return np.stack([np.poly(column) for column in roots.T], axis=1)


def matched(found: np.ndarray, roots: np.ndarray) -> float:
    """Largest distance of a root from the nearest one found, and the other way round."""
    distance = np.abs(found[:, None] - roots[None])
    return float(max(distance.min(axis=0).max(), distance.min(axis=1).max()))


@pytest.mark.parametrize("m", [1, 2, 3, 4, 8, 16])
def test_roots_in_the_disc_are_found(m: int) -> None:
    rng = np.random.default_rng(m)
    roots = np.sqrt(rng.random((m, 200))) * np.exp(1j * rng.uniform(0, 2 * np.pi, (m, 200)))

    found = np.stack(disc_roots(coefficients(roots)))

    assert matched(found, roots) < 1e-6


def test_multiple_roots_are_found_to_what_rounding_leaves() -> None:
    roots = np.array([[0.5, 0.9j, 0.0], [0.5, 0.9j, 0.0], [-0.2, 0.9j, 0.0]])

    found = np.stack(disc_roots(coefficients(roots)))

    assert matched(found, roots) < 1e-4


@pytest.mark.parametrize("m", [1, 2, 3, 4, 8, 16, 32])
def test_roots_on_the_circle_are_found_there(m: int) -> None:
    rng = np.random.default_rng(m)
    phase, _ = oracles.random_returns(rng, returns=m, pixels=200, apart_rad=5.5 / m)
    z = np.exp(1j * phase)
    # sum_j conj(a_j) z^j with the roots: coefficients of prod (1 - conj(u) u_l), u = 1 / z
    a = coefficients(z)
    re: list[Any] = list(a.real)
    im: list[Any] = list(a.imag)

    wr, wi = list(re[:m]), list(im[:m])

    moving = circle_roots((0,) * m, half_turns(m, float), 80, re, im, wr, wi)

    half: list[Any] = [np.stack(wr), np.stack(wi)]
    double: Any = doubled(*half)
    points = double[0] + 1j * double[1]
    assert not np.asarray(moving).any()
    assert np.abs(np.abs(points) - 1).max() < 1e-13
    assert matched(points, z) < 1e-8  # coefficients are rounded, and 32 of them cancel


def test_a_pixel_of_nan_neither_stops_nor_disturbs_the_others() -> None:
    rng = np.random.default_rng(0)
    roots = 0.9 * np.exp(1j * rng.uniform(0, 2 * np.pi, (3, 10)))
    a = coefficients(roots)
    poisoned = a.copy()
    poisoned[:, 4] = np.nan
    others = np.arange(10) != 4

    clean, touched = np.stack(disc_roots(a)), np.stack(disc_roots(poisoned))

    assert np.array_equal(clean[:, others], touched[:, others])
    assert np.isnan(touched[:, 4]).all()
