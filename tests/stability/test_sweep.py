"""Three million random pixels, of all magnitudes and kinds: nothing is NaN that isn't flagged."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles

# three million in all; m and double precision cost time, not other ways to fail
PIXELS = {
    (1, "complex64"): 1_200_000,
    (2, "complex64"): 800_000,
    (3, "complex64"): 600_000,
    (4, "complex64"): 250_000,
    (8, "complex64"): 60_000,
    (16, "complex64"): 6_000,
    (32, "complex64"): 1_500,
    (1, "complex128"): 100_000,
    (2, "complex128"): 70_000,
    (3, "complex128"): 40_000,
    (4, "complex128"): 30_000,
    (8, "complex128"): 3_000,
    (16, "complex128"): 500,
    (32, "complex128"): 200,
}
BLOCK = 1 << 17


def test_the_sweep_has_three_million_pixels() -> None:
    assert sum(PIXELS.values()) >= 3_000_000


def pixels(rng: np.random.Generator, m: int, dtype: str, count: int) -> np.ndarray:
    """A mixture of noise, sparse signals, contradictions, extremes and rubbish."""
    limits = np.finfo(np.dtype(dtype))
    b = np.empty((m + 1, count), dtype)
    noise = rng.normal(size=(m + 1, count)) + 1j * rng.normal(size=(m + 1, count))
    b[:] = noise
    b[0] = np.abs(noise).sum(axis=0)
    kind = rng.integers(0, 10, count)
    # few exact returns, some of them nearly the same
    sparse = np.flatnonzero(kind <= 3)
    returns = 1 + m // 2
    phase = rng.uniform(0, 7, (returns, sparse.size))
    phase[-1] = phase[0] + 10 ** rng.uniform(-9, 0, sparse.size)
    weight = 10 ** rng.uniform(-6, 0, phase.shape)
    b[:, sparse] = oracles.moments_of_returns(phase, weight, m)
    # b_0 too small: contradictions
    b[0, kind == 4] *= rng.uniform(-0.5, 0.9, np.count_nonzero(kind == 4))
    # all magnitudes, down to subnormal and up to overflow
    scaled = np.flatnonzero(kind >= 7)
    exponent = rng.uniform(np.log10(limits.smallest_subnormal), np.log10(limits.max), scaled.size)
    with np.errstate(all="ignore"):
        b[:, scaled] *= (10**exponent).astype(limits.dtype)
        # one plane of another magnitude
        odd = np.flatnonzero(kind == 8)
        b[rng.integers(0, m + 1, odd.size), odd] *= limits.dtype.type(1e20)
    # planes that are zero, equal, subnormal, huge, infinite or no number
    specials = np.array(
        [0, 1, -1, limits.smallest_subnormal, limits.max, np.inf, np.nan, 1j], dtype
    )
    rubbish = np.flatnonzero(kind == 9)
    at = rng.integers(0, m + 1, rubbish.size)
    b[at, rubbish] = specials[rng.integers(0, specials.size, rubbish.size)]
    return b


@pytest.mark.parametrize(("m", "dtype"), PIXELS)
def test_no_unflagged_pixel_is_nan_or_infinite(m: int, dtype: str) -> None:
    rng = np.random.default_rng([m, len(dtype)])
    left = PIXELS[m, dtype]
    while left > 0:
        b = pixels(rng, m, dtype, min(BLOCK, left))
        left -= b.shape[1]

        eigenvalue = tm.smallest_eigenvalue(b)
        fine = (tm.flags(b, eigenvalue=eigenvalue) & int(tm.INVALID)) == 0
        moments, biased = tm.bias(b, eigenvalue=eigenvalue)
        c = tm.levinson(moments)
        raw = tm.levinson(b)  # also without biasing
        returns = tm.pisarenko(moments)
        h = tm.density(c, [0.0, 2.5])

        results = [eigenvalue, *moments, *c.polynomial, *c.reflection, c.error, *h]
        results += [*raw.polynomial, raw.error, *returns.weight, returns.uniform]
        for result in results:
            assert np.isfinite(result[fine]).all()
        assert np.all(returns.weight >= 0)
        assert np.array_equal(returns.weight > 0, np.isfinite(returns.phase_rad))
        assert np.all(h[:, fine] >= 0)
        # a subnormal brightness may have less light than the least number in its sharpest part
        assert np.all(c.error[fine] >= 0)
        assert np.all(c.error[fine & (moments[0].real > np.finfo(b.dtype).tiny * 1e8)] > 0)
        assert np.all(np.abs(c.reflection[:, fine]) < 1)
        assert not np.any(biased & np.isnan(eigenvalue))


@pytest.mark.parametrize(("m", "dtype"), PIXELS)
def test_no_unflagged_pixel_has_unclear_light_peaks_or_bounds(m: int, dtype: str) -> None:
    rng = np.random.default_rng([m, len(dtype), 1])
    b = pixels(rng, m, dtype, 20_000 // m)

    fine = (tm.flags(b) & int(tm.INVALID)) == 0
    moments, _ = tm.bias(b)
    c = tm.levinson(moments)
    found = tm.peaks(c)
    light = tm.cumulative(c, [0.0, 1.0, 2 * np.pi])
    results = [*found.density, *light, *tm.smoothed_density(c, [1.0]), *tm.bounds(moments, 1.0)[0]]

    for result in results:
        assert np.isfinite(result[..., fine]).all()
    assert np.all(found.density >= 0)
    assert np.array_equal(found.density > 0, np.isfinite(found.phase_rad))
    bright = fine & (moments[0].real > np.finfo(b.dtype).tiny * 1e8)
    b0 = moments[0, bright].real
    assert np.allclose(light[2, bright] / b0, 1, rtol=1e-3)
    assert np.all(light[1, bright] / b0 <= 1 + 1e-3)
    assert np.all(light[1, bright] / b0 >= -1e-3)
