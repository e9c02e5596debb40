"""Least brightness: the linear program, its closed form, its table, and its logarithmic cousin."""

from itertools import pairwise

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles
from tests.moments.comparisons import signals
from transientcam_moments.comparisons import _sra_table as sra_table_module
from transientcam_moments.comparisons._logarithmic import logarithmic
from transientcam_moments.comparisons._sra import program, sra
from transientcam_moments.comparisons._sra_table import sra_table


def waves(m: int, bins: int) -> np.ndarray:
    """Real and imaginary parts (2 m, bins) of the moments of a unit of light in each bin."""
    angles = np.outer(np.arange(1, m + 1), 2 * np.pi * np.arange(bins) / bins)
    return np.concatenate([np.cos(angles), np.sin(angles)])


@pytest.mark.parametrize("m", [1, 2, 3, 4])
def test_without_tolerance_the_least_brightness_is_minus_the_smallest_eigenvalue(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 6)
    b[0] = 0
    eigenvalue = oracles.smallest_eigenvalue(b)

    closed = sra(b, epsilon=0)
    on_grid = sra(b, epsilon=1e-9, bins=720)

    assert closed.weight.sum(axis=0) == pytest.approx(-eigenvalue, rel=1e-9)
    # the grid leaves less choice, so it can only cost more
    ratio = on_grid.weight.sum(axis=0) / -eigenvalue
    assert np.all(ratio > 1 - 1e-6)
    assert np.all(ratio < 1 + 2 * (np.pi * m / 720) ** 2)


def test_the_program_keeps_to_the_tolerance_and_uses_it_up() -> None:
    b = oracles.random_moments(np.random.default_rng(5), 3, 5)
    for epsilon in (0.01, 0.05, 0.2):
        solve = program((1, 2, 3), bins=128, epsilon=epsilon)
        for c in b[1:].T:
            light = solve(c)

            assert light is not None
            assert light.min() >= 0
            v = np.concatenate([c.real, c.imag])
            left = np.abs(v - waves(3, 128) @ light).sum() / np.abs(v).sum()
            assert left == pytest.approx(epsilon, rel=1e-4)


def test_it_has_less_brightness_than_there_is_and_loses_a_weak_return() -> None:
    # Sec. 6.1: "a bias towards stronger sparsity and less overall brightness"
    phase, weight = np.array([1.5, 2.7, 4.2]), np.array([1.0, 0.5, 0.03])
    b = oracles.moments_of_returns(phase, weight, 3)

    exact, tolerant = sra(b, epsilon=0), sra(b, epsilon=0.05)

    assert np.allclose(exact.phase_rad, phase, atol=1e-6)
    assert (tolerant.weight > 0).sum() == 2
    assert tolerant.weight.sum() < 0.97 * weight.sum()


def test_its_tolerance_takes_up_noise() -> None:
    # Sec. 6.1: "successfully reduces the impact of noise"
    b = signals.noisy(signals.sparse(3, 23e6), ratio=70, draws=30, seed=2)

    tolerant, exact = sra(b), sra(b, epsilon=0)

    spread = [np.nanstd(each.first_phase_rad()) for each in (tolerant, exact)]
    assert spread[0] < 0.3 * spread[1]


def test_light_that_comes_back_around_zero_is_one_return() -> None:
    b = oracles.moments_of_returns(np.array([[0.01, 6.27]]), np.ones((1, 2)), 3)

    found = sra(b, bins=64)

    assert np.all((found.weight > 0).sum(axis=0) == 1)
    assert oracles.around(found.phase_rad[0] - [0.01, 6.27]).max() < np.pi / 64


def test_harmonics_may_come_in_any_order_and_with_gaps() -> None:
    phase, weight, multiples = np.array([0.7, 2.2]), np.array([1.0, 0.6]), np.array([3, 0, 10, 2])
    b = np.exp(1j * np.outer(multiples, phase)) @ weight
    b[1] = np.nan  # b_0 is not looked at

    found = sra(b, harmonics=multiples.tolist(), bins=512, epsilon=0.01)

    design = np.exp(1j * np.outer(multiples, np.nan_to_num(found.phase_rad)))
    left = (b - design @ found.weight)[multiples > 0]
    assert np.abs(left).sum() < 0.05 * np.abs(b[multiples > 0]).sum()
    assert found.weight.sum() <= weight.sum() + 1e-9


