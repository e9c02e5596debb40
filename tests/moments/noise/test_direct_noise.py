"""The kernel for the direct return's deviation, held to `return_noise`, which needs none."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.compiled_kernels import kernels, without_kernels
from transientcam_moments import noise
from transientcam_moments.noise import direct_phase_noise

PIXELS = 600


def sample(m: int, seed: int) -> tuple[tm.Returns, noise.MomentNoise]:
    """Return pixels of which some have close, faint, coinciding, missing or equal returns."""
    random = np.random.default_rng(seed)
    phase = np.sort(random.uniform(0, 2 * np.pi, (m, PIXELS)), axis=0)
    weight = random.uniform(0.05, 1, (m, PIXELS))
    if m > 1:
        phase[1, ::7] = phase[0, ::7] + 10.0 ** random.uniform(-4, -1, phase[1, ::7].size)
        phase[1, 3], weight[:, 4] = phase[0, 3], 0.5
        phase[-1, ::11], weight[-1, ::11] = np.nan, 0.0
    phase[0, 5], phase[-1, 6] = 1e-6, 2 * np.pi - 1e-6
    weight[0, ::5] *= 1e-3
    variance = 10.0 ** random.uniform(-10, -4, (m + 1, PIXELS))
    count = (weight > 0).sum(axis=0).astype(np.int32)
    shape = (20, 30)
    returns = tm.Returns(
        phase.reshape((m, *shape)),
        weight.reshape((m, *shape)),
        np.zeros(shape),
        count.reshape(shape),
    )
    return returns, noise.MomentNoise(variance.reshape((m + 1, *shape)))


@pytest.mark.parametrize("m", [1, 3])
@pytest.mark.parametrize("threshold", [0.0, 0.25, 1.0])
def test_the_kernel_states_what_return_noise_states(m: int, threshold: float) -> None:
    returns, of_moments = sample(m, seed=m)
    with without_kernels():
        expected = noise.return_noise(returns, of_moments, threshold=threshold)

    with kernels(m, precisions=("float64",), names=("direct_noise",)):
        std_rad, holds = direct_phase_noise(returns, of_moments, threshold=threshold)

    np.testing.assert_allclose(std_rad, expected.direct_phase_std_rad, rtol=1e-6)
    np.testing.assert_array_equal(holds, expected.holds)
    assert 0.05 < holds.mean() < 0.95


def test_fewer_returns_than_harmonics_are_left_to_numpy() -> None:
    returns, of_moments = sample(3, seed=1)
    two = tm.Returns(
        returns.phase_rad[:2], returns.weight[:2], returns.uniform, np.full(returns.count.shape, 2)
    )
    expected = noise.return_noise(two, of_moments)

    with kernels(2, 3, precisions=("float64",), names=("direct_noise",)):
        std_rad, holds = direct_phase_noise(two, of_moments)

    np.testing.assert_array_equal(std_rad, expected.direct_phase_std_rad)
    np.testing.assert_array_equal(holds, expected.holds)
