"""Local maxima of the density."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles


def maxima_on_a_grid(h: np.ndarray, phase: np.ndarray) -> list[np.ndarray]:
    """Phases of local maxima by looking at every sample, for each pixel."""
    higher = (h > np.roll(h, 1, axis=0)) & (h >= np.roll(h, -1, axis=0))
    return [phase[column] for column in higher.T]


@pytest.mark.parametrize("m", [1, 2, 3, 4, 8])
@pytest.mark.parametrize("epsilon", [0.004, 0.05, 0.5])
def test_all_local_maxima_are_found(m: int, epsilon: float) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 60, noise=0.1)
    b = tm.bias(b, epsilon).moments
    c = tm.levinson(b)
    phase = np.linspace(0, 2 * np.pi, 40_000, endpoint=False)

    found = tm.peaks(c, threshold=0.0)

    expected = maxima_on_a_grid(tm.density(c, phase), phase)
    for pixel, grid in enumerate(expected):
        mine = found.phase_rad[:, pixel][found.density[:, pixel] > 0]
        assert len(mine) == len(grid)
        assert oracles.around(np.sort(mine) - grid).max(initial=0) < 2e-3


def test_height_is_the_density_at_the_peak() -> None:
    b = oracles.random_moments(np.random.default_rng(0), 4, 50)
    c = tm.levinson(b)

    found = tm.peaks(c, threshold=0.0)

    for pixel in range(50):
        used = found.density[:, pixel] > 0
        one = tm.Coefficients(*(part[..., pixel] for part in c))
        there = tm.density(one, found.phase_rad[used, pixel])
        assert np.allclose(there, found.density[used, pixel], rtol=1e-8)
        assert np.isnan(found.phase_rad[~used, pixel]).all()


def test_first_and_strongest_are_picked_above_the_threshold() -> None:
    b = oracles.moments_of_returns([[1.0], [2.5], [4.5]], [[0.02], [1.0], [3.0]], 4)
    b[0] *= 1.01
    c = tm.levinson(b)

    low, high = tm.peaks(c, threshold=0.0), tm.peaks(c, threshold=1.0)

    assert low.first_rad == pytest.approx(1.0, abs=0.05)
    assert low.strongest_rad == pytest.approx(4.5, abs=0.05)
    assert high.first_rad == high.strongest_rad == low.strongest_rad
    assert np.count_nonzero(high.density) == 1


def test_sharp_peaks_are_those_of_the_returns() -> None:
    phase, weight = oracles.random_returns(
        np.random.default_rng(1), returns=3, pixels=100, apart_rad=0.3
    )
    b = oracles.moments_of_returns(phase, weight, 3)
    b[0] *= 1 + 1e-9

    found = tm.peaks(tm.levinson(b), threshold=0.0)

    assert oracles.around(found.phase_rad - phase).max() < 1e-5


def test_a_peak_at_phase_zero_is_found_once() -> None:
    for turn in (0.0, 1e-12, -1e-12):
        b = oracles.moments_of_returns([[turn], [3.0]], [[1.0], [0.5]], 2)
        b[0] += 0.01
        found = tm.peaks(tm.levinson(b), threshold=0.0)
        assert np.count_nonzero(found.density) == 2


def test_single_precision_finds_the_same_peaks() -> None:
    b = tm.bias(oracles.random_moments(np.random.default_rng(3), 3, 200, noise=0.05)).moments

    single = tm.peaks(tm.levinson(b.astype(np.complex64)))
    double = tm.peaks(tm.levinson(b))

    assert single.first_rad.dtype == np.float32
    close = oracles.around(single.strongest_rad - double.strongest_rad) < 1e-3
    assert close.mean() > 0.98  # the two highest may be equally high


def test_uniform_dark_and_invalid_pixels_have_no_peak() -> None:
    b = np.array([[1, 0, np.nan, 1], [0, 0, 0, 0.5]], complex)

    found = tm.peaks(tm.levinson(b))

    assert np.isnan(found.first_rad[:3]).all()
    assert np.isnan(found.strongest_rad[:3]).all()
    assert np.all(found.density[:, :3] == 0)
    assert found.first_rad[3] == pytest.approx(0, abs=1e-9)


def test_trailing_shapes_are_kept() -> None:
    b = oracles.random_moments(np.random.default_rng(0), 2, 6)

    found = tm.peaks(tm.levinson(b.reshape(3, 2, 3)))

    assert found.first_rad.shape == (2, 3)
    assert found.phase_rad.shape == found.density.shape == (2, 2, 3)


def test_a_wrong_threshold_is_refused() -> None:
    with pytest.raises(tm.ParameterError, match=r"threshold = -0.1"):
        tm.peaks(tm.levinson(np.array([1.0, 0.5])), threshold=-0.1)
