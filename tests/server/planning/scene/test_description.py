"""What frames say of a device and a scene, by closed forms."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_server.planning._scene import description
from transientcam_server.planning._scene.description import FrameAverages

C_M_S = 299_792_458.0
HZ = 20e6
SHAPE = 6, 8


def averages(gains: NDArray[Any] | None, nominal: tuple[complex, ...] = (1, 1)) -> FrameAverages:
    """Return frames of nothing, whose recipe has these gains."""
    recipe = SimpleNamespace(
        nominal_gains=np.array(nominal),
        gains=None if gains is None else SimpleNamespace(planes=gains),
        settings=SimpleNamespace(gaussian_px=None),
        base_frequency_hz=HZ,
    )
    none = np.zeros((len(nominal), *SHAPE))
    planes = none, none, none, none, None, none, none[0], none[0], none[0] > 0
    return FrameAverages(cast(Any, recipe), cast(Any, None), 1, *cast(Any, planes))


def test_without_a_calibration_ranges_are_off_by_half_the_way_that_light_is_late() -> None:
    delay_s = 0.7e-9
    late = np.exp(-2j * np.pi * HZ * delay_s * np.arange(2))[:, None, None] * np.ones(SHAPE)

    assert averages(late).uncalibrated_m == pytest.approx(C_M_S * delay_s / 2, rel=1e-5)
    assert averages(3j * late, (3j, 3j)).uncalibrated_m == pytest.approx(C_M_S * delay_s / 2)


def test_nominal_gains_are_not_off_nor_are_gains_of_one_pixel_for_all() -> None:
    assert averages(None).uncalibrated_m == 0.0
    assert averages(np.ones((2, *SHAPE)) + 0j).uncalibrated_m == pytest.approx(0.0, abs=1e-9)
    assert averages(np.full((2, 1, 1), 1j)).uncalibrated_m == 0.0


def test_contrast_is_that_of_the_median_pixel_over_the_nominal_one() -> None:
    gains = np.ones((3, *SHAPE), complex)
    gains[2] = 0.3j * np.linspace(0.5, 1.5, gains[2].size).reshape(SHAPE)

    assert averages(gains, (1, 1, 0.5)).contrast == pytest.approx([1.0, 1.0, 0.6])


def test_the_brightest_leave_out_one_pixel_in_a_thousand() -> None:
    light = np.arange(10_001.0).reshape((1, -1))
    seen = averages(None)
    object.__setattr__(seen, "highest_dn", light)

    assert seen.brightest_dn() == pytest.approx(9990.0)
    assert seen.brightest_dn(light < 1001) == pytest.approx(999.0)


def test_as_many_pixels_are_dim_as_have_a_fifth_of_what_bright_ones_have_at_one_range() -> None:
    range_m = np.repeat([1.0, 2.0], 50)
    light = np.where(np.arange(100) % 50 < 20, 0.19, 1.0) / range_m**2

    assert description.dim_share(light, range_m) == pytest.approx(0.4)
    assert description.dim_share(light * 0 + 1.0, np.ones(100)) == 0.0
    assert description.dim_share(np.where(light * range_m**2 < 1, 0.21, 1.0), np.ones(100)) == 0.0


def test_what_all_pixels_lose_alike_is_the_cameras() -> None:
    variance = np.full((4, 400), 1e-4)
    b = np.array([1.0, 1.0, 0.6, 0.2])[:, None] * np.exp(1j * np.linspace(0, 6, 400))

    assert description.contrast_of_picture(100 * b, variance) == pytest.approx(
        [1.0, 1.0, 0.6, 0.2], abs=1e-4
    )
    assert description.contrast_of_picture(1e-3 * b, variance)[1:] == pytest.approx(0.01)


@pytest.mark.parametrize("count", [5, 40])
def test_pixels_that_stand_for_others_change_as_fast_as_the_faster_half(count: int) -> None:
    swings = np.arange(1001.0)[None]

    found = np.sort(description._typical_swings(swings, count))

    assert found == pytest.approx(1000 - 500 * (np.arange(count)[::-1] + 0.5) / count)
