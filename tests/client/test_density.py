"""Eq. (2) and reflection coefficients, from streamed coefficients, against dense solves."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import trapezoid
from scipy.linalg import toeplitz

import transientcam
from tests.client.conftest import frame_meta
from transientcam.density import step_down, step_up
from transientcam.errors import ParameterError

_FREQUENCY_HZ = 23e6


def _moments(
    phases_rad: NDArray[Any], weights: NDArray[Any], *, uniform: float, harmonics: int
) -> NDArray[Any]:
    """Return b_0 to b_m of some returns over a uniform part: sum_k w_k exp(i j phi_k)."""
    powers = np.arange(harmonics + 1)[:, None]
    moments = np.asarray((np.exp(1j * powers * phases_rad) * weights).sum(axis=1))
    moments[0] += uniform
    return moments


def _coefficients(moments: NDArray[Any]) -> NDArray[Any]:
    """Return E, Re a_1, Im a_1, ... from a dense solve: B^-1 e_0 = a / E with a_0 = 1."""
    B = toeplitz(moments, moments.conj())
    solution = np.linalg.solve(B, np.eye(len(moments))[0])
    a = solution / solution[0]
    parts = np.stack((a.real, a.imag), axis=-1).reshape(-1)[2:]
    return np.concatenate(([1.0 / solution[0].real], parts))


def _dense_density(moments: NDArray[Any], phase_rad: NDArray[Any]) -> NDArray[Any]:
    """Theorem 1 as it stands: h = e_0* B^-1 e_0 / (2 pi |e_0* B^-1 s(phi)|^2)."""
    m = len(moments) - 1
    inverse = np.linalg.inv(toeplitz(moments, moments.conj()))
    s = np.exp(1j * np.arange(m + 1)[:, None] * phase_rad)
    return np.asarray(inverse[0, 0].real / (2 * np.pi * np.abs(inverse[0] @ s) ** 2))


_PHASES_RAD = np.linspace(0.0, 2.0 * np.pi, 500, endpoint=False)


@pytest.mark.parametrize("harmonics", [1, 2, 3, 4, 8])
def test_the_density_is_that_of_a_dense_solve(harmonics: int) -> None:
    moments = _moments(np.array([0.7, 2.9]), np.array([3.0, 1.0]), uniform=0.4, harmonics=harmonics)

    density = transientcam.density(_coefficients(moments), _PHASES_RAD)

    np.testing.assert_allclose(density, _dense_density(moments, _PHASES_RAD), rtol=1e-8)


def test_the_density_holds_all_the_light_and_has_the_moments_it_was_made_of() -> None:
    moments = _moments(np.array([1.0, 4.0]), np.array([3.0, 1.0]), uniform=0.5, harmonics=3)
    phase_rad = np.linspace(0.0, 2.0 * np.pi, 20001)

    density = transientcam.density(_coefficients(moments), phase_rad)

    for j, moment in enumerate(moments):
        # periodic, so the trapezoidal rule converges faster than any power of the step
        assert trapezoid(density * np.exp(1j * j * phase_rad), phase_rad) == pytest.approx(moment)


def test_a_pixel_without_modulation_is_uniform() -> None:
    coefficients = np.array([5.0, 0.0, 0.0, 0.0, 0.0])

    density = transientcam.density(coefficients, np.array([0.0, 1.0, 6.0]))

    np.testing.assert_allclose(density, 5.0 / (2.0 * np.pi))


def test_pixels_stay_where_they_are_and_do_not_touch_each_other() -> None:
    pixels = [
        _coefficients(_moments(np.array([0.5 + k]), np.array([2.0]), uniform=0.3, harmonics=3))
        for k in range(6)
    ]
    planes = np.stack(pixels, axis=-1).reshape(7, 2, 3)
    planes[:, 1, 1] = np.nan

    density = transientcam.density(planes, _PHASES_RAD)

    assert density.shape == (500, 2, 3)
    for k, pixel in enumerate(pixels):
        y, x = divmod(k, 3)
        expected = np.full(500, np.nan) if k == 4 else transientcam.density(pixel, _PHASES_RAD)
        np.testing.assert_allclose(density[:, y, x], expected, rtol=1e-12)


def test_a_single_phase_gives_an_image_and_a_grid_of_phases_a_grid_of_images() -> None:
    planes = np.zeros((3, 4, 5))
    planes[0] = 1.0

    assert transientcam.density(planes, 0.5).shape == (4, 5)
    assert transientcam.density(planes, np.zeros((2, 3))).shape == (2, 3, 4, 5)
    assert transientcam.density(planes, np.zeros(0)).shape == (0, 4, 5)


def test_streamed_precision_is_kept_and_enough() -> None:
    moments = _moments(np.array([0.7, 2.9]), np.array([3.0, 1.0]), uniform=0.02, harmonics=4)
    exact = _dense_density(moments, _PHASES_RAD)

    density = transientcam.density(_coefficients(moments).astype(np.float32), _PHASES_RAD)

    assert density.dtype == np.float32
    assert np.abs(density - exact).max() < 1e-4 * exact.max()


def test_a_dark_pixel_is_dark_and_no_warning() -> None:
    np.testing.assert_array_equal(transientcam.density(np.zeros(5, np.float32), [0.0, 1.0]), 0.0)


def test_a_transient_is_the_density_per_second() -> None:
    coefficients = _coefficients(
        _moments(np.array([1.0]), np.array([2.0]), uniform=0.1, harmonics=3)
    )
    time_s = np.array([0.0, 10e-9, 30e-9])

    transient = transientcam.transient(coefficients, time_s, base_frequency_hz=_FREQUENCY_HZ)

    angular_rad_s = 2.0 * np.pi * _FREQUENCY_HZ
    expected = angular_rad_s * transientcam.density(coefficients, angular_rad_s * time_s)
    np.testing.assert_allclose(transient, expected)


def test_a_transient_repeats_after_the_unambiguous_time_however_often() -> None:
    coefficients = _coefficients(
        _moments(np.array([1.0]), np.array([2.0]), uniform=0.1, harmonics=3)
    )
    period_s = 2.0**-25
    time_s = np.arange(8) * 2.0**-28

    first, later = (
        transientcam.transient(coefficients, time_s + turns * period_s, base_frequency_hz=2.0**25)
        for turns in (0, -1_000_000)
    )

    np.testing.assert_array_equal(first, later)


def test_a_frame_is_taken_for_its_array() -> None:
    frame = transientcam.Frame(
        "coefficients", "DN,1", ("coefficient", "y", "x"), frame_meta(frame=1), np.ones((3, 1, 1))
    )

    np.testing.assert_array_equal(
        transientcam.density(frame, 0.3), transientcam.density(frame.array, 0.3)
    )


@pytest.mark.parametrize(
    ("coefficients", "limit"),
    [
        (np.zeros(4), r"\(2m \+ 1"),
        (np.float64(1.0), r"\(2m \+ 1"),
        (np.zeros(3, complex), "real"),
        (np.array(["a"]), "real"),
    ],
)
def test_what_are_no_coefficients_are_refused(coefficients: Any, limit: str) -> None:
    with pytest.raises(ParameterError, match=f"coefficients is .*{limit}"):
        transientcam.density(coefficients, 0.0)


@pytest.mark.parametrize("frequency_hz", [0.0, -1.0, float("nan"), float("inf")])
def test_what_is_no_frequency_is_refused(frequency_hz: float) -> None:
    with pytest.raises(ParameterError, match="base_frequency_hz is"):
        transientcam.transient(np.ones(3), 0.0, base_frequency_hz=frequency_hz)


def _drawn_moments(harmonics: int, seed: int) -> NDArray[Any]:
    """Return b_0 to b_m of three returns over a uniform part: their Toeplitz matrix is positive."""
    draw = np.random.default_rng(seed)
    phases_rad, weights = draw.uniform(0.0, 2.0 * np.pi, 3), draw.uniform(0.2, 2.0, 3)
    uniform = draw.uniform(0.02, 1.0)
    return _moments(phases_rad, weights, uniform=uniform, harmonics=harmonics)


@pytest.mark.parametrize("harmonics", [1, 2, 3, 4, 8])
def test_brightness_and_reflections_are_those_of_the_leading_blocks(harmonics: int) -> None:
    moments = _drawn_moments(harmonics, seed=harmonics)

    brightness, reflection = step_down(_coefficients(moments))

    # g_k is the last coefficient of the solution of order k
    for k in range(1, harmonics + 1):
        last = _coefficients(moments[: k + 1])[-2:]
        assert reflection[k - 1] == pytest.approx(complex(*last), abs=1e-9)
    assert brightness == pytest.approx(moments[0].real, rel=1e-9)


@pytest.mark.parametrize("harmonics", [1, 2, 3, 4, 8, 32])
def test_stepping_up_undoes_stepping_down(harmonics: int) -> None:
    planes = np.stack([_coefficients(_drawn_moments(harmonics, seed)) for seed in range(7)], axis=1)

    again = step_up(*step_down(planes))

    np.testing.assert_allclose(again, planes, rtol=1e-7, atol=1e-7)


def test_pixels_without_a_value_stay_so_and_disturb_no_other() -> None:
    planes = np.stack([_coefficients(_drawn_moments(4, seed)) for seed in range(3)], axis=1)
    corrupt = planes.copy()
    corrupt[:, 1] = np.nan

    again = step_up(*step_down(corrupt))

    assert np.isnan(again[:, 1]).all()
    np.testing.assert_allclose(again[:, [0, 2]], planes[:, [0, 2]], rtol=1e-9, atol=1e-12)


def test_a_pixel_without_light_has_no_reflection() -> None:
    brightness, reflection = step_down(np.zeros((9, 1)))

    assert brightness == [0.0]
    assert not reflection.any()
