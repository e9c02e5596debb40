"""Eigenvalue, coefficients and density in the hard cases."""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from _pytest.mark import ParameterSet
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.stability import exact
from tests.stability.cases import ORDERS, PRECISIONS, Signal, dense_signals, sparse_signals

# the shares of uniform light down to which the targets hold
MARGIN = {"float32": 4e-3, "float64": 1e-6}
BACKWARD = {"float32": 2e-5, "float64": 1e-12}


def cases(
    signals: Callable[[int], Iterator[Signal]],
    wanted: Callable[[int, str, Signal], bool] = lambda m, precision, signal: True,
) -> list[ParameterSet]:
    """All orders, precisions and signals of a kind."""
    return [
        pytest.param(m, precision, signal, id=f"m={m}-{precision}-{signal.name}")
        for m in ORDERS
        for precision in PRECISIONS
        for signal in signals(m)
        if wanted(m, precision, signal)
    ]


@cache
def share(m: int, precision: str, signal: Signal) -> float:
    """Smallest eigenvalue relative to b_0."""
    b = exact.rounded(signal.moments(m), PRECISIONS[precision])
    return float(tm.smallest_eigenvalue(b) / b[0].real)


def has_margin(m: int, precision: str, signal: Signal) -> bool:
    """Whether the targets hold for it."""
    return share(m, precision, signal) >= MARGIN[precision]


def is_definite(m: int, precision: str, signal: Signal) -> bool:
    """Whether there is more than rounding of a uniform part."""
    return share(m, precision, signal) >= 100 * float(np.finfo(PRECISIONS[precision]).eps)


def has_oracle(m: int, precision: str, signal: Signal) -> bool:
    """Whether the eigenvalue is known, or 60 digits of it don't take too long."""
    return len(signal.phase) <= m or m <= 8


@cache
def light_of_sparse_signals(m: int, precision: str) -> dict[str, NDArray[Any]]:
    """Return the light up to nine phases, of all signals at once, which takes as long as of one."""
    signals = list(sparse_signals(m))
    pixels = [exact.rounded(each.moments(m), PRECISIONS[precision]) for each in signals]
    light = tm.cumulative(tm.levinson(np.stack(pixels, axis=1)), np.linspace(0, 2 * np.pi, 9))
    return {each.name: light[:, at] for at, each in enumerate(signals)}


SPARSE = cases(sparse_signals)
WITH_MARGIN = cases(dense_signals, has_margin)


@pytest.mark.parametrize(("m", "precision", "signal"), [*cases(dense_signals, has_oracle), *SPARSE])
def test_the_smallest_eigenvalue_is_exact_to_a_few_digits_in_the_last_place(
    m: int, precision: str, signal: Signal
) -> None:
    dtype = PRECISIONS[precision]
    b = exact.rounded(signal.moments(m), dtype)
    known = len(signal.phase) <= m  # then it is the uniform part, up to rounding of the moments

    found = tm.smallest_eigenvalue(b)

    expected = float(signal.uniform if known else exact.smallest_eigenvalue(b))
    eps = float(np.finfo(dtype).eps)
    assert abs(float(found) - expected) <= (8 + 4 * m) * eps * float(b[0].real)


@pytest.mark.parametrize(("m", "precision", "signal"), WITH_MARGIN)
def test_reflection_coefficients_reproduce_the_moments(
    m: int, precision: str, signal: Signal
) -> None:
    b = exact.rounded(signal.moments(m), PRECISIONS[precision])

    coefficients = tm.levinson(b)

    # b_0 of the coefficients is E / prod (1 - |g|^2), evaluated exactly
    reflection = exact.exactly(coefficients.reflection)
    b0 = mp.mpf(float(coefficients.error))
    for g in reflection:
        b0 /= 1 - abs(g) ** 2
    again = exact.moments_of_reflection(b0, reflection)
    assert exact.distance(again, exact.exactly(b)) < BACKWARD[precision]


@pytest.mark.parametrize(("m", "precision", "signal"), WITH_MARGIN)
def test_polynomials_reproduce_the_moments_as_well_as_their_rounding_lets_them(
    m: int, precision: str, signal: Signal
) -> None:
    # A peak whose pole is d from the circle changes its light by eps / d when the polynomial is
    # rounded; no evaluation of Eq. (2) can be better than its coefficients.
    b = exact.rounded(signal.moments(m), PRECISIONS[precision])
    eps = float(np.finfo(b.dtype).eps)

    coefficients = tm.levinson(b)

    again = exact.moments_of_polynomial(
        mp.mpf(float(coefficients.error)), exact.exactly(coefficients.polynomial)
    )
    assert exact.distance(again, exact.exactly(b)) < 8 * eps * (1 + 1 / share(m, precision, signal))
    if precision == "float32":
        assert exact.distance(again, exact.exactly(b)) < BACKWARD[precision]


@pytest.mark.parametrize(("m", "precision", "signal"), cases(dense_signals, is_definite))
def test_coefficients_are_as_exact_as_their_condition_allows(
    m: int, precision: str, signal: Signal
) -> None:
    b = exact.rounded(signal.moments(m), PRECISIONS[precision])
    eps = float(np.finfo(b.dtype).eps)
    error, polynomial, _ = exact.levinson(exact.exactly(b))

    found = tm.levinson(b)

    size = max(abs(value) for value in polynomial)
    loss = 16 * (m + 1) * eps / share(m, precision, signal)
    assert abs(float(found.error) - float(error)) <= loss * float(b[0].real)
    for mine, theirs in zip(found.polynomial, polynomial, strict=True):
        assert abs(complex(mine) - complex(theirs)) <= loss * float(size)


