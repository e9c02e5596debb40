"""The deviation between few captures, held against captures of which it is known."""

import numpy as np
import pytest

from transientcam_server.imaging import typical_deviation

STD = 3e-3
PIXELS = 40_000


@pytest.mark.parametrize("captures", [2, 3, 4, 5, 6, 8, 12, 13, 30])
def test_half_of_the_pixels_lie_above_the_deviation_of_normal_captures(captures: int) -> None:
    random = np.random.default_rng(captures)
    ranges_m = 2.0 + STD * random.standard_normal((captures, PIXELS))

    std_m = typical_deviation(ranges_m)

    # half of 40000 to three standard deviations
    assert (std_m > STD).mean() == pytest.approx(0.5, abs=3 * 0.5 / np.sqrt(PIXELS) + 0.003)


@pytest.mark.parametrize("missing", [0, 1, 4, 5])
def test_a_capture_that_is_missing_changes_nothing_in_the_median_pixel(missing: int) -> None:
    random = np.random.default_rng(7)
    ranges_m = STD * random.standard_normal((8, PIXELS))
    ranges_m[random.permutation(8)[:missing]] = np.nan

    assert np.median(typical_deviation(ranges_m)) == pytest.approx(STD, rel=0.02)


def test_a_pixel_with_fewer_than_two_captures_has_none() -> None:
    ranges_m = np.full((4, 3), np.nan)
    ranges_m[0, 1] = 1.0
    ranges_m[1:3, 2] = (1.0, 1.0 + STD)

    std_m = typical_deviation(ranges_m)

    assert np.isnan(std_m[:2]).all()
    assert std_m[2] == pytest.approx(STD / (np.sqrt(2) * 0.674490))


def test_strays_do_not_blow_it_up() -> None:
    random = np.random.default_rng(9)
    ranges_m = STD * random.standard_normal((20, PIXELS))
    ranges_m[0] += 1.0

    assert np.median(typical_deviation(ranges_m)) == pytest.approx(STD, rel=0.15)
