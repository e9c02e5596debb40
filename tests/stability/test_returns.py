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
    # the factor depends on the processor's arithmetic: 64 holds on some, 124 was seen on another
    assert np.abs(again - b).max() <= 256 * (m + 1) * eps * b[0].real
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
