"""What phase steps within an exposure leave of a modulation, with the driver's phase steps."""

from pathlib import Path

import numpy as np
import pytest

import transientcam_moments as tm
from transientcam_driver import SubPhases


def gain(harmonic: int | np.ndarray, steps: SubPhases) -> np.ndarray:
    return np.asarray(tm.modulation_gain(harmonic, steps.phases_rad, np.array(steps.weights)))


@pytest.mark.parametrize("n", [1, 2, 3, 8])
def test_harmonic_cancellation_cancels_odd_harmonics_up_to_2n_minus_1(n: int) -> None:
    steps = SubPhases("harmonic-cancellation", n)
    odd = np.arange(3, 2 * n, 2)

    assert np.abs(gain(odd, steps)).max(initial=0) < 1e-14
    assert abs(gain(2 * n + 1, steps)) > 0.3


def test_arccos_sampling_leaves_even_harmonics_as_theory_says() -> None:
    even = np.array([2, 4, 6])
    n = 20000
    phases_rad = np.arccos(1 - (2 * np.arange(n) + 1) / n)  # Eq. (3)

    assert np.allclose(tm.modulation_gain(even, phases_rad), 1 / (1 - even**2), atol=1e-4)


def test_arccos_sampling_with_eight_steps_leaves_known_odd_harmonics() -> None:
    gains = np.abs(gain(np.array([3, 5, 7]), SubPhases("arccos", 8)))

    assert np.abs(gains - [0.0255, 0.0175, 0.0346]).max() < 5e-5


@pytest.mark.data
def test_distortion_of_a_measured_correlation_falls_as_published(data_dir: Path) -> None:
    waveforms = np.load(data_dir / "modulation" / "keatof_2MHz_ham-k3_min.npy")
    rows = waveforms[::2] - waveforms[1::2]  # opposite pairs: the four-bucket difference

    def distortion(steps: SubPhases) -> float:
        harmonics = np.fft.rfft(rows, axis=-1)
        size = np.abs(harmonics * gain(np.arange(harmonics.shape[-1]), steps))
        return float((np.sqrt((size[:, 3::2] ** 2).sum(axis=-1)) / size[:, 1]).mean())

    found = [
        distortion(SubPhases("none")),
        distortion(SubPhases("harmonic-cancellation", 3)),
        distortion(SubPhases("arccos", 8)),
    ]
    assert np.abs(np.array(found) - [0.194, 0.018, 0.007]).max() < 5e-4


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(tm.ParameterError, match="sub_phases_rad"):
        tm.modulation_gain(1, ())
    with pytest.raises(tm.ParameterError, match="weights"):
        tm.modulation_gain(1, (0.0, 1.0), np.ones(3))
