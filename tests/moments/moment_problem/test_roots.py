"""Simultaneous roots."""

import numpy as np
import pytest

from tests.moments import oracles
from transientcam_moments.moment_problem._roots import circle_roots, disc_roots


def coefficients(roots: np.ndarray) -> np.ndarray:
    """a_1 .. a_m (m, P) of prod (z - p_l)."""
    return np.stack([np.poly(column)[1:] for column in roots.T], axis=1)


def matched(found: np.ndarray, roots: np.ndarray) -> float:
    """Largest distance of a root from the nearest one found, and the other way round."""
    distance = np.abs(found[:, None] - roots[None])
    return float(max(distance.min(axis=0).max(), distance.min(axis=1).max()))


@pytest.mark.parametrize("m", [1, 2, 3, 4, 8, 16])
def test_roots_in_the_disc_are_found(m: int) -> None:
    rng = np.random.default_rng(m)
    roots = np.sqrt(rng.random((m, 200))) * np.exp(1j * rng.uniform(0, 2 * np.pi, (m, 200)))

    found = np.stack(disc_roots(list(coefficients(roots))))

    assert matched(found, roots) < 1e-6


def test_multiple_roots_are_found_to_what_rounding_leaves() -> None:
    roots = np.array([[0.5, 0.9j, 0.0], [0.5, 0.9j, 0.0], [-0.2, 0.9j, 0.0]])

    found = np.stack(disc_roots(list(coefficients(roots))))

    assert matched(found, roots) < 1e-4


@pytest.mark.parametrize("m", [1, 2, 3, 4, 8, 16, 32])
def test_roots_on_the_circle_are_found_there(m: int) -> None:
    rng = np.random.default_rng(m)
    phase, _ = oracles.random_returns(rng, returns=m, pixels=200, apart_rad=5.5 / m)
    u = np.exp(-1j * phase)
    # 1 + a_1 u + ... with roots u: coefficients of prod (1 - u / u_l) = prod (1 - u conj(u_l))
    a = coefficients(u.conj())

    found = np.stack(circle_roots(list(a), np.full(200, m, np.int32), a[-1]))

    assert np.abs(np.abs(found) - 1).max() < 1e-13
    assert matched(found, u) < 1e-8  # coefficients are rounded, and 32 of them cancel


def test_pixels_of_different_degrees_are_solved_together() -> None:
    # (1 - u / i), (1 - u)(1 + u), 1 - u^3
    a = [
        np.array([1j, 0, 0], complex),
        np.array([0, -1, 0], complex),
        np.array([0, 0, -1], complex),
    ]

    found = circle_roots(a, np.array([1, 2, 3]), np.array([1j, -1, -1]))

    assert found[0][0] == pytest.approx(1j)
    assert matched(np.stack(found[:2])[:, 1:2], np.array([[1], [-1]])) < 1e-12
    third = np.exp(2j * np.pi * np.arange(3) / 3)[:, None]
    assert matched(np.stack(found)[:, 2:], third) < 1e-12


def test_a_pixel_of_nan_neither_stops_nor_disturbs_the_others() -> None:
    rng = np.random.default_rng(0)
    roots = 0.9 * np.exp(1j * rng.uniform(0, 2 * np.pi, (3, 10)))
    a = coefficients(roots)
    poisoned = a.copy()
    poisoned[:, 4] = np.nan
    others = np.arange(10) != 4

    with np.errstate(all="ignore"):  # as in the callers
        clean, touched = np.stack(disc_roots(list(a))), np.stack(disc_roots(list(poisoned)))

    assert np.array_equal(clean[:, others], touched[:, others])
    assert np.isnan(touched[:, 4]).all()
