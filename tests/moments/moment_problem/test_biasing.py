"""The smallest eigenvalue and what rests on it."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles

ORDERS = [1, 2, 3, 4, 8, 16, 32]


@pytest.mark.parametrize("m", ORDERS)
@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("kind", ["physical", "noisy", "sparse", "single", "zero diagonal"])
def test_smallest_eigenvalue_is_that_of_lapack(m: int, dtype: type, kind: str) -> None:
    rng = np.random.default_rng(m)
    b = oracles.random_moments(rng, m, 60, noise=0.05 if kind == "noisy" else 0.0)
    if kind in ("sparse", "single"):
        returns = m if kind == "sparse" else 1
        b = oracles.moments_of_returns(*oracles.random_returns(rng, returns=returns, pixels=60), m)
    if kind == "zero diagonal":
        b[0] = 0
    b = b.astype(dtype)

    eigenvalue = tm.smallest_eigenvalue(b)

    error = np.abs(eigenvalue - oracles.smallest_eigenvalue(b)) / np.abs(b).max(axis=0)
    assert eigenvalue.dtype == np.finfo(dtype).dtype
    assert error.max() < (10 + 5 * m) * np.finfo(dtype).eps


@pytest.mark.parametrize("keep", ["harmonics", "brightness"])
@pytest.mark.parametrize("m", [1, 3, 8, 32])
def test_biased_moments_are_valid_with_a_margin(m: int, keep: str) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 100, noise=0.2)

    moments, biased = tm.bias(b, 0.01, keep=keep)

    relative = oracles.smallest_eigenvalue(moments) / moments[0].real
    assert biased.any()
    assert relative.min() > 0.01 - 1e-13
    assert np.allclose(relative[biased], 0.01, atol=1e-13)
    assert np.array_equal(biased, oracles.smallest_eigenvalue(b) < 0.01 * b[0].real)
    assert np.array_equal(moments[:, ~biased], b[:, ~biased])
    if keep == "harmonics":
        assert np.array_equal(moments[1:], b[1:])
    else:
        assert np.array_equal(moments[0], b[0])


def test_both_ways_to_bias_give_the_same_density_up_to_brightness() -> None:
    b = oracles.random_moments(np.random.default_rng(5), 3, 50, noise=0.2)

    raised, scaled = tm.bias(b).moments, tm.bias(b, keep="brightness").moments

    assert np.allclose(raised / raised[0], scaled / scaled[0], atol=1e-14)


def test_biasing_twice_changes_nothing() -> None:
    b = oracles.random_moments(np.random.default_rng(6), 3, 200, noise=0.2)
    once = tm.bias(b).moments

    assert np.allclose(tm.bias(once).moments, once, rtol=1e-14)


def test_biasing_agrees_with_the_paper_to_first_order() -> None:
    # Sec. 4.3: b_0 := b_0 + epsilon - lambda
    b = np.array([[1.0], [0.999]], complex)

    moments, biased = tm.bias(b, 4e-3)

    assert biased.all()
    assert moments[0, 0].real == pytest.approx(1 + 4e-3 - 1e-3, abs=2e-5)


def test_biasing_leaves_invalid_pixels_and_their_neighbours_alone() -> None:
    b = np.array([[np.nan, 1.0, 0.0, -1.0], [0.5, 2.0, 0.0, 0.1]], complex)

    for keep in ("harmonics", "brightness"):
        moments, biased = tm.bias(b, keep=keep)
        assert np.isnan(moments[0, 0])
        assert biased.tolist() == [False, True, False, keep == "harmonics"]
        assert np.isfinite(moments[:, 1:]).all()


def test_a_known_eigenvalue_is_not_searched_for_again() -> None:
    b = oracles.random_moments(np.random.default_rng(7), 3, 20, noise=0.3)

    with_it = tm.bias(b, eigenvalue=tm.smallest_eigenvalue(b))

    assert np.array_equal(with_it.moments, tm.bias(b).moments)


@pytest.mark.parametrize("m", [1, 3, 8])
def test_the_estimated_zeroth_moment_is_the_least_brightness_of_any_explanation(m: int) -> None:
    rng = np.random.default_rng(m)
    phase, weight = oracles.random_returns(rng, returns=m, pixels=30, apart_rad=0.3 / m)
    b = oracles.moments_of_returns(phase, weight, m)
    unknown = b.copy()
    unknown[0] = 123

    estimated = tm.estimate_zeroth(unknown, 0.0)

    # m returns are the sparsest explanation of m moments (Sec. 5.1)
    assert np.allclose(estimated, b, atol=1e-9 * np.abs(b).max())


def test_the_estimated_zeroth_moment_leaves_the_uniform_part_asked_for() -> None:
    b = oracles.random_moments(np.random.default_rng(1), 3, 30)

    estimated = tm.estimate_zeroth(b, 0.02)

    share = oracles.smallest_eigenvalue(estimated) / estimated[0].real
    assert np.allclose(share, 0.02, atol=1e-13)
    assert np.array_equal(estimated[1:], b[1:])


def test_wrong_arguments_are_refused() -> None:
    b = np.ones((2, 3), complex)
    for epsilon in (-0.1, 1.0, float("nan")):
        with pytest.raises(tm.ParameterError, match="epsilon"):
            tm.bias(b, epsilon)
        with pytest.raises(tm.ParameterError, match="0 <= epsilon < 1"):
            tm.estimate_zeroth(b, epsilon)
    with pytest.raises(tm.ParameterError, match=r"keep = 'all'"):
        tm.bias(b, keep="all")
    with pytest.raises(tm.ShapeError):
        tm.smallest_eigenvalue(np.ones(1))
