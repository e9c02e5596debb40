"""The share of noise in a deviation that holds errors of calibration, against drawn captures."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments import oracles

Array = NDArray[Any]
DRAWS = 4000
ERROR = 0.01


def stated_over_measured(b: Array, variance: Array, returns: int, seed: int) -> float:
    """Return the deviation that one capture of moments (m + 1, 1) states over that of many."""
    noise = tm.noise.MomentNoise(variance)
    drawn = tm.noise.draw(b, noise, np.random.default_rng(seed), draws=DRAWS)[:, :, 0]
    repeated = tm.noise.MomentNoise(np.broadcast_to(variance, drawn.shape))
    found = tm.likelihood(drawn, repeated, returns=returns, tail_shape=0, model_error=ERROR)
    share = tm.noise.scatter(drawn, repeated, range(len(b)), ERROR)
    assert (share < 1).all()
    stated = np.median(share * found.direct_phase_std_rad())
    return float(stated / found.separate().phase_rad.std())


@pytest.mark.parametrize("noise_std", [2.0, 10.0, 50.0])
@pytest.mark.parametrize("slope", [0.0, 0.5])
def test_captures_of_one_return_scatter_by_the_noise_alone(noise_std: float, slope: float) -> None:
    b = 1000.0 * oracles.moments_of_returns([[1.3]], [[1.0]], 4)
    std = noise_std * (1 + slope * np.arange(5))[:, None]

    assert stated_over_measured(b, std**2, 1, seed=3) == pytest.approx(1, rel=0.05)


def test_captures_of_two_returns_scatter_by_the_noise_alone() -> None:
    b = 1000.0 * oracles.moments_of_returns([[1.0], [3.0]], [[0.6], [0.4]], 5)

    assert stated_over_measured(b, np.full((6, 1), 9.0), 2, seed=4) == pytest.approx(1, rel=0.1)


def test_what_was_not_measured_has_no_share() -> None:
    b = np.full((3, 4), 100.0 + 0j)
    variance = np.full((3, 4), 1.0)
    variance[0] = 0.0
    variance[1, 1] = np.inf
    variance[1:, 2] = np.nan
    b[0] = 1e9

    share = tm.noise.scatter(b, tm.noise.MomentNoise(variance), (0, 1, 2), ERROR)

    np.testing.assert_allclose(share[[0, 1, 3]], np.sqrt(0.5))
    assert np.isnan(share[2])


def test_of_a_reconstruction_it_is_that_of_each_of_its_pixels() -> None:
    random = np.random.default_rng(5)
    b = 1500.0 * oracles.moments_of_returns(random.uniform(1, 2, (1, 6, 7)), np.ones((1, 6, 7)), 3)
    b = b + random.normal(0, 3, b.shape)
    b[:, 2, 2] = 0
    settings = tm.Settings(
        23e6,
        zeroth="low-frequency",
        takes=4,
        estimator="likelihood",
        sensor=tm.noise.Sensor(),
        smoothing_sigma_px=0.0,
    )
    found = tm.Reconstruction(b, settings)

    scatter_m = found.range_scatter_m()

    dark = 2 * 7 + 2
    assert np.isnan(scatter_m[dark])
    lit = np.delete(np.arange(6 * 7), dark)
    assert (scatter_m[lit] < found.range_std_m.ravel()[lit]).all()
    np.testing.assert_array_equal(found.range_scatter_m(lit[::3]), scatter_m[lit[::3]])


def test_without_a_sensor_nothing_is_added_that_could_be_left_out() -> None:
    b = oracles.moments_of_returns(np.full((1, 6, 7), 1.5), np.ones((1, 6, 7)), 3)
    settings = tm.Settings(23e6, zeroth="low-frequency", estimator="likelihood")
    found = tm.Reconstruction(b, settings)

    np.testing.assert_array_equal(found.range_scatter_m(), found.range_std_m.ravel())
