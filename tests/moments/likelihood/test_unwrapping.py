"""One return from the phases of several frequencies: a search over all wrap counts."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments.oracles import around

KINECT = (2, 10, 15)
SETS = [(1,), (1, 2, 3, 4), KINECT, (4, 6, 9), (6, 10), (3, 5, 7, 11, 32)]
Array = NDArray[Any]


def one_return(multiples: tuple[int, ...], phase: Array, weight: float = 1.0) -> Array:
    j = np.array((0, *multiples)).reshape((-1, *[1] * phase.ndim))
    return np.asarray(weight * np.exp(1j * j * phase))


def noise_of(multiples: tuple[int, ...], std: float) -> tm.noise.MomentNoise:
    return tm.noise.MomentNoise(np.full(len(multiples) + 1, std**2))


def noisy(b: Array, std: float, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    return b + std * (rng.normal(size=b.shape) + 1j * rng.normal(size=b.shape))


def least_over_all_phases(b: Array, multiples: tuple[int, ...], std: float) -> tuple[Array, Array]:
    """Chi-square of the phases (P, G) over a fine grid, and its phases, one by one."""
    period = 2 * np.pi / math.gcd(*multiples)
    grid = np.linspace(0, period, 8000, endpoint=False)
    cost = np.zeros((b.shape[1], len(grid)))
    for j, plane in zip(multiples, b[1:], strict=True):
        left = around(np.angle(plane)[:, None] - j * grid)
        cost += (np.abs(plane)[:, None] * left / std) ** 2
    return cost, grid


@pytest.mark.parametrize("multiples", SETS)
@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_without_noise_the_phase_is_exact_over_the_period_of_the_common_divisor(
    multiples: tuple[int, ...], dtype: type
) -> None:
    period = 2 * np.pi / math.gcd(*multiples)
    phase = (np.arange(40) + 0.31).reshape(4, 10) * (period / 40)
    std = 1e-3
    b: Array = one_return(multiples, phase, 5.0).astype(dtype)

    found = tm.unwrap(b, noise_of(multiples, std), harmonics=(0, *multiples))

    np.testing.assert_allclose(found.phase_rad, phase, atol=1e-5)
    np.testing.assert_allclose(found.weight, 5.0, rtol=1e-5)
    information = sum(j * j for j in multiples) * (5.0 / std) ** 2
    np.testing.assert_allclose(found.phase_std_rad, information**-0.5, rtol=1e-4)
    assert found.explained().all()
    assert not found.ambiguous().any()
    assert (found.degrees_of_freedom == len(multiples) - 1).all()


@settings(max_examples=40, deadline=None)
@given(
    multiples=st.sets(st.integers(1, 20), min_size=1, max_size=4).map(lambda s: tuple(sorted(s))),
    std=st.floats(0.02, 0.4),
    seed=st.integers(0, 2**32 - 1),
)
def test_no_phase_explains_better_than_the_one_found(
    multiples: tuple[int, ...], std: float, seed: int
) -> None:
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, 8)
    b = noisy(one_return(multiples, phase), std, seed)

    found = tm.unwrap(b, noise_of(multiples, std), harmonics=(0, *multiples))

    cost, grid = least_over_all_phases(b, multiples, std)
    # a parabola's step between two points of the grid
    curvature = sum((j * np.abs(plane)) ** 2 for j, plane in zip(multiples, b[1:], strict=True))
    slack = curvature * (grid[1] / std) ** 2
    assert (found.chi_square <= cost.min(axis=1) + 1e-6).all()
    assert (found.chi_square >= cost.min(axis=1) - slack).all()
    apart = around(math.gcd(*multiples) * (found.phase_rad[:, None] - grid))
    here = apart < 1.5 * math.gcd(*multiples) * grid[1]
    assert (np.where(here, cost, np.inf).min(axis=1) <= found.chi_square + slack + 1e-6).all()


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_lead_is_that_over_the_best_phase_elsewhere(seed: int) -> None:
    std, phase = 0.2, np.random.default_rng(seed).uniform(0, 2 * np.pi, 8)
    b = noisy(one_return(KINECT, phase), std, seed)

    found = tm.unwrap(b, noise_of(KINECT, std), harmonics=(0, *KINECT))

    cost, grid = least_over_all_phases(b, KINECT, std)
    # local minima of the grid that are further away than the same hypothesis could be
    low = (cost <= np.roll(cost, 1, axis=1)) & (cost <= np.roll(cost, -1, axis=1))
    apart = around(found.phase_rad[:, None] - grid) > 4 * found.phase_std_rad[:, None] + grid[1]
    other = np.where(low & apart, cost, np.inf).min(axis=1)
    assert (found.chi_square + found.lead <= other + 1e-6).all()
    # the grid misses the minimum by no more than a step's parabola; a minimum in the middle of two
    # wrap counts of the lead is none of the wrapped phases'
    slack = sum((j * np.abs(b[i + 1])) ** 2 for i, j in enumerate(KINECT)) * (grid[1] / std) ** 2
    assert (found.lead >= np.minimum(other - found.chi_square, 20) - slack).mean() > 0.7


def test_wrong_wrap_counts_are_flagged_and_right_ones_seldom() -> None:
    phase = np.random.default_rng(1).uniform(0, 2 * np.pi, 20_000)
    std = 0.25
    b = noisy(one_return(KINECT, phase), std, 2)

    found = tm.unwrap(b, noise_of(KINECT, std), harmonics=(0, *KINECT))

    wrong = around(found.phase_rad - phase) > 0.15
    assert wrong.mean() > 2e-3  # there is something to flag
    assert (wrong & ~found.ambiguous()).mean() < 1e-3
    assert found.ambiguous().mean() < 0.5
    right = around(found.phase_rad - phase)[~wrong & ~found.ambiguous()]
    assert np.sqrt((right**2).mean()) == pytest.approx(np.median(found.phase_std_rad), rel=0.1)


def test_a_frequency_that_was_not_measured_shortens_the_period_and_is_flagged() -> None:
    variance = np.full((4, 2), 1e-4)
    variance[1, 1] = np.inf  # 16 MHz is void: 10 and 15 repeat five times

    found = tm.unwrap(
        one_return(KINECT, np.array([4.0, 4.0])),
        tm.noise.MomentNoise(variance),
        harmonics=(0, *KINECT),
    )

    assert found.ambiguous().tolist() == [False, True]
    assert around(5 * (found.phase_rad - 4.0)) == pytest.approx([0, 0], abs=1e-6)
    assert found.degrees_of_freedom.tolist() == [2, 1]


def test_two_returns_are_not_explained_as_one() -> None:
    phase = np.linspace(0.3, 5.5, 50)
    b = one_return(KINECT, phase) + one_return(KINECT, phase + 0.35, 0.5)

    found = tm.unwrap(b, noise_of(KINECT, 0.01), harmonics=(0, *KINECT))

    assert not found.explained().any()


def test_pixels_without_light_or_number_have_no_return() -> None:
    b = one_return(KINECT, np.full(4, 1.0))
    b[:, 1] = 0
    b[2, 2] = np.nan
    b[3, 3] = np.inf

    found = tm.unwrap(b, harmonics=(0, *KINECT))

    assert np.isfinite(found.phase_rad).tolist() == [True, False, False, False]
    assert found.weight[1:].tolist() == [0, 0, 0]
    assert found.explained().tolist() == [True, False, False, False]


def test_what_cannot_be_unwrapped_is_refused() -> None:
    b = one_return(KINECT, np.array([1.0]))
    with pytest.raises(tm.ParameterError, match="harmonics"):
        tm.unwrap(b, harmonics=(0, 2, 2, 3))
    with pytest.raises(tm.ShapeError, match="harmonics"):
        tm.unwrap(b, harmonics=(1, 2))
    with pytest.raises(tm.ParameterError, match="model_error"):
        tm.unwrap(b, harmonics=(0, *KINECT), model_error=2.0)
    with pytest.raises(tm.ParameterError, match="significance"):
        tm.unwrap(b, harmonics=(0, *KINECT)).ambiguous(0.0)


def test_within_a_largest_phase_it_finds_what_trying_all_wrap_counts_finds() -> None:
    multiples, most_rad = (305, 2046), 0.02
    rng = np.random.default_rng(5)
    phase = rng.uniform(0.0, most_rad, 200)
    noise = 0.05 * (rng.standard_normal((2, 200)) + 1j * rng.standard_normal((2, 200)))
    b = np.exp(1j * np.outer(multiples, phase)) + noise
    found = tm.unwrap(b, harmonics=multiples, most_rad=most_rad)

    tried = np.linspace(0.0, most_rad, 20_001)
    cost = sum(
        abs(each)[:, None] ** 2 * np.angle(each[:, None] * np.exp(-1j * j * tried)) ** 2
        for j, each in zip(multiples, b, strict=True)
    )
    inside = (found.phase_rad > 0) & (found.phase_rad < most_rad)  # noise may leave it
    best = tried[np.argmin(cost, axis=1)]
    assert inside.mean() > 0.9
    assert found.phase_rad[inside] == pytest.approx(best[inside], abs=2 * most_rad / 20_000)


def test_multiples_above_32_need_a_largest_phase() -> None:
    b = np.ones((2, 4), complex)
    with pytest.raises(tm.ParameterError, match="different ones of 0 to 32"):
        tm.unwrap(b, harmonics=(305, 2046))
    with pytest.raises(tm.ParameterError, match="0 to a turn"):
        tm.unwrap(b, harmonics=(1, 2), most_rad=7.0)
