"""What a calibration is off at another temperature."""

import pytest

from transientcam_driver.calibration import TemperatureDrift


def test_a_camera_much_warmer_than_at_its_calibration_says_so_in_millimetres() -> None:
    drift = TemperatureDrift.between(33.6, 46.6)

    assert drift is not None
    assert drift.range_m == pytest.approx(13 * 10e-12 * 299_792_458 / 2, rel=1e-2)
    assert all(word in str(drift.warning) for word in ("33.6", "46.6", "20 mm"))


def test_a_small_difference_and_an_unknown_temperature_say_nothing() -> None:
    near = TemperatureDrift.between(30.0, 26.0)

    assert near is not None
    assert near.warning is None
    assert TemperatureDrift.between(None, 30.0) is None
    assert TemperatureDrift.between(30.0, None) is None
