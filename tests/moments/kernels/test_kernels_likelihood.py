"""The likelihood's kernel against its planar statement, and what it leaves to it."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.compiled_kernels import find, kernels, without_kernels
from tests.moments.oracles import moments_of_returns

M = 3


@pytest.fixture(autouse=True, scope="module")
def compiled() -> Iterator[None]:
    with without_kernels(), kernels(M, precisions=("float32",), names=("likelihood",)):
        yield


def measured(pixels: int, std: float = 0.01) -> tuple[np.ndarray, tm.noise.MomentNoise]:
    """Return noisy moments of one to four returns, and their noise, which differs by pixel."""
    random = np.random.default_rng(5)
    there = np.arange(4)[:, None] <= np.arange(pixels) % 4
    weight = random.uniform(0.1, 1, (4, pixels)) * there
    b = moments_of_returns(random.uniform(0, 2 * np.pi, (4, pixels)), weight, M)
    variance = std**2 * random.uniform(0.5, 2, b.shape)
    noise = tm.noise.MomentNoise(variance.astype(np.float32))
    drawn = tm.noise.draw(b.astype(np.complex64), noise, random, draws=1)[:, 0]
    return drawn, noise


def both(b: np.ndarray, noise: tm.noise.MomentNoise, **options: Any) -> tuple[Any, Any]:
    assert find("likelihood", b) is not None
    mine = tm.likelihood(b, noise, **options)
    with without_kernels():
        theirs = tm.likelihood(b, noise, **options)
    return mine, theirs


def test_the_kernel_finds_what_the_planar_statement_finds() -> None:
    mine, theirs = both(*measured(4003))

    same = mine.count == theirs.count
    assert same.mean() > 0.999  # rounding decides where two models are as good
    for name in mine._fields[:-1]:
        found, expected = getattr(mine, name), getattr(theirs, name)
        assert found.shape == expected.shape
        assert found.dtype == expected.dtype
        close = np.isclose(found, expected, rtol=5e-3, atol=5e-3, equal_nan=True)
        # the weights of an average are exponentials of what rounding changes
        assert close[..., same].mean() > (0.98 if name.startswith("average") else 0.99), name
    assert mine.has_tail.any()
    assert np.bincount(mine.count).size == 4  # models of each kind among them
    # neither is the better one by more than rounding, but for a few that end in another optimum
    off = mine.chi_square[same] - theirs.chi_square[same]
    assert np.quantile(np.abs(off), 0.99) < 0.05


def test_odd_pixels_are_the_same_and_leave_their_neighbours_alone() -> None:
    b, noise = measured(200)
    clean = tm.likelihood(b, noise)
    odd = b.copy()
    values = (0, -1, np.nan, np.inf, -np.inf, 3e38, 1e-45, 1e-38)
    for place, value in enumerate(values):
        odd[:, 7 * place] = value
    odd[2, 100] = np.nan
    noise.variance[0, 120:130] = 0
    noise.variance[1, 130:140] = np.inf

    mine, theirs = both(odd, noise)

    assert np.array_equal(mine.count, theirs.count)
    assert np.array_equal(mine.degrees_of_freedom, theirs.degrees_of_freedom)
    assert np.array_equal(np.isnan(mine.phase_rad), np.isnan(theirs.phase_rad))
    assert np.array_equal(np.isnan(mine.chi_square), np.isnan(theirs.chi_square))
    others = np.ones(200, bool)
    others[[7 * place for place in range(len(values))]] = False
    others[100] = others[120:140] = False
    for found, expected in zip(mine[:-1], clean[:-1], strict=True):
        assert np.array_equal(found[..., others], expected[..., others], equal_nan=True)


@pytest.mark.parametrize("pixels", [64, 101, 511, 513, 545, 1039])
def test_what_a_pixel_gets_does_not_depend_on_how_many_there_are(pixels: int) -> None:
    b, noise = measured(1500)
    whole = tm.likelihood(b, noise)

    last = tm.likelihood(b[:, -pixels:], tm.noise.MomentNoise(noise.variance[:, -pixels:]))

    for found, expected in zip(last[:-1], whole[:-1], strict=True):
        assert np.array_equal(found, expected[..., -pixels:], equal_nan=True)


def test_pixels_are_the_same_beside_others_that_need_more_models() -> None:
    b, noise = measured(2000)
    simple = np.arange(2000) % 4 == 0  # one return

    alone = tm.likelihood(b[:, simple], tm.noise.MomentNoise(noise.variance[:, simple]))
    among = tm.likelihood(b, noise)

    for found, expected in zip(alone[:-1], among[:-1], strict=True):
        assert np.array_equal(found, expected[..., simple], equal_nan=True)


def test_other_models_are_left_to_the_planar_statement() -> None:
    mine, theirs = both(*measured(100), returns=2, tail_shape=1)

    for found, expected in zip(mine[:-1], theirs[:-1], strict=True):
        assert np.array_equal(found, expected, equal_nan=True)


def test_images_and_strided_moments_are_taken() -> None:
    b, noise = measured(130)
    flat = tm.likelihood(b, noise)

    image = tm.likelihood(
        b.reshape(-1, 10, 13), tm.noise.MomentNoise(noise.variance.reshape(-1, 10, 13))
    )
    strided = tm.likelihood(np.repeat(b, 2, axis=1)[:, ::2], tm.noise.MomentNoise(noise.variance))

    assert np.array_equal(image.weight.reshape(3, -1), flat.weight)
    assert np.array_equal(strided.weight, flat.weight)
