"""What is predicted of averaging over neighbours, against averages of noisy pictures."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_server.planning._prediction.averaging import LEAST_SHARE, averaged

Array = NDArray[Any]
STD = 0.01
SHAPE = 40, 48
INNER = np.s_[8:-8, 8:-8]
ROWS, COLUMNS = np.mgrid[: SHAPE[0], : SHAPE[1]]
PLACES = np.arange(SHAPE[0] * SHAPE[1]).reshape(SHAPE)


def picture(phase_rad: Array, m: int = 4) -> Array:
    b: Array = np.exp(1j * np.arange(m + 1)[:, None, None] * phase_rad)
    return b


def noisy(b: Array, std: float) -> Array:
    random = np.random.default_rng(5)
    return b + std * (random.normal(size=b.shape) + 1j * random.normal(size=b.shape))


def variance(b: Array, pixels: Array) -> Array:
    found = np.full((len(b), pixels.size), STD**2)
    found[0] = 0  # not measured
    return found


@pytest.mark.parametrize("slope_rad", [0.0, 0.01, 0.03])
@pytest.mark.parametrize("m", [1, 4])
def test_as_much_noise_is_left_as_averaging_leaves(slope_rad: float, m: int) -> None:
    b = picture(slope_rad * COLUMNS + slope_rad / 3 * ROWS, m)
    captured = tm.average_neighbours(noisy(b, STD), tm.noise.MomentNoise(np.full(b.shape, STD**2)))
    pixels = PLACES[INNER][::4, ::4].ravel()

    mean, share = averaged(b, pixels, variance(b, pixels))

    # a little more than where averages of more pixels are beside
    assert np.median(share) == pytest.approx(np.median(captured.share[INNER]), rel=0.25)
    assert np.abs(mean - b.reshape((m + 1, -1))[:, pixels]).max() < STD


def test_a_step_is_not_averaged_across_and_leaves_less_to_average() -> None:
    b = picture(0.3 * (COLUMNS >= 24) + 0.0)
    beside, far = PLACES[20, 23:25], PLACES[20, 12:14]

    mean, share = averaged(b, beside, variance(b, beside))

    assert np.abs(mean - b.reshape((5, -1))[:, beside]).max() < 1e-6
    _, away = averaged(b, far, variance(b, far))
    assert (share > 1.5 * away).all()
    assert away == pytest.approx(LEAST_SHARE, rel=0.02)


def test_noise_of_the_picture_itself_is_no_structure() -> None:
    b = noisy(picture(0.0 * COLUMNS), STD / 2)
    pixels = PLACES[INNER][::4, ::4].ravel()

    _, taken_as_it_is = averaged(b, pixels, variance(b, pixels))
    _, known = averaged(b, pixels, variance(b, pixels), np.full(pixels.size, 0.25))

    assert np.median(known) < np.median(taken_as_it_is)
    assert np.median(known) < 1.5 * LEAST_SHARE
