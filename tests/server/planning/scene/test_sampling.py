"""Pixels that stand for a scene of several kinds."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_server.planning._scene.scene import (
    STRATUM,
    coherence,
    one_of_each,
    typical_pixels,
)

COUNT = 128


def moments(share: float, pixels: int, seed: int = 0) -> tuple[NDArray[Any], NDArray[Any]]:
    """Moments of single returns, and of so many pixels with two, in any order; which have two."""
    random = np.random.default_rng(seed)
    two = random.permutation(pixels) < share * pixels
    j = np.arange(5)[:, None]
    light = random.uniform(1, 9, pixels)
    late = np.where(two, 0.6, 0.0)
    b = light * ((1 - late) * np.exp(0.7j * j) + late * np.exp(1.9j * j))
    return b, two


@pytest.mark.parametrize("share", [0.1, 0.42, 0.5, 0.77])
def test_kinds_are_as_frequent_as_in_the_scene(share: float) -> None:
    b, two = moments(share, 5000)
    chosen = typical_pixels(b, COUNT)
    assert two[chosen].mean() == pytest.approx(share, abs=1 / COUNT + STRATUM / COUNT / 4)


def test_dim_and_bright_pixels_are_as_frequent_as_in_the_scene() -> None:
    b, _ = moments(0.4, 5000)
    light = np.abs(b[1])
    chosen = light[typical_pixels(b, COUNT)]
    for part in (0.1, 0.5, 0.9):
        assert (chosen < np.quantile(light, part)).mean() == pytest.approx(part, abs=0.03)


@pytest.mark.parametrize("share", [0.1, 0.42, 0.5, 0.77])
def test_few_of_them_have_each_kind_as_frequently_and_are_dim_and_bright(share: float) -> None:
    b, two = moments(share, 20_000)
    many = typical_pixels(b, COUNT * STRATUM)
    few = one_of_each(many.size)
    assert np.array_equal(few // STRATUM, np.arange(COUNT))
    assert np.bincount(few % STRATUM).tolist() == [COUNT // STRATUM] * STRATUM
    assert two[many[few]].mean() == pytest.approx(share, abs=2 / COUNT)


@pytest.mark.parametrize("pixels", [1, 5, 100, 129])
def test_few_pixels_are_taken_repeatedly(pixels: int) -> None:
    b, _ = moments(0.5, pixels)
    chosen = typical_pixels(b, COUNT)
    assert chosen.shape == (COUNT,)
    assert set(chosen) <= set(range(pixels))
    if pixels <= COUNT // STRATUM:
        assert set(chosen) == set(range(pixels))


def test_moments_of_one_return_are_coherent_and_of_two_less() -> None:
    b, two = moments(0.5, 200)
    found = coherence(b)
    assert found[~two] == pytest.approx(1.0)
    assert found[two].max() < 0.9