@pytest.mark.parametrize(
    ("arguments", "field"), [({"epsilon": -0.1}, "epsilon"), ({"bins": 6}, "bins")]
)
def test_arguments_that_it_cannot_work_with_are_refused(
    arguments: dict[str, float], field: str
) -> None:
    with pytest.raises(tm.ParameterError, match=field):
        sra(np.ones((4, 1)), **arguments)  # type: ignore[arg-type]  # by name
    with pytest.raises(tm.ParameterError, match=field):
        logarithmic(np.ones((4, 1)), **arguments)  # type: ignore[arg-type]  # by name


def test_the_table_says_what_the_program_says_at_its_nodes() -> None:
    # the unit vector of a node of the coarse table, as moments; a quarter turn leaves their 1-norm
    turn = np.pi / 2
    real, imag = sra_table_module._axis(5, 3**-0.5), sra_table_module._axis(5, 0.0)
    second, third = complex(real[1], imag[3]), complex(real[3], imag[2])
    first = np.sqrt(1 - abs(second) ** 2 - abs(third) ** 2)
    b = np.array([0, first, second, third]) * np.exp(1j * turn * np.arange(4)) * 7

    found, exact = sra_table(b, nodes=5), sra(b, bins=128)

    used = exact.weight >= 0.1 * exact.weight.max()
    from_middle = np.angle(np.exp(1j * (exact.phase_rad[used] - turn)))
    assert oracles.around(found.phase_rad[0] - turn - from_middle.min()) < 1e-6
    assert found.weight[0] == pytest.approx(exact.weight[used][from_middle.argmin()], rel=1e-6)


def test_the_table_is_closer_to_the_first_return_than_a_single_frequency() -> None:
    rng = np.random.default_rng(0)
    phase, weight = oracles.random_returns(rng, returns=2, pixels=200, apart_rad=0.8)
    phase, weight = 0.5 * phase, weight + np.array([[1.0], [0.0]])
    b = oracles.moments_of_returns(phase, weight, 3)

    error = oracles.around(sra_table(b, nodes=7).phase_rad[0] - phase[0])

    single = oracles.around(np.angle(b[1]) - phase[0])
    assert np.median(error) < 0.5 * np.median(single)


def test_the_table_refuses_an_even_number_of_nodes() -> None:
    with pytest.raises(tm.ParameterError, match="nodes"):
        sra_table(np.ones((4, 1)), nodes=4)


def test_each_step_of_the_logarithmic_prior_goes_down_and_the_first_is_the_1_norm() -> None:
    b = signals.continuous(4, 23e6)
    delta, bins = 0.05, 128
    scale = np.maximum(np.abs(b[1:].real), np.abs(b[1:].imag)).max()

    found = [logarithmic(b, delta=delta, steps=steps, bins=bins) for steps in (1, 2, 3, 4)]

    assert np.array_equal(found[0].weight, sra(b, bins=bins).weight)
    brightest = [each.weight.max() for each in found]
    assert brightest[-1] >= brightest[0]
    # the descent on the grid itself
    solve = program((1, 2, 3, 4), bins=bins, epsilon=0.05)
    c, costs, light = b[1:] / scale, [], solve(b[1:] / scale)
    for _ in range(4):
        assert light is not None
        costs.append(np.log(np.maximum(light, 0) + delta).sum())
        light = solve(c, delta / (np.maximum(light, 0) + delta))
    assert all(later <= earlier + 1e-6 for earlier, later in pairwise(costs))
    assert costs[-1] < costs[0]


def test_the_logarithmic_prior_gives_strong_returns_more_of_the_light() -> None:
    phase, weight = np.array([1.5, 2.7, 4.2]), np.array([1.0, 0.5, 0.2])
    b = oracles.moments_of_returns(phase, weight, 4)

    one_norm, logarithm = sra(b), logarithmic(b)

    assert logarithm.weight.max() >= one_norm.weight.max() - 1e-9
    assert (logarithm.weight > 0).sum() <= (one_norm.weight > 0).sum()


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"epsilon": 0.0, "harmonics": (1, 2, 3, 5)}, "epsilon"),
        ({"harmonics": (1, 2, 3, 33)}, "harmonics"),
        ({"bins": 20, "harmonics": (1, 2, 3, 10)}, "bins"),
    ],
)
def test_harmonics_that_it_cannot_work_with_are_refused(
    arguments: dict[str, object], field: str
) -> None:
    with pytest.raises(tm.ParameterError, match=field):
        sra(np.ones((4, 1)), **arguments)  # type: ignore[arg-type]  # by name
