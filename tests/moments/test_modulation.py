"""Sinusoidal modulation by phase steps."""

from pathlib import Path

import numpy as np
import pytest

import transientcam_moments as tm


@pytest.mark.parametrize("n", [1, 2, 3, 8])
def test_harmonic_cancellation_cancels_odd_harmonics_up_to_2n_minus_1(n: int) -> None:
    phases, weights = tm.harmonic_cancellation_sub_phases(n)
    odd = np.arange(3, 2 * n, 2)

    assert weights.sum() == pytest.approx(1)
    assert np.abs(tm.modulation_gain(odd, phases, weights)).max(initial=0) < 1e-14
    assert abs(tm.modulation_gain(2 * n + 1, phases, weights)) > 0.3


def test_arccos_sampling_leaves_even_harmonics_as_theory_says() -> None:
    phases, weights = tm.arccos_sub_phases(20000)
    even = np.array([2, 4, 6])

    assert np.allclose(tm.modulation_gain(even, phases, weights), 1 / (1 - even**2), atol=1e-4)


def test_arccos_sampling_with_eight_steps_leaves_known_odd_harmonics() -> None:
    gains = np.abs(tm.modulation_gain(np.array([3, 5, 7]), *tm.arccos_sub_phases(8)))

    assert np.abs(gains - [0.0255, 0.0175, 0.0346]).max() < 5e-5


def test_effective_modulation_of_a_square_wave_is_its_series_times_the_gain() -> None:
    n = 1 << 12
    square = np.where((np.arange(n) + 0.5) < n / 2, 1.0, -1.0)
    harmonics = tm.effective_modulation(square, (0.0,))

    k = np.array([1, 3, 5])
    assert np.allclose(np.abs(harmonics[k]), 2 / (np.pi * k), rtol=1e-4)
    assert tm.harmonic_distortion(harmonics) == pytest.approx(np.sqrt(np.pi**2 / 8 - 1), rel=1e-2)


def test_even_harmonics_count_only_without_four_buckets() -> None:
    assert tm.harmonic_distortion(np.array([9, 1, 0.5, 0.25])) == pytest.approx(0.25)
    whole = tm.harmonic_distortion(np.array([9, 1, 0.5, 0.25]), four_bucket=False)
    assert whole == pytest.approx(np.hypot(0.5, 0.25))


@pytest.mark.data
def test_distortion_of_a_measured_correlation_falls_as_published(data_dir: Path) -> None:
    waveforms = np.load(data_dir / "modulation" / "keatof_2MHz_ham-k3_min.npy")
    rows = waveforms[::2] - waveforms[1::2]  # opposite pairs: the four-bucket difference

    def distortion(phases: np.ndarray, weights: np.ndarray) -> float:
        harmonics = tm.effective_modulation(rows, phases, weights)
        return float(tm.harmonic_distortion(harmonics).mean())

    raw = distortion(np.zeros(1), np.ones(1))
    cancelled = distortion(*tm.harmonic_cancellation_sub_phases(3))
    arccos = distortion(*tm.arccos_sub_phases(8))
    assert np.abs(np.array([raw, cancelled, arccos]) - [0.194, 0.018, 0.007]).max() < 5e-4


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(tm.ParameterError, match="n = 0"):
        tm.arccos_sub_phases(0)
    with pytest.raises(tm.ParameterError, match="n = -1"):
        tm.harmonic_cancellation_sub_phases(-1)
    with pytest.raises(tm.ParameterError, match="sub_phases_rad"):
        tm.modulation_gain(1, ())
    with pytest.raises(tm.ShapeError, match="at least 3 samples"):
        tm.effective_modulation(np.zeros(2), (0.0,))
