"""Phase to range."""

import numpy as np
import pytest

import transientcam_moments as tm


def test_a_turn_is_the_unambiguous_range() -> None:
    assert tm.range_m(2 * np.pi, 23e6) == pytest.approx(6.517, abs=1e-3)
    assert tm.range_m(2 * np.pi, 23e6) == pytest.approx(tm.SPEED_OF_LIGHT_M_S / (2 * 23e6))


def test_a_time_of_flight_is_half_its_way() -> None:
    tau_s = 20e-9

    assert tm.range_m(2 * np.pi * 23e6 * tau_s, 23e6) == pytest.approx(2.998, abs=1e-3)


def test_shape_precision_and_nan_stay() -> None:
    phase = np.array([[1.0, np.nan]], np.float32)

    found = tm.range_m(phase, 23e6)

    assert found.shape == (1, 2)
    assert found.dtype == np.float32
    assert np.isnan(found[0, 1])


@pytest.mark.parametrize("frequency", [0.0, -1.0, float("inf"), float("nan")])
def test_a_frequency_that_is_none_is_refused(frequency: float) -> None:
    with pytest.raises(tm.ParameterError, match="base_frequency_hz"):
        tm.range_m(1.0, frequency)
