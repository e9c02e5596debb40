"""What a reconstruction takes over from a pass, and what it computes itself."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import transientcam_moments as tm
from transientcam_moments._kernels.one_pass import Planes
from transientcam_moments.reconstruction._one_pass import PassedReconstruction

F_HZ = 23e6
PHASE_RAD = np.array([0.4, 1.0, 2.5])
SMOOTHED = 100 * np.exp(1j * np.arange(3)[:, None] * PHASE_RAD).astype(np.complex64)
MARK = np.arange(3.0)
"""Added to what the pass states, so that it shows where that is taken over."""


def passed(brightness: float = 100.0, flags: int = 0, **changes: Any) -> PassedReconstruction:
    plain = tm.Settings(base_frequency_hz=F_HZ, smoothing_sigma_px=0.0, estimator="pisarenko")
    planes = Planes(
        smoothed=SMOOTHED,
        brightness=np.full(3, brightness, np.float32),
        validity=MARK + 1,
        flags=np.full(3, flags, np.uint8),
        phase_rad=np.array([PHASE_RAD, MARK]),
        weight=np.array([[100.0] * 3, [0.0] * 3]),
        count=np.ones(3, int),
        uniform=MARK + 2,
        direct=MARK + 3,
        indirect=MARK + 4,
        range_m=MARK + 5,
    )
    return PassedReconstruction(planes, replace(plain, **changes), lambda: SMOOTHED * 2)


def test_returns_and_range_are_those_of_the_pass() -> None:
    found = passed()

    assert found.validity.tolist() == [1, 2, 3]
    assert found.uniform.tolist() == [2, 3, 4]
    assert found.direct.tolist() == [3, 4, 5]
    assert found.indirect.tolist() == [4, 5, 6]
    assert found.range_m.tolist() == [5, 6, 7]
    assert found.returns.phase_rad[0] == pytest.approx(PHASE_RAD)
    assert found.returns.weight[:, 0].tolist() == [100, 0]
    np.testing.assert_array_equal(found.measured, 2 * SMOOTHED)
    np.testing.assert_array_equal(found.smoothed, SMOOTHED)


def test_without_a_base_frequency_there_is_no_range() -> None:
    with pytest.raises(tm.UnlabelledImages):
        _ = passed(base_frequency_hz=None).range_m
    assert passed(base_frequency_hz=None).direct.tolist() == [3, 4, 5]


def test_another_estimator_takes_its_range_from_another_estimate() -> None:
    found = passed(estimator="single-frequency")

    expected_m = PHASE_RAD * tm.SPEED_OF_LIGHT_M_S / (4 * np.pi * F_HZ)
    assert found.range_m == pytest.approx(expected_m, rel=1e-5)
    assert found.direct == pytest.approx(np.full(3, 100.0), rel=1e-5)


@pytest.mark.parametrize(("zeroth", "b_0"), [("on-off", 140.0), ("estimated", 100.0)])
def test_a_measured_zeroth_moment_is_replaced_by_the_biased_one(zeroth: str, b_0: float) -> None:
    found = passed(brightness=140.0, zeroth=zeroth)

    assert found.moments[0].real == pytest.approx(np.full(3, b_0))
    np.testing.assert_array_equal(found.moments[1:], SMOOTHED[1:])
    np.testing.assert_array_equal(found.smoothed, SMOOTHED)


@pytest.mark.parametrize("flags", [0, int(tm.Flags.BIASED), 255])
def test_pixels_are_biased_where_the_pass_says_so(flags: int) -> None:
    found = passed(flags=flags)

    assert found._biased[1].tolist() == [bool(flags & int(tm.Flags.BIASED))] * 3
    assert found._shape == (2, (3,))
