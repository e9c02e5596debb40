"""Sharp returns in the hard cases of sparse signals."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles
from tests.stability import exact
from tests.stability.cases import ORDERS, PRECISIONS, Signal, sparse_signals

CASES = [
    pytest.param(m, precision, signal, id=f"m={m}-{precision}-{signal.name}")
    for m in ORDERS
    for precision in PRECISIONS
    for signal in sparse_signals(m)
]

# Digits that the algorithm may lose beyond those that rounding the moments loses
LOSS = 64


@pytest.mark.parametrize(("m", "precision", "signal"), CASES)
def test_returns_are_as_exact_as_their_condition_allows(
    m: int, precision: str, signal: Signal
) -> None:
    dtype = PRECISIONS[precision]
    eps = float(np.finfo(dtype).eps)
    b = exact.rounded(signal.moments(m), dtype)

    found = tm.pisarenko(b)

    phase, weight = np.array(signal.phase, float), np.array(signal.weight, float)
    # r returns are found in b_0 .. b_r: the smallest singular leading block (Sec. 5.1)
    condition_phase, condition_weight = exact.conditions(signal.phase, signal.weight, len(phase))
    resolved = max(condition_weight) * eps < 0.05
    if not resolved:  # to this precision the returns are one; what it stands for must be right
        assert found.weight.sum() == pytest.approx(weight.sum(), rel=1e-3)
    else:
        kept = found.weight > 0.3 * weight.min()
        order = np.argsort(phase)
        error = oracles.around(np.sort(found.phase_rad[kept]) - phase[order])
        assert np.all(error <= LOSS * eps * (1 + np.array(condition_phase)[order]))
        relative = np.abs(found.weight[kept] / weight[order] - 1)
        assert np.all(relative <= LOSS * eps * (1 + np.array(condition_weight)[order]))
    # whatever the condition: the returns have the moments they were found from
    again = oracles.moments_of_returns(np.nan_to_num(found.phase_rad), found.weight, m)
    again[0] += found.uniform
    factor = 64 if m <= 8 else 256
    assert np.abs(again - b).max() <= factor * (m + 1) * eps * b[0].real
    assert found.uniform == pytest.approx(float(signal.uniform), abs=64 * (m + 1) * eps)


@pytest.mark.parametrize("m", [1, 2, 3, 4])
def test_returns_005_rad_apart_meet_the_target_in_double_precision(m: int) -> None:
    # phase error < 1e-9, relative weight error < 1e-8 for the sparse cases of m <= 4
    rng = np.random.default_rng(m)
    phase, weight = oracles.random_returns(rng, returns=m, pixels=4000, apart_rad=0.05)
    b = oracles.moments_of_returns(phase, weight, m)

    found = tm.pisarenko(b)

    assert np.all(found.count == m)
    phase_error = oracles.around(found.phase_rad - phase).max(axis=0)
    weight_error = np.abs(found.weight / weight - 1).max(axis=0)
    # where more than two returns are close together, double precision itself has fewer digits
    nearest = np.sort(oracles.around(np.diff(phase, axis=0, append=phase[:1])), axis=0)
    crowded = nearest[:2].sum(axis=0) < 0.4 if m > 2 else np.zeros(4000, bool)
    assert crowded.mean() < 0.15
    assert phase_error[~crowded].max() < 1e-9
    assert weight_error[~crowded].max() < 1e-8


def worst_residual(b: np.ndarray) -> np.ndarray:
    """What the returns leave of moments, over b_0 (P)."""
    found = tm.pisarenko(b)
    m = len(b) - 1
    again = oracles.moments_of_returns(np.nan_to_num(found.phase_rad), found.weight, m)
    again[0] += found.uniform
    left: np.ndarray = np.abs(again - b).max(axis=0) / b[0].real
    return left


@pytest.mark.parametrize("apart_rad", [1e-4, 1e-5, 1e-6, 1e-7])
@pytest.mark.parametrize("m", [3, 8])
def test_pairs_closer_than_1e_4_rad_keep_their_moments(m: int, apart_rad: float) -> None:
    rng = np.random.default_rng(m)
    phase = rng.uniform(0, 2 * np.pi, (1, 300)) + np.array([[0.0], [apart_rad]])
    weight = rng.uniform(0.2, 1, phase.shape)
    b = oracles.moments_of_returns(phase, weight, m)

    assert worst_residual(b).max() < 64 * (m + 1) * np.finfo(float).eps


def test_random_returns_of_order_8_keep_their_moments() -> None:
    """No distance kept: among 1500 pixels of eight returns many have some close together."""
    rng = np.random.default_rng(8)
    phase, weight = rng.uniform(0, 2 * np.pi, (8, 1500)), rng.uniform(0.05, 1, (8, 1500))
    b = oracles.moments_of_returns(phase, weight, 8)

    eps = np.finfo(float).eps
    assert np.mean(worst_residual(b) > 64 * 9 * eps) < 0.005  # was 2.7 %
    assert worst_residual(b).max() < 512 * 9 * eps


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("m", ORDERS)
def test_equal_smallest_eigenvalues_mean_fewer_returns(m: int, precision: str) -> None:
    # m + 1 equally strong returns at equal distances: all eigenvalues are the same, as if uniform
    dtype = PRECISIONS[precision]
    b: np.ndarray = np.zeros(m + 1, dtype)
    b[0] = m + 1

    found = tm.pisarenko(b)

    assert found.count == 0
    assert found.uniform == pytest.approx(m + 1)
