"""Sharp returns."""

from typing import Any

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_moments.moment_problem import circle, toeplitz

ORDERS = [1, 2, 3, 4, 8, 16, 32]


def reproduced(returns: tm.Returns, m: int) -> np.ndarray:
    """The moments that returns and a uniform part have."""
    b = oracles.moments_of_returns(np.nan_to_num(returns.phase_rad), returns.weight, m)
    b[0] += returns.uniform
    return b


@pytest.mark.parametrize("m", ORDERS)
def test_m_returns_are_recovered_from_m_moments(m: int) -> None:
    rng = np.random.default_rng(m)
    phase, weight = oracles.random_returns(rng, returns=m, pixels=100, apart_rad=4.5 / m)
    b = oracles.moments_of_returns(phase, weight, m)

    found = tm.pisarenko(b)

    assert np.all(found.count == m)
    assert oracles.around(found.phase_rad - phase).max() < 1e-9
    assert np.abs(found.weight / weight - 1).max() < 1e-8
    assert np.abs(found.uniform).max() < 1e-13 * b[0].real.max()


@pytest.mark.parametrize("m", [2, 3, 4, 8, 32])
def test_fewer_returns_than_moments_are_counted(m: int) -> None:
    rng = np.random.default_rng(m)
    for returns in {1, 2, min(m - 1, 8)}:
        phase, weight = oracles.random_returns(rng, returns=returns, pixels=40, apart_rad=4 / m)
        found = tm.pisarenko(oracles.moments_of_returns(phase, weight, m))

        # rounding may leave a return too faint to matter
        real = found.weight > 1e-9 * weight.sum(axis=0)
        assert np.all(real.sum(axis=0) == returns)
        assert np.mean(found.count == returns) > 0.8
        for pixel in range(40):
            kept = real[:, pixel]
            found_phase = found.phase_rad[kept, pixel]
            assert oracles.around(found_phase - phase[:, pixel]).max() < 1e-9
            assert np.abs(found.weight[kept, pixel] / weight[:, pixel] - 1).max() < 1e-7
        assert np.array_equal(found.weight > 0, np.isfinite(found.phase_rad))


@pytest.mark.parametrize("m", ORDERS)
@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("noise", [0.0, 0.05, 0.5])
def test_any_moments_are_explained_with_positive_weights(m: int, dtype: type, noise: float) -> None:
    b: np.ndarray = oracles.random_moments(np.random.default_rng(m), m, 200, noise=noise)
    b = b.astype(dtype)

    found = tm.pisarenko(b)

    eps = np.finfo(dtype).eps
    error = np.abs(reproduced(found, m) - b).max(axis=0) / np.abs(b).max(axis=0)
    assert error.max() < 40 * (m + 1) * eps
    assert np.all(found.weight >= 0)
    assert np.all(np.diff(np.where(found.weight > 0, found.phase_rad, 7), axis=0) >= 0)
    assert np.nanmin(found.phase_rad) >= 0
    assert np.nanmax(found.phase_rad) < np.finfo(dtype).dtype.type(2 * np.pi)
    assert np.array_equal(found.count, (found.weight > 0).sum(axis=0))
    assert found.phase_rad.dtype == found.weight.dtype == np.finfo(dtype).dtype


