"""Reflection coefficients against numpy's own linear algebra."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz

from transientcam.density import step_down, step_up


def _moments(harmonics: int, seed: int) -> NDArray[Any]:
    """b_0 to b_m of three returns over a uniform part: a positive definite Toeplitz matrix."""
    draw = np.random.default_rng(seed)
    phase_rad, weight = draw.uniform(0.0, 2.0 * np.pi, 3), draw.uniform(0.2, 2.0, 3)
    moments = np.exp(1j * np.arange(harmonics + 1)[:, None] * phase_rad) @ weight
    moments[0] += draw.uniform(0.02, 1.0)
    return np.asarray(moments)


def _coefficients(moments: NDArray[Any]) -> NDArray[Any]:
    """E, Re a_1, Im a_1, ...: B^-1 e_0 = a / E by a Toeplitz solver that is not ours."""
    unit = np.eye(len(moments))[0]
    solution = solve_toeplitz((moments, moments.conj()), unit)
    a = solution / solution[0]
    return np.concatenate(
        ([1.0 / solution[0].real], np.stack((a.real, a.imag), axis=-1).reshape(-1)[2:])
    )


@pytest.mark.parametrize("harmonics", [1, 2, 3, 4, 8])
def test_brightness_and_reflections_are_those_of_the_leading_blocks(harmonics: int) -> None:
    moments = _moments(harmonics, seed=harmonics)

    brightness, reflection = step_down(_coefficients(moments))

    # g_k is the last coefficient of the solution of order k
    for k in range(1, harmonics + 1):
        last = _coefficients(moments[: k + 1])[-2:]
        assert reflection[k - 1] == pytest.approx(complex(*last), abs=1e-9)
    assert brightness == pytest.approx(moments[0].real, rel=1e-9)


@pytest.mark.parametrize("harmonics", [1, 2, 3, 4, 8, 32])
def test_stepping_up_undoes_stepping_down(harmonics: int) -> None:
    planes = np.stack([_coefficients(_moments(harmonics, seed)) for seed in range(7)], axis=1)

    again = step_up(*step_down(planes))

    np.testing.assert_allclose(again, planes, rtol=1e-7, atol=1e-7)


def test_pixels_without_a_value_stay_so_and_disturb_no_other() -> None:
    planes = np.stack([_coefficients(_moments(4, seed)) for seed in range(3)], axis=1)
    spoilt = planes.copy()
    spoilt[:, 1] = np.nan

    again = step_up(*step_down(spoilt))

    assert np.isnan(again[:, 1]).all()
    np.testing.assert_allclose(again[:, [0, 2]], planes[:, [0, 2]], rtol=1e-9, atol=1e-12)


def test_a_pixel_without_light_has_no_reflection() -> None:
    brightness, reflection = step_down(np.zeros((9, 1)))

    assert brightness == [0.0]
    assert not reflection.any()