@pytest.mark.parametrize(("m", "precision", "signal"), SPARSE)
def test_the_density_of_a_sparse_signal_is_finite_and_its_light_at_the_returns(
    m: int, precision: str, signal: Signal
) -> None:
    # no density has these moments: the pixel is flagged, and what it gets is the nearest one
    b = exact.rounded(signal.moments(m), PRECISIONS[precision])
    between = float(signal.phase[0]) + 0.5 / m

    c = tm.levinson(b)
    h = tm.density(c, np.array([*signal.phase, between], float))
    light = light_of_sparse_signals(m, precision)[signal.name]

    if signal.uniform == 0:
        assert tm.flags(b) == tm.Flags.DEGENERATE
    assert np.isfinite(h).all()
    assert np.isfinite(light).all()
    assert h[0] >= h[-1] >= 0
    assert light[-1] == pytest.approx(float(b[0].real), rel=1e-4)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("m", ORDERS)
def test_contradicting_moments_have_the_eigenvalue_of_the_closed_form(
    m: int, precision: str
) -> None:
    # b_0 = b_1 and nothing else: tridiagonal, lambda = b_0 - 2 |b_1| cos(pi / (m + 2))
    dtype = PRECISIONS[precision]
    b: np.ndarray = np.zeros(m + 1, dtype)
    b[0], b[1] = 1, np.exp(1j)
    eps = float(np.finfo(dtype).eps)
    expected = 1 - 2 * abs(complex(b[1])) * np.cos(np.pi / (m + 2))

    assert float(tm.smallest_eigenvalue(b)) == pytest.approx(expected, abs=(8 + 4 * m) * eps)
    assert tm.flags(b) == tm.Flags.DEGENERATE
    moments, biased = tm.bias(b)
    assert biased
    assert tm.flags(moments) == tm.Flags.VALID
    c, returns = tm.levinson(moments), tm.pisarenko(b)
    assert np.isfinite(c.error)
    assert np.all(np.abs(c.reflection) < 1)
    assert returns.uniform == pytest.approx(expected, abs=(8 + 4 * m) * eps)
    assert returns.weight.sum() == pytest.approx(1 - expected, rel=1e-5)


@pytest.mark.parametrize("factor", [0.5, 1.5])
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("m", ORDERS)
def test_a_wrong_zeroth_moment_shifts_the_uniform_part_only(
    m: int, precision: str, factor: float
) -> None:
    signal = next(s for s in sparse_signals(m) if s.name == "m returns")
    b = exact.rounded(signal.moments(m), PRECISIONS[precision])
    wrong: np.ndarray = b.copy()
    wrong[0] *= factor
    eps = float(np.finfo(b.dtype).eps)

    right, found = tm.pisarenko(b), tm.pisarenko(wrong)

    shift = float(wrong[0].real) - float(b[0].real)
    assert found.uniform == pytest.approx(shift, abs=(16 + 8 * m) * eps * float(b[0].real))
    condition_phase, condition_weight = exact.conditions(signal.phase, signal.weight, m)
    if found.count == right.count == m:
        assert np.abs(found.phase_rad - right.phase_rad).max() < 99 * eps * max(condition_phase)
        relative = np.abs(found.weight / right.weight - 1)
        assert relative.max() < 99 * eps * max(condition_weight)


@pytest.mark.parametrize("m", ORDERS)
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("exponent", [-45, -40, -37, -30, 30])
def test_scale_changes_nothing_but_scale(m: int, precision: str, exponent: int) -> None:
    dtype = PRECISIONS[precision]
    signal = next(s for s in dense_signals(m) if s.name == "m returns, uniform 0.3")
    plain = signal.moments(m)
    if precision == "float64":
        exponent *= 7  # 1e-315 is subnormal, 1e210 far up
    scale = mp.mpf(10) ** exponent / plain[0]
    scaled = exact.rounded([value * scale for value in plain], dtype)
    exact_scaled = exact.exactly(scaled)  # subnormal moments have fewer digits as they come
    if abs(exact_scaled[0]) == 0:
        assert tm.flags(scaled) == tm.Flags.NO_SIGNAL
        return
    relative = exact.rounded([value / exact_scaled[0] for value in exact_scaled], np.complex128)

    found, expected = tm.pisarenko(scaled), tm.pisarenko(relative)
    c, c_expected = tm.levinson(scaled), tm.levinson(relative)

    eps = float(np.finfo(dtype).eps)
    tiny = float(np.finfo(dtype).smallest_subnormal) / float(scaled[0].real)
    slack = 3e3 * eps + m * tiny
    if tm.flags(relative) == tm.Flags.VALID and tiny < 1e-3:
        assert tm.flags(scaled) == tm.Flags.VALID
        assert np.abs(c.reflection - c_expected.reflection).max() < slack
    assert float(found.uniform / scaled[0].real) == pytest.approx(
        float(expected.uniform), abs=slack
    )
    assert np.isfinite(found.weight).all()
    if tiny < eps:
        assert np.nanmax(np.abs(found.phase_rad - expected.phase_rad)) < 40 * slack
