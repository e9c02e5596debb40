"""Odd numbers in arrays: rounding, byte order, the ends of the exponent range, derivatives."""

import jax
import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles

DTYPES = (np.complex64, np.complex128)


def noisy(m: int, dtype: type) -> np.ndarray:
    rng = np.random.default_rng(m)
    b = rng.normal(size=(m + 1, 400)) + 1j * rng.normal(size=(m + 1, 400))
    b[0] = 3 * np.abs(b[0])
    return b.astype(dtype)


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("m", [1, 3, 8])
def test_an_estimated_b_0_needs_no_biasing(m: int, dtype: type) -> None:
    estimated = tm.estimate_zeroth(noisy(m, dtype))

    again = tm.bias(estimated)

    assert not again.biased.any()
    np.testing.assert_array_equal(again.moments, estimated)


@pytest.mark.parametrize("keep", ["harmonics", "brightness"])
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("m", [1, 3, 8])
def test_biasing_twice_changes_nothing(m: int, dtype: type, keep: str) -> None:
    b = noisy(m, dtype)
    once = tm.bias(b, keep=keep)
    assert 0.1 < once.biased.mean() <= 1

    twice = tm.bias(once.moments, keep=keep)

    assert not twice.biased.any()
    np.testing.assert_array_equal(twice.moments, once.moments)


def test_moments_that_lack_more_than_rounding_are_biased() -> None:
    b = tm.estimate_zeroth(noisy(3, np.complex128), epsilon=4e-3 - 1e-10)

    assert tm.bias(b).biased.all()


def test_an_infinite_b_0_warns_of_nothing() -> None:
    b = np.array([[np.inf, 1], [1, 1], [0, 1]], np.complex64)

    found = tm.reconstruct(b)

    assert found.returns.count[0] == 0
    assert found.flags[0] == tm.Flags.NON_FINITE


@pytest.mark.parametrize("swapped", [">c8", ">c16", ">f4", ">f8"])
def test_arrays_of_another_byte_order_give_what_native_ones_give(swapped: str) -> None:
    dtype = np.dtype(swapped)
    b = noisy(3, np.complex128)
    b = b.real.astype(dtype) if dtype.kind == "f" else b.astype(dtype)
    native = b.astype(dtype.newbyteorder("="))

    found, expected = tm.pisarenko(b), tm.pisarenko(native)

    assert found.weight.dtype == expected.weight.dtype
    np.testing.assert_array_equal(found.weight, expected.weight)
    np.testing.assert_array_equal(tm.levinson(b).polynomial, tm.levinson(native).polynomial)


@pytest.mark.parametrize("exponent", [-1030, -1040, -1060])
def test_subnormal_moments_are_explained_to_the_least_number(exponent: int) -> None:
    """A factor of a power of two changes nothing but for what rounding to subnormals takes."""
    rng = np.random.default_rng(4)
    phase, weight = rng.uniform(0, 6.28, (4, 100)), rng.uniform(0.2, 1, (4, 100))
    b = oracles.moments_of_returns(phase, weight, 4)
    small = np.ldexp(b.real, exponent) + 1j * np.ldexp(b.imag, exponent)

    found = tm.pisarenko(small)

    lifted = np.ldexp(found.weight, -exponent)
    again = oracles.moments_of_returns(np.nan_to_num(found.phase_rad), lifted, 4)
    again[0] += np.ldexp(found.uniform, -exponent)
    least = 2.0 ** (-1074 - exponent)  # the least number, in the unit of the moments
    assert np.abs(again - b).max() <= 16 * least + 1e-12


def test_derivatives_of_the_density_are_finite_wherever_it_is() -> None:
    m = 3
    phase, weight = np.array([[1.0], [2.5]]), np.array([[1.0], [0.5]])
    b = np.repeat(oracles.moments_of_returns(phase, weight, m), 6, axis=1)
    b[0] *= 1.01
    b[:, 1], b[:, 2], b[0, 3], b[1:, 4], b[0, 5] = 0, 1, 0.5, 0, -1

    def total(parts: jax.Array) -> jax.Array:
        density = tm.density(tm.levinson(parts[0] + 1j * parts[1]), np.linspace(0, 6, 7))
        return density.sum()  # type: ignore[no-any-return]

    slope = jax.jit(jax.grad(total))(
        jax.numpy.asarray(np.stack([b.real, b.imag]), dtype=np.float32)
    )

    assert np.isfinite(np.asarray(slope)).all()
