"""The lane of two returns by all pairs against its planar statement, and what it leaves to it."""

from collections.abc import Iterator

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.kernel_lanes import find, lanes, without_lanes
from tests.moments.oracles import around

MULTIPLES = (1, 3, 4)
STD = 0.01


@pytest.fixture(autouse=True, scope="module")
def compiled() -> Iterator[None]:
    with without_lanes(), lanes(max(MULTIPLES), precisions=("float32",), names=("pairs",)):
        yield


def moments_of(first: np.ndarray, second: np.ndarray, ratio: np.ndarray) -> np.ndarray:
    """Return noisy moments (3, P) of two returns in single precision."""
    j = np.array(MULTIPLES)[:, None]
    noise = np.random.default_rng(6).normal(0, STD, (2, len(MULTIPLES), len(first)))
    b = np.exp(1j * j * first) + ratio * np.exp(1j * j * second) + noise[0] + 1j * noise[1]
    return np.asarray(b, np.complex64)


def random_pairs(pixels: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return two phases and the second one's weight, which is 0 in every third pixel."""
    rng = np.random.default_rng(8)
    first = rng.uniform(0, 2 * np.pi, pixels)
    ratio = rng.uniform(0.3, 1.0, pixels) * (np.arange(pixels) % 3 > 0)
    return first, first + rng.uniform(0.6, 3.0, pixels), ratio


def noise_of(pixels: int) -> tm.noise.MomentNoise:
    """Return noise that differs by pixel and by moment."""
    factor = np.random.default_rng(9).uniform(0.5, 2, (len(MULTIPLES), pixels))
    return tm.noise.MomentNoise((STD**2 * factor).astype(np.float32))


def by_lane(
    b: np.ndarray, noise: tm.noise.MomentNoise | None = None, threads: int = 1
) -> tm.Likelihood:
    return tm.two_returns(b, noise, harmonics=MULTIPLES, threads=threads)


def test_the_lane_finds_what_the_planar_statement_finds() -> None:
    pixels = 2003
    b, noise = moments_of(*random_pairs(pixels)), noise_of(pixels)
    assert find("pairs", np.empty((5, pixels), np.complex64)) is not None

    mine = by_lane(b, noise)

    with without_lanes():
        theirs = by_lane(b, noise)
    same = mine.count == theirs.count
    assert same.mean() > 0.999  # rounding decides where two models are as good
    assert set(np.unique(mine.count)) == {1, 2}
    for name in mine._fields[:-1]:
        found, expected = getattr(mine, name), getattr(theirs, name)
        assert (found.shape, found.dtype) == (expected.shape, expected.dtype)
        close = np.isclose(found, expected, rtol=5e-3, atol=5e-3, equal_nan=True)
        assert close[..., same].mean() > 0.99, name
    # neither is the better one by more than rounding, but for a few that end in another optimum
    off = mine.chi_square[same] - theirs.chi_square[same]
    assert np.quantile(np.abs(off), 0.99) < 0.05


def test_the_lane_finds_the_returns_that_the_moments_are_of() -> None:
    first, second, ratio = random_pairs(2003)

    found = by_lane(moments_of(first, second, ratio), noise_of(2003))

    one = ratio == 0
    assert (found.count[one] == 1).mean() > 0.99
    off = around(found.phase_rad[0] - first)
    assert np.quantile(np.abs(off[one & (found.count == 1)]), 0.95) < 4 * STD
    apart = ~one & (first + np.pi < 2 * np.pi) & (second - first > 1.0)
    assert np.median(np.abs(off[apart])) < 4 * STD


def test_a_result_depends_neither_on_its_neighbours_nor_on_threads() -> None:
    b, noise = moments_of(*random_pairs(2500)), noise_of(2500)
    whole = by_lane(b, noise)

    alone = by_lane(b[:, 1000:1077], tm.noise.MomentNoise(noise.variance[:, 1000:1077]))
    together = by_lane(b, noise, threads=3)

    for name in whole._fields[:-1]:
        np.testing.assert_array_equal(getattr(whole, name)[..., 1000:1077], getattr(alone, name))
        np.testing.assert_array_equal(getattr(whole, name), getattr(together, name))


def test_pixels_without_light_or_number_disturb_no_other() -> None:
    b = moments_of(*random_pairs(128))
    clean = by_lane(b)
    b[:, 5] = 0
    b[1, 9] = np.nan
    b[2, 70] = np.inf

    found = by_lane(b)

    wrong = np.zeros(128, bool)
    wrong[[5, 9, 70]] = True
    assert not found.count[wrong].any()
    assert np.isnan(found.phase_rad[:, wrong]).all()
    np.testing.assert_array_equal(found.phase_rad[:, ~wrong], clean.phase_rad[:, ~wrong])


def test_double_precision_is_left_to_the_planar_statement() -> None:
    assert find("pairs", np.empty((5, 5000), np.complex128)) is None
    assert find("pairs", np.empty((2, 5000), np.complex64)) is None, "one frequency has one return"


def test_less_than_one_thread_is_refused() -> None:
    with pytest.raises(tm.ParameterError, match="threads"):
        by_lane(moments_of(*random_pairs(64)), threads=0)
