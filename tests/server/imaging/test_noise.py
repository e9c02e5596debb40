"""Invalid pixels are those whose moments contradict each other by more than noise explains."""

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_server.imaging.noise import invalid_share

SHAPE = (40, 50)
STD_DN = 2.0


def moments(phase_error_rad: tuple[float, ...], *, seed: int = 1) -> NDArray[np.complex64]:
    """Moments of one return a pixel, with noise, and an error of each harmonic's phase."""
    random = np.random.default_rng(seed)
    phase_rad = random.uniform(0.5, 5.5, SHAPE)
    exact = [
        800.0 * np.exp(1j * (j * phase_rad + error)) for j, error in enumerate(phase_error_rad)
    ]
    noise = random.normal(0.0, STD_DN, (2, len(exact), *SHAPE))
    b = np.stack(exact) + noise[0] + 1j * noise[1]
    b[0] = b[0].real
    return np.asarray(b, dtype=np.complex64)


def share(b: NDArray[np.complex64]) -> float | None:
    found = tm.reconstruct(b, tm.Settings(smoothing_sigma_px=0.0))
    noise = tm.noise.MomentNoise(np.full((len(b), *SHAPE), 2 * STD_DN**2))
    return invalid_share(found, noise)


def test_noise_alone_makes_hardly_any_pixel_invalid() -> None:
    assert share(moments((0.0, 0.0, 0.0, 0.0))) == pytest.approx(0.0, abs=0.005)


def test_a_phase_that_all_harmonics_share_alike_is_a_delay_and_no_contradiction() -> None:
    assert share(moments((0.0, 0.1, 0.2, 0.3))) == pytest.approx(0.0, abs=0.005)


def test_a_harmonic_whose_phase_has_drifted_makes_nearly_all_invalid() -> None:
    """arg b_2 = 2 arg b_1 for one return: 0.1 rad off cannot be the moments of any light."""
    few = share(moments((0.0, 0.0, 0.01, 0.0)))
    most = share(moments((0.0, 0.0, 0.1, 0.0)))

    assert few is not None
    assert most is not None
    assert few < 0.1
    assert most > 0.9


def test_more_light_than_there_is_is_a_contradiction() -> None:
    b = moments((0.0, 0.0, 0.0, 0.0))
    b[2] *= 1.1  # |b_2| <= b_0

    invalid = share(b)

    assert invalid is not None
    assert invalid > 0.9


def test_pixels_without_light_are_not_counted() -> None:
    b = moments((0.0, 0.0, 0.0, 0.0))
    b[:, :20] = 0.0

    assert share(b) == pytest.approx(0.0, abs=0.005)
    assert share(np.zeros_like(b)) is None