@pytest.mark.parametrize("m", [1, 2, 3, 4, 8])
def test_returns_are_those_of_eigenvector_and_companion_roots(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 30)

    found = tm.pisarenko(b)

    values, vectors = np.linalg.eigh(oracles.toeplitz(b))
    assert np.allclose(found.uniform, values[:, 0], atol=1e-12 * b[0].real.max())
    for pixel in range(30):
        # Theorem 2: roots of c* s(phi), weights from the linear system (4)
        phase = np.sort(np.angle(np.roots(vectors[pixel, :, 0].conj()[::-1])) % (2 * np.pi))
        sparse = b[:, pixel] - np.eye(m + 1)[0] * values[pixel, 0]
        weight = np.linalg.lstsq(np.exp(1j * np.outer(np.arange(m + 1), phase)), sparse)[0]
        assert oracles.around(found.phase_rad[:, pixel] - phase).max() < 1e-8
        assert np.allclose(found.weight[:, pixel], weight.real, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_the_uniform_part_is_separated_from_the_returns(dtype: type) -> None:
    phase, weight = np.array([[0.5], [2.0]]), np.array([[3.0], [1.0]])
    b = oracles.moments_of_returns(phase, weight, 2)
    b[0] += 0.25

    found = tm.pisarenko(b.astype(dtype))

    tolerance = 100 * float(np.finfo(dtype).eps)
    assert found.uniform == pytest.approx(0.25, abs=tolerance)
    assert np.abs(found.phase_rad - phase).max() < tolerance
    assert np.abs(found.weight - weight).max() < tolerance


def test_returns_at_the_ends_of_the_turn_stay_there() -> None:
    phase = np.array([[0.0], [3.0], [2 * np.pi - 1e-6]])
    b = oracles.moments_of_returns(phase, np.ones((3, 1)), 3)

    found = tm.pisarenko(b)

    # two returns 1e-6 rad apart across phase 0 are one to double precision
    assert found.count[0] in (2, 3)
    assert oracles.around(found.phase_rad[np.argmax(found.weight[:, 0])]) < 1e-4
    assert found.weight.sum() == pytest.approx(3)
    assert np.nanmax(found.phase_rad) < 2 * np.pi


def test_a_pure_uniform_signal_has_no_returns() -> None:
    found = tm.pisarenko(np.array([5.0, 0, 0, 0]))

    assert found.count == 0
    assert found.uniform == 5
    assert np.all(found.weight == 0)
    assert np.isnan(found.phase_rad).all()


def test_contradicting_moments_have_a_negative_uniform_part() -> None:
    found = tm.pisarenko(np.array([1.0, 2.0]))

    assert found.uniform == pytest.approx(-1)
    assert found.weight[0] == pytest.approx(2)
    assert found.phase_rad[0] == 0


def test_dark_and_invalid_pixels_have_no_returns_and_disturb_no_others() -> None:
    b = np.array([[1, 0, np.nan, 1, np.inf], [0.5, 0, 0.1, np.inf, 0]], complex)

    found = tm.pisarenko(b)

    assert found.count.tolist() == [1, 0, 0, 0, 0]
    assert np.all(found.weight[0, 1:] == 0)
    assert found.uniform[0] == pytest.approx(0.5)
    assert found.uniform[1] == 0
    assert np.isnan(found.uniform[2:]).all()


def test_single_precision_pixels_that_need_double_get_it() -> None:
    # 0.01 rad apart: E_1 is about 2e-5, of which single precision knows two digits
    phase = np.array([[1.0], [1.01]]) + np.linspace(0, 5, 400)
    weight = np.array([[1.0], [0.7]]) * np.ones(400)
    b = oracles.moments_of_returns(phase, weight, 2).astype(np.complex64)

    single = tm.pisarenko(b)

    error = np.abs(reproduced(single, 2) - b).max(axis=0) / b[0].real
    assert single.phase_rad.dtype == np.float32
    assert error.max() < 50 * np.finfo(np.float32).eps


def test_a_known_eigenvalue_is_not_searched_for_again() -> None:
    b = oracles.random_moments(np.random.default_rng(7), 3, 50, noise=0.1)
    b[:, 3] = 0

    reported, found = tm.pisarenko(b, eigenvalue=tm.smallest_eigenvalue(b)), tm.pisarenko(b)

    assert np.allclose(reported.phase_rad, found.phase_rad, equal_nan=True, atol=1e-9)
    assert np.allclose(reported.uniform, found.uniform)


def test_weights_are_quadratic_forms_of_the_inverse_of_the_leading_block() -> None:
    b = oracles.random_moments(np.random.default_rng(7), 3, 1)[:, 0]
    b /= b[0].real
    order = (0,) * 3
    room: list[Any] = [np.zeros(1) for _ in range(4)]
    re: list[Any] = [np.array([x]) for x in b.real]
    im: list[Any] = [np.array([x]) for x in b.imag]
    ar, ai, gr, gi, inverse = (list(room) for _ in range(5))
    toeplitz.singular(order, re, im, room[0], ar, ai, gr, gi, inverse)
    phi = 1.234
    s = np.exp(1j * np.arange(3) * phi)
    block = oracles.toeplitz(b[:3, None])[0]

    x: Any = np.array([np.cos(phi / 2)])
    y: Any = np.array([np.sin(phi / 2)])
    found: Any = circle.weigh(order, gr, gi, inverse, x, y)[0]

    assert 1 / found[0] == pytest.approx((s.conj() @ np.linalg.solve(block, s)).real)


@pytest.mark.parametrize("m", [1, 2, 3, 8])
def test_a_corrected_half_angle_has_the_square_of_the_error(m: int) -> None:
    phase, weight = oracles.random_returns(
        np.random.default_rng(m), returns=m, pixels=20, apart_rad=4 / m
    )
    b = oracles.moments_of_returns(phase, weight, m)
    b /= b[0].real
    order = (0,) * m
    room: list[Any] = [np.zeros(20) for _ in range(m + 1)]
    floor: Any = np.full(20, 1e-12)
    ar, ai, gr, gi, inverse = (list(room) for _ in range(5))
    toeplitz.singular(order, list(b.real), list(b.imag), floor, ar, ai, gr, gi, inverse)

    for true in phase:
        x: Any = np.cos(true / 2 + 1e-5)
        y: Any = np.sin(true / 2 + 1e-5)
        _, x, y = circle.weigh(order, gr, gi, inverse, x, y)
        found: Any = circle.phase_of(*circle.doubled(x, y))
        error = oracles.around(found - true).max()
        assert error < 2 * (m * 2e-5) ** 2


def test_direct_light_is_the_first_return_above_the_threshold() -> None:
    returns = tm.Returns(
        phase_rad=np.array([[0.5, 1.0, np.nan], [1.5, 2.0, np.nan], [3.0, np.nan, np.nan]]),
        weight=np.array([[0.2, 4.0, 0.0], [1.0, 1.0, 0.0], [3.0, 0.0, 0.0]]),
        uniform=np.zeros(3),
        count=np.array([3, 2, 0]),
    )

    direct, indirect, phase = tm.separate(returns, 0.1)

    assert direct.tolist() == [1.0, 4.0, 0.0]
    assert np.allclose(indirect, [3.2, 1.0, 0.0])
    assert phase[:2].tolist() == [1.5, 1.0]
    assert np.isnan(phase[2])
    assert tm.separate(returns, 0.0).direct.tolist() == [0.2, 4.0, 0.0]
    assert tm.separate(returns, 1.0).direct.tolist() == [3.0, 4.0, 0.0]


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(tm.ShapeError):
        tm.pisarenko(np.ones((40, 2)))
    with pytest.raises(tm.ParameterError, match=r"threshold = 1.5"):
        tm.separate(tm.pisarenko(np.array([1.0, 0.5])), 1.5)
