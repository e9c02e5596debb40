"""Levinson's recursion and its inverses."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments import oracles

ORDERS = [1, 2, 3, 4, 8, 16, 32]


@pytest.mark.parametrize("m", ORDERS)
def test_coefficients_solve_the_toeplitz_system(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 40)

    coefficients = tm.levinson(b)

    column = oracles.first_column_of_inverse(b)
    assert np.allclose(coefficients.polynomial, column * coefficients.error, rtol=1e-9, atol=1e-9)
    assert np.allclose(coefficients.error, 1 / column[0].real, rtol=1e-9)
    assert np.all(np.abs(coefficients.reflection) < 1)


@pytest.mark.parametrize("m", ORDERS)
def test_single_precision_follows_double(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 40).astype(np.complex64)

    single, double = tm.levinson(b), tm.levinson(b.astype(complex))

    assert single.error.dtype == np.float32
    assert single.polynomial.dtype == single.reflection.dtype == np.complex64
    condition = (b[0].real / oracles.smallest_eigenvalue(b)).max()
    assert np.abs(single.reflection - double.reflection).max() < 1e-6 * condition


@pytest.mark.parametrize("m", ORDERS)
def test_reflections_and_brightness_say_the_same_as_the_moments(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 40)

    coefficients = tm.levinson(b)
    again = tm.from_reflection(b[0].real, coefficients.reflection)

    assert np.allclose(coefficients.brightness, b[0].real, rtol=1e-12)
    assert np.allclose(tm.moments_of(coefficients), b, atol=1e-11 * b[0].real.max())
    assert np.allclose(again.polynomial, coefficients.polynomial, rtol=1e-10, atol=1e-10)
    assert np.allclose(again.error, coefficients.error, rtol=1e-10)


@pytest.mark.parametrize("m", [1, 3, 8])
def test_extended_moments_are_those_of_the_density(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 6)
    phase = np.linspace(0, 2 * np.pi, 1 << 15, endpoint=False)
    expected = oracles.moments_of_density(oracles.density(b, phase), phase, 2 * m + 3)

    extended = tm.extend(tm.levinson(b), 2 * m + 3)

    assert extended.shape == (m + 3, 6)
    assert np.allclose(extended, expected[m + 1 :], atol=1e-8 * np.abs(b).max())


def test_any_trailing_shape_goes_through() -> None:
    b = oracles.random_moments(np.random.default_rng(0), 2, 12)

    cube = tm.levinson(b.reshape(3, 2, 3, 2))
    single = tm.levinson(b[:, 0])
    none = tm.levinson(b[:, :0])

    assert cube.error.shape == (2, 3, 2)
    assert cube.polynomial.shape == (3, 2, 3, 2)
    assert cube.reflection.shape == (2, 2, 3, 2)
    assert np.array_equal(cube.error.ravel(), tm.levinson(b).error)
    assert single.error.shape == ()
    assert single.error == pytest.approx(cube.error[0, 0, 0])
    assert none.polynomial.shape == (3, 0)


def test_strided_moments_are_the_same_as_contiguous_ones() -> None:
    b = oracles.random_moments(np.random.default_rng(0), 3, 50)
    pixels_first = np.ascontiguousarray(b.T).T

    assert np.array_equal(tm.levinson(pixels_first).error, tm.levinson(b).error)


def test_images_larger_than_a_block_are_the_same_as_their_parts() -> None:
    b = oracles.random_moments(np.random.default_rng(0), 2, 20_000)

    whole = tm.levinson(b)

    assert np.array_equal(whole.error[12_345:], tm.levinson(b[:, 12_345:]).error)


def test_real_and_integer_moments_are_taken() -> None:
    assert tm.levinson(np.array([2.0, 1.0])).error == pytest.approx(1.5)
    assert tm.levinson(np.array([2, 1], dtype=np.int32)).error == pytest.approx(1.5)
    assert tm.levinson(np.array([2, 1], dtype=np.float32)).error.dtype == np.float32
    assert tm.levinson([2, 1]).error == pytest.approx(1.5)  # lists too


def test_moments_outside_of_the_cone_are_projected_onto_its_border() -> None:
    b = np.array([[1.0, 1.0, 1.0], [0.5, 0.5, 2.0], [0.2, 3.0, 0.1]], dtype=complex)

    valid, second, first = (tm.levinson(b[:, k]) for k in range(3))

    assert abs(valid.reflection[1]) < 1
    # what lies inside is kept, what lies outside goes to the border in its direction
    assert second.reflection[0] == pytest.approx(-0.5)
    assert second.reflection[1] == pytest.approx(-1)
    assert first.reflection[0] == pytest.approx(-1)
    assert first.reflection[1] == 0
    for coefficients in (second, first):
        assert 0 < coefficients.error < 1e-14
        assert coefficients.brightness == pytest.approx(1)


def test_projection_is_continuous_at_the_border() -> None:
    inside, outside = (tm.levinson(np.array([1, 0.3, x], complex)) for x in (-0.8199, -0.8201))

    assert np.allclose(inside.polynomial, outside.polynomial, atol=3e-4)


def test_dark_and_invalid_pixels_stay_by_themselves() -> None:
    b = np.array([[1, 0, -1, np.nan, np.inf, 1], [0.5, 0, 0.2, 0.1, 0.1, np.inf]], dtype=complex)

    coefficients = tm.levinson(b)

    assert coefficients.error[0] == pytest.approx(0.75)
    assert np.all(coefficients.error[1:3] == 0)
    assert np.all(coefficients.reflection[0, 1:3] == 0)
    assert np.isnan(coefficients.error[3:]).all()


@pytest.mark.parametrize("scale", [1e-44, 1e-30, 1e30, 2e38])
def test_extreme_scales_change_nothing_but_the_error(scale: float) -> None:
    b = np.array([1.0, 0.5 + 0.25j, 0.25], dtype=np.complex64)
    scaled = (b.astype(complex) * scale).astype(np.complex64)

    coefficients = tm.levinson(scaled)

    exact = tm.levinson(scaled.astype(complex))  # subnormal moments are rounded as they come
    assert np.allclose(coefficients.reflection, exact.reflection, rtol=1e-5)
    assert coefficients.error == pytest.approx(exact.error, rel=1e-5, abs=2e-45)


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(tm.ShapeError, match=r"m in 1\.\.32"):
        tm.levinson(np.zeros((1, 4)))
    with pytest.raises(tm.ShapeError, match=r"b is of shape \(34, 2\)"):
        tm.levinson(np.zeros((34, 2)))
    with pytest.raises(tm.ShapeError, match=r"of shape \(\)"):
        tm.levinson(np.array(1.0))
    with pytest.raises(tm.ShapeError, match="complex64 or complex128"):
        tm.levinson(np.array(["a", "b"]))
    with pytest.raises(tm.ShapeError, match=r"b0 is of shape \(2,\)"):
        tm.from_reflection(np.ones(2), np.zeros((3, 4), complex))
    with pytest.raises(tm.ShapeError, match="reflection"):
        tm.from_reflection(np.ones(2), np.zeros((0, 2), complex))
    with pytest.raises(tm.ParameterError, match=r"n = 2 .* above the order m = 2"):
        tm.extend(tm.levinson(np.array([1.0, 0, 0])), 2)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_a_brightness_takes_the_place_of_b_0(dtype: type) -> None:
    moments = oracles.random_moments(np.random.default_rng(5), 3, 40).reshape(4, 5, 8)
    b: NDArray[Any] = moments.astype(dtype)
    raised = 1.2 * b[0].real

    found = tm.levinson(b, brightness=raised)

    whole = np.concatenate([raised[None], b[1:]]).reshape(4, -1).astype(complex)
    column = oracles.first_column_of_inverse(whole).reshape(b.shape)
    accurate = 1e-9 if dtype is np.complex128 else 1e-3
    assert np.allclose(found.polynomial, column * found.error, rtol=accurate, atol=accurate)
    assert np.allclose(found.error, 1 / column[0].real, rtol=accurate)


def test_a_brightness_of_other_pixels_is_refused() -> None:
    b = oracles.random_moments(np.random.default_rng(5), 3, 40)
    with pytest.raises(tm.ShapeError, match=r"brightness is of shape \(39,\), expected \(40,\)"):
        tm.levinson(b, brightness=b[0, :39].real)
