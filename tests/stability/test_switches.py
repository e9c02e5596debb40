"""Nothing jumps where one way to compute hands over to another."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles


def family(values: np.ndarray, m: int = 3) -> np.ndarray:
    """Two returns and a uniform part `values`: from clearly valid to clearly contradictory."""
    b = oracles.moments_of_returns([[1.0], [2.3]], [[1.0], [0.4]], m) * np.ones(values.size)
    b[0] += values
    return b


def steepest(results: np.ndarray) -> float:
    """Largest change of a result from one pixel to the next, relative to its range."""
    return float(np.abs(np.diff(results, axis=-1)).max() / np.abs(results).max())


def test_biasing_sets_in_without_a_jump() -> None:
    uniform = np.linspace(-0.1, 0.1, 4001)

    for keep in ("harmonics", "brightness"):
        b, biased = tm.bias(family(uniform), keep=keep)
        c = tm.levinson(b)
        assert biased.any()
        assert not biased.all()
        assert steepest(b) < 1e-3
        assert steepest(c.polynomial) < 2e-2
        assert steepest(tm.cumulative(c, [0.5, 1.5, 4.0])) < 2e-2
        assert steepest(tm.pisarenko(b).weight) < 1e-3


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_the_border_of_the_cone_is_reached_without_a_jump(dtype: type) -> None:
    # through the floor of the recursion, in steps of its own size
    eps = float(np.finfo(dtype).eps)
    uniform = np.concatenate([np.geomspace(1e4, 1, 60), np.zeros(1), -np.geomspace(1, 1e4, 60)])
    b: np.ndarray = family(uniform * eps).astype(dtype)

    c = tm.levinson(b)

    assert np.all(c.error > 0)
    light = tm.cumulative(c, [0.5, 1.65, 4.0])
    assert np.abs(light - [[0.0], [1.0], [1.4]]).max() < 1e5 * eps
    # g_1 comes before the border, g_2 is at it, and what follows has no light to move
    assert np.abs(np.diff(c.reflection[:2], axis=1)).max() < 2e4 * eps


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_two_returns_become_one_without_a_jump_of_their_moments(dtype: type) -> None:
    apart = np.geomspace(0.3, 1e-9, 2000)
    phase = np.stack([np.full(apart.size, 2.0), 2.0 + apart])
    b: np.ndarray = oracles.moments_of_returns(phase, np.array([[1.0], [0.5]]), 3)
    b = b.astype(dtype)

    found = tm.pisarenko(b)

    eps = float(np.finfo(dtype).eps)
    assert set(found.count) == {1, 2}
    again = oracles.moments_of_returns(np.nan_to_num(found.phase_rad), found.weight, 3)
    # around 1e-5 rad double precision knows neither one return nor two to its last digits
    assert (np.abs(again - b).max(axis=0) / b[0].real).max() < max(256 * eps, 1e-9)
    centre = np.nansum(found.phase_rad * found.weight, axis=0) / found.weight.sum(axis=0)
    assert np.abs(centre - (2.0 + apart / 3)).max() < 64 * eps**0.5


def test_single_precision_is_helped_by_double_without_a_jump() -> None:
    apart = np.geomspace(0.5, 1e-2, 3000)
    phase = np.stack([np.full(apart.size, 2.0), 2.0 + apart])
    b = oracles.moments_of_returns(phase, np.array([[1.0], [0.5]]), 2).astype(np.complex64)

    found = tm.pisarenko(b)

    # rounding of b moves the weights by about eps / apart^3, and nothing moves them by more
    error = np.abs(found.weight - [[1.0], [0.5]]) * apart**3
    assert error.max() < 60 * np.finfo(np.float32).eps


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("side", [-1, 1])
def test_far_scales_are_lifted_without_a_jump(dtype: type, side: int) -> None:
    middle = np.finfo(dtype).maxexp * 3 // 4
    scale = 2.0 ** (side * (middle + np.arange(-3.0, 4.0)))
    b: np.ndarray = (family(np.full(scale.size, 0.01)) * scale).astype(dtype)
    plain: np.ndarray = family(np.full(scale.size, 0.01)).astype(dtype)

    c, c_plain = tm.levinson(b), tm.levinson(plain)
    found, found_plain = tm.pisarenko(b), tm.pisarenko(plain)

    assert np.allclose(c.reflection, c_plain.reflection, rtol=1e-5)
    assert np.allclose(found.phase_rad, found_plain.phase_rad, rtol=1e-5, equal_nan=True)
    assert np.allclose(found.weight / scale, found_plain.weight, rtol=1e-4)
    assert np.allclose(tm.smallest_eigenvalue(b) / scale, 0.01, rtol=1e-4)


def test_the_cumulative_density_changes_its_method_without_a_jump() -> None:
    # poles that come together, through the switches between both closed forms and quadrature
    apart = np.geomspace(1e-1, 1e-9, 400)
    sharp = np.geomspace(0.3, 2e-5, 4)
    phase = np.array([0.5, 0.95, 1.2, 3.0])
    for width in sharp:
        poles = (1 - width) * np.exp(1j * np.stack([np.full(400, 1.0), 1.0 + apart]))
        # z^2 + a_1 z + a_2 has g_2 = a_2 and g_1 = (a_1 - g_2 conj(a_1)) / (1 - |g_2|^2)
        a_1, a_2 = -poles.sum(axis=0), poles.prod(axis=0)
        first = (a_1 - a_2 * a_1.conj()) / (1 - np.abs(a_2) ** 2)
        c = tm.from_reflection(np.ones(400), np.stack([first, a_2]))

        light = tm.cumulative(c, phase)

        assert np.all((light > -1e-6) & (light < 1 + 1e-6))
        assert np.abs(np.diff(light, n=2, axis=1)).max() < 0.02
