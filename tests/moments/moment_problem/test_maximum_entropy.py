"""The density of Eq. (2)."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

import transientcam_moments as tm
from tests.moments import oracles

PHASE = np.linspace(0, 2 * np.pi, 4096, endpoint=False)


@pytest.mark.parametrize("evaluation", ["modulus", "fourier"])
@pytest.mark.parametrize("m", [1, 2, 3, 4, 8, 16, 32])
def test_density_is_equation_2(m: int, evaluation: str) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 20)

    h = tm.density(tm.levinson(b), PHASE, evaluation=evaluation)

    assert h.shape == (4096, 20)
    assert np.allclose(h, oracles.density(b, PHASE), rtol=1e-6)


@pytest.mark.parametrize("m", [1, 3, 8])
def test_density_has_the_moments_it_was_made_from(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 20)
    phase = np.linspace(0, 2 * np.pi, 1 << 15, endpoint=False)

    h = tm.density(tm.levinson(b), phase)

    assert np.all(h > 0)
    assert np.allclose(oracles.moments_of_density(h, phase, m), b, atol=1e-8 * np.abs(b).max())


def test_no_other_density_with_these_moments_has_less_burg_entropy() -> None:
    b = np.array([1.0, 0.5 + 0.3j, 0.2j])
    phase = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    h = tm.density(tm.levinson(b), phase)
    rows = np.exp(1j * np.outer(np.arange(3), phase)) * 2 * np.pi / 64
    rows = np.concatenate([rows.real, rows[1:].imag])
    right = rows @ h

    found = minimize(
        lambda x: -np.log(np.maximum(x, 1e-12)).sum(),
        np.full(64, 1 / (2 * np.pi)),
        jac=lambda x: -1 / np.maximum(x, 1e-12),
        bounds=[(1e-6, None)] * 64,
        constraints={"type": "eq", "fun": lambda x: rows @ x - right, "jac": lambda x: rows},
        options={"maxiter": 500, "ftol": 1e-12},
    )

    assert found.success
    assert np.abs(found.x - h).max() < 1e-3


def test_single_precision_stays_single_and_close() -> None:
    b = oracles.random_moments(np.random.default_rng(0), 3, 20)

    h = tm.density(tm.levinson(b.astype(np.complex64)), PHASE)

    assert h.dtype == np.float32
    assert np.allclose(h, oracles.density(b, PHASE), rtol=2e-3)


def test_a_pole_at_the_border_gives_a_high_but_finite_peak() -> None:
    one_return = np.ones((4, 1), dtype=np.complex64)

    h = tm.density(tm.levinson(one_return), [0.0, 1.0])

    assert np.isfinite(h).all()
    assert h[0] > 1e5
    assert h[1] < 1e-5


def test_phases_may_be_a_number_or_beyond_a_turn() -> None:
    c = tm.levinson(np.array([1.0, 0.5j]))

    assert tm.density(c, 1.0).shape == (1,)
    assert tm.density(c, 1.0) == pytest.approx(tm.density(c, 1.0 - 4 * np.pi))
    assert tm.density(c, np.arange(3)).shape == (3,)  # integers are phases too
    assert tm.density(c, []).shape == (0,)


def test_a_dark_pixel_is_zero_and_an_invalid_one_nan() -> None:
    b = np.array([[0, np.nan, 1.0], [0, 0, 0]], complex)

    h = tm.density(tm.levinson(b), PHASE[:5])

    assert np.all(h[:, 0] == 0)
    assert np.isnan(h[:, 1]).all()
    assert np.allclose(h[:, 2], 1 / (2 * np.pi))


def test_many_phases_of_many_pixels_are_the_same_as_few() -> None:
    c = tm.levinson(oracles.random_moments(np.random.default_rng(0), 2, 3000))

    assert np.allclose(tm.density(c, PHASE[:300])[17], tm.density(c, PHASE[17])[0], rtol=1e-12)


def test_wrong_arguments_are_refused() -> None:
    c = tm.levinson(np.array([1.0, 0.5]))
    with pytest.raises(tm.ParameterError, match=r"evaluation = 'horner'.*modulus, fourier"):
        tm.density(c, 0.0, evaluation="horner")
    with pytest.raises(tm.ShapeError, match="phase_rad"):
        tm.density(c, np.zeros((2, 2)))
    with pytest.raises(tm.ShapeError, match="complex128"):
        tm.density(c, np.zeros(2, complex))


@pytest.mark.data
@pytest.mark.parametrize(("m", "expected_ns"), [(3, (3.18, 9.73, 22.22)), (4, (3.07, 9.31, 21.68))])
@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_peaks_of_three_measured_impulse_responses(
    data_dir: Path, m: int, expected_ns: tuple[float, ...], dtype: type
) -> None:
    frequency_hz = 23e6
    b: np.ndarray = composite(data_dir, m, frequency_hz).astype(dtype)

    found = tm.peaks(tm.levinson(b), threshold=0.0)

    time_ns = found.phase_rad[:3] / (2 * np.pi * frequency_hz) * 1e9
    assert np.abs(time_ns - expected_ns).max() < 0.05


def composite(data_dir: Path, m: int, frequency_hz: float) -> np.ndarray:
    """0.55 direct at 3 ns + 0.30 one inch of foam at 9 ns + 0.5 three inches at 20 ns."""
    total = np.zeros(m + 1, complex)
    origin_s = None
    for name, weight, delay_s in (
        ("direct", 0.55, 3e-9),
        ("1_0_inch", 0.30, 9e-9),
        ("3_0_inch", 0.50, 20e-9),
    ):
        data = np.load(data_dir / "measured" / f"capture_{name}.npz")
        counts = data["counts"].astype(float)
        counts = np.maximum(counts - np.median(counts), 0)  # the median is the background
        time_s = np.arange(counts.size) * float(data["bin_s"])
        if origin_s is None:
            origin_s = time_s[counts.argmax()]  # time zero is the peak of the direct response
        phase = 2 * np.pi * frequency_hz * (time_s - origin_s + delay_s)
        response = np.exp(1j * np.outer(np.arange(m + 1), phase)) @ counts
        total += weight * response / counts.sum()
    return total
