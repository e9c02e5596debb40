"""Gains of a calibration."""

import numpy as np
import pytest

import transientcam_moments as tm
from transientcam_driver import SubPhases

SUB_PHASES = SubPhases("arccos", 8)


def test_dividing_by_the_gains_gives_the_moments_back() -> None:
    rng = np.random.default_rng(0)
    b = rng.normal(size=(4, 2, 3)) + 1j * rng.normal(size=(4, 2, 3))
    gain = rng.normal(size=(4, 2, 3)) + 1j * rng.normal(size=(4, 2, 3))

    assert np.allclose(tm.calibrate(b * gain, gain), b)
    assert np.allclose(tm.calibrate(b * gain[:, :1, :1], gain[:, 0, 0]), b)


def test_a_measured_calibration_keeps_the_brightness() -> None:
    rng = np.random.default_rng(1)
    gain = rng.normal(size=(3, 4)) + 1j * rng.normal(size=(3, 4))
    gain[0] = 1.0
    source = 900 * gain  # a pulse at phase 0 has equal moments (Sec. 4.2)
    b = rng.normal(size=(3, 4)) + 0j

    calibrated = tm.calibrate(b * gain, tm.calibration_of(source))

    assert np.allclose(calibrated, b)


def test_the_nominal_gain_is_that_of_the_sub_phases() -> None:
    phases, weights = SUB_PHASES.phases_rad, SUB_PHASES.weights
    gain = np.exp(-1j * np.array(phases)).mean()

    low = tm.nominal_calibration(2, phases, weights, zeroth="low-frequency")
    assert np.allclose(low, [abs(gain), gain, gain])
    assert np.allclose(tm.nominal_calibration(1, phases, weights, zeroth="on-off"), [1, gain])
    assert np.allclose(tm.nominal_calibration(1, (0.0,), None, zeroth="estimated"), [1, 1])


def test_arccos_sampling_takes_a_quarter_pi_of_the_amplitude() -> None:
    # math: |G_1| -> pi / 4 as n grows (Sec. 4.1)
    phases_rad = np.arccos(1 - (2 * np.arange(4096) + 1) / 4096)

    assert abs(tm.modulation_gain(1, phases_rad)) == pytest.approx(np.pi / 4, abs=1e-4)


def test_a_pixel_without_gain_becomes_nan_and_no_other() -> None:
    gain = np.ones((2, 3), complex)
    gain[1, 1] = 0

    calibrated = tm.calibrate(np.ones((2, 3), np.complex64), gain)

    assert calibrated.dtype == np.complex64
    assert np.isnan(calibrated[1, 1])
    assert np.isfinite(calibrated[:, [0, 2]]).all()


@pytest.mark.parametrize("dark", [0.0, -1.0])
def test_a_dark_calibration_pixel_is_nan(dark: float) -> None:
    assert np.isnan(tm.calibration_of(np.full((2, 1), dark, complex))).all()


def test_how_bright_the_source_of_a_calibration_was_is_nothing_to_its_gains() -> None:
    gain = np.array([[1.0], [0.3 - 0.4j]])

    for brightness in (1e-6, 0.5, 900.0):
        assert np.allclose(tm.calibration_of(brightness * gain), gain)


def test_wrong_shapes_and_arguments_are_refused() -> None:
    with pytest.raises(tm.ShapeError, match=r"calibration is of shape \(3,\)"):
        tm.calibrate(np.ones((2, 4), complex), np.ones(3))
    with pytest.raises(tm.ParameterError, match="harmonics = 0"):
        tm.nominal_calibration(0, zeroth="on-off")
    with pytest.raises(tm.ParameterError, match="weights"):
        tm.nominal_calibration(1, (0.0, 1.0), (1.0,), zeroth="on-off")
    with pytest.raises(tm.ParameterError, match="zeroth"):
        tm.nominal_calibration(1, zeroth="dark")
