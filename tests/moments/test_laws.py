"""Laws that hold for all moments: symmetries, and one pixel's independence of the others."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from hypothesis.extra import numpy as st_numpy

import transientcam_moments as tm
from tests.moments import oracles

PHASE = np.linspace(0.0, 6.0, 9)
_ROUNDED = {np.complex64: 2e-4, np.complex128: 1e-12}
"""Of densities: beside a narrow return the differences that are squared cancel."""

orders = st.integers(1, 6)
seeds = st.integers(0, 2**32 - 1)
shifts = st.floats(-20, 20)


def valid(seed: int, m: int, pixels: int = 6, *, margin: float = 0.02) -> np.ndarray:
    """Noisy moments, made valid with a margin."""
    b = oracles.random_moments(np.random.default_rng(seed), m, pixels, noise=0.1)
    return np.asarray(tm.bias(b, margin).moments)


@given(seeds, orders)
@settings(deadline=None)
def test_the_density_has_the_moments_it_was_made_from(seed: int, m: int) -> None:
    b = valid(seed, m, margin=0.2)
    phase = np.linspace(0, 2 * np.pi, 1 << 13, endpoint=False)

    h = tm.density(tm.levinson(b), phase)

    assert np.allclose(oracles.moments_of_density(h, phase, m), b, atol=1e-7 * np.abs(b).max())


@given(seeds, orders, st.floats(1e-200, 1e200))
@settings(deadline=None)
def test_more_light_scales_everything_and_moves_nothing(seed: int, m: int, scale: float) -> None:
    b = valid(seed, m)
    bright, dim = tm.pisarenko(b * scale), tm.pisarenko(b)

    assert np.allclose(bright.weight, dim.weight * scale, rtol=1e-6)
    assert np.allclose(bright.uniform, dim.uniform * scale, rtol=1e-9)
    assert oracles.around(bright.phase_rad - dim.phase_rad).max() < 1e-6
    assert np.allclose(
        tm.density(tm.levinson(b * scale), PHASE), tm.density(tm.levinson(b), PHASE) * scale
    )


@given(seeds, orders, shifts)
@settings(deadline=None)
def test_a_later_signal_is_the_same_signal_later(seed: int, m: int, shift: float) -> None:
    b = valid(seed, m)
    later = b * np.exp(1j * shift * np.arange(m + 1))[:, None]

    assert np.allclose(tm.smallest_eigenvalue(later), tm.smallest_eigenvalue(b), atol=1e-10)
    assert np.allclose(
        tm.density(tm.levinson(later), PHASE + shift), tm.density(tm.levinson(b), PHASE), rtol=1e-7
    )
    for before, after in zip(tm.bounds(b, PHASE), tm.bounds(later, PHASE + shift), strict=True):
        assert np.allclose(after, before, rtol=1e-7, atol=1e-9)
    for pixel in range(b.shape[1]):
        one, two = tm.pisarenko(b[:, pixel]), tm.pisarenko(later[:, pixel])
        moved = (one.phase_rad + shift) % (2 * np.pi)
        nearest = oracles.around(two.phase_rad[:, None] - moved).argmin(axis=1)
        assert oracles.around(two.phase_rad - moved[nearest]).max() < 1e-6
        assert np.allclose(two.weight, one.weight[nearest], rtol=1e-6)


@given(seeds, orders)
@settings(deadline=None)
def test_conjugate_moments_are_the_signal_backwards(seed: int, m: int) -> None:
    b = valid(seed, m)
    forwards, backwards = tm.pisarenko(b), tm.pisarenko(b.conj())

    assert np.allclose(
        tm.density(tm.levinson(b.conj()), -PHASE), tm.density(tm.levinson(b), PHASE), rtol=1e-9
    )
    assert np.allclose(backwards.weight[::-1], forwards.weight, rtol=1e-6)
    turned = oracles.around(backwards.phase_rad[::-1] + forwards.phase_rad)
    assert turned.max() < 1e-6


@given(seeds, orders, st.floats(0, 10))
@settings(deadline=None)
def test_uniform_light_raises_the_eigenvalue_and_leaves_the_returns(
    seed: int, m: int, light: float
) -> None:
    b = valid(seed, m)
    more = b.copy()
    more[0] += light
    one, two = tm.pisarenko(b), tm.pisarenko(more)

    assert np.allclose(two.uniform, one.uniform + light, atol=1e-11)
    assert np.allclose(two.weight, one.weight, rtol=1e-6)
    assert oracles.around(two.phase_rad - one.phase_rad).max() < 1e-6


@given(seeds, orders)
@settings(deadline=None)
def test_biasing_moves_moments_as_little_as_any_validity_requires(seed: int, m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(seed), m, 6, noise=0.3)

    moments, biased = tm.bias(b, 0.01)

    assert np.all(moments[0].real >= b[0].real)
    # a hair less brightness would break the margin
    less = moments.copy()
    less[0] -= 1e-6 * np.abs(b).max()
    share = oracles.smallest_eigenvalue(less) / less[0].real
    assert np.all(share[biased] < 0.01)


STAGES: dict[str, Callable[[Any], Any]] = {
    "levinson": tm.levinson,
    "density": lambda b: (tm.density(tm.levinson(b), PHASE),),
    "cumulative": lambda b: (tm.cumulative(tm.levinson(b), PHASE),),
    "smallest_eigenvalue": lambda b: (tm.smallest_eigenvalue(b),),
    "bias": tm.bias,
    "estimate_zeroth": lambda b: (tm.estimate_zeroth(b),),
    "pisarenko": tm.pisarenko,
    "peaks": lambda b: tm.peaks(tm.levinson(b)),
    "bounds": lambda b: tm.bounds(b, PHASE),
    "smoothed_density": lambda b: (tm.smoothed_density(tm.levinson(b), PHASE),),
    "flags": lambda b: (tm.flags(b),),
}


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("stage", STAGES)
def test_shuffling_pixels_shuffles_results(stage: str, dtype: type) -> None:
    rng = np.random.default_rng(0)
    b: np.ndarray = tm.bias(oracles.random_moments(rng, 3, 9000, noise=0.1)).moments
    b = b.astype(dtype)
    order = rng.permutation(9000)

    for straight, shuffled in zip(
        STAGES[stage](b), STAGES[stage](np.ascontiguousarray(b[:, order])), strict=True
    ):
        if stage == "density":  # products of matrices, which some BLAS round by the place
            np.testing.assert_allclose(shuffled, straight[..., order], rtol=_ROUNDED[dtype])
        else:
            assert np.array_equal(shuffled, straight[..., order], equal_nan=True)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("poison", [np.nan, np.inf, 1e-40, 3e38, 0.0, -1.0])
def test_one_poisoned_pixel_changes_no_other(stage: str, dtype: type, poison: float) -> None:
    b: np.ndarray = oracles.random_moments(np.random.default_rng(1), 3, 64, noise=0.05)
    b = b.astype(dtype)
    poisoned = b.copy()
    poisoned[:, 17] = poison
    others = np.arange(64) != 17

    for clean, touched in zip(STAGES[stage](b), STAGES[stage](poisoned), strict=True):
        assert np.array_equal(touched[..., others], clean[..., others], equal_nan=True)


@given(
    st_numpy.arrays(
        np.float32,
        st.tuples(st.integers(2, 5), st.integers(1, 4), st.just(2)),
        elements=st.floats(width=32, allow_nan=True, allow_infinity=True, allow_subnormal=True),
    )
)
@example(np.full((4, 1, 2), np.array([2.2736942e38, np.inf]), np.float32))
@example(np.full((4, 1, 2), 2.2736942e38, np.float32))
@settings(deadline=None, max_examples=200)
def test_no_moments_at_all_raise_or_give_unflagged_nonsense(parts: np.ndarray) -> None:
    b = parts.view(np.complex64)[..., 0]

    moments, _ = tm.bias(b)
    returns, c = tm.pisarenko(moments), tm.levinson(moments)
    results = [
        *moments,
        *c.polynomial,
        c.error,
        returns.uniform,
        *returns.weight,
        *tm.density(c, PHASE),
        *tm.cumulative(c, PHASE),
        *tm.peaks(c).density,
    ]

    fine = tm.flags(b) & int(tm.INVALID) == 0
    for result in results:
        assert np.isfinite(result[fine]).all()
    assert np.all(returns.weight >= 0)
    assert np.all(np.isfinite(returns.phase_rad) == (returns.weight > 0))
