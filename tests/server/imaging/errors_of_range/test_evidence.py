"""Motion, shadow, edges and too much light, on pictures whose geometry is given."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import RawFrame, Sequence
from transientcam_driver.camera import Lamp
from transientcam_server.imaging import Intrinsics
from transientcam_server.imaging._errors_of_range.evidence import (
    around,
    brighter_than_white,
    edges_and_strays,
    median_around,
    moved,
    shadowed,
    spread,
)

WIDTH, HEIGHT = 60, 40
LENS = Intrinsics.of_field(60.0, width=WIDTH, height=HEIGHT)
SENSOR = tm.noise.Sensor()
Array = NDArray[np.float64]


def plane_m(depth_m: float, aside_m: float = 0.0) -> Array:
    """Ranges of a plane across the line of sight, the lamp so far to the right."""
    x, y = np.meshgrid(*((np.arange(n) - (n - 1) / 2) / LENS.fx for n in (WIDTH, HEIGHT)))
    there, back = (np.sqrt(1 + (x - at) ** 2 + y * y) for at in (aside_m / depth_m, 0.0))
    return np.asarray(depth_m * (there + back) / 2, dtype=np.float64)


def lamp(x_m: float, exponent: float = 0.0) -> Lamp:
    return Lamp((x_m, 0.0, 0.0), (0.0, 0.0, 1.0), exponent, 1e6)


def test_a_plate_throws_its_shadow_to_the_side_where_the_lamp_is_not() -> None:
    """By similar triangles: the plate's edge at x, seen from a lamp aside, is on the wall at x'."""
    wall_m, plate_m, aside_m = 2.0, 1.2, 0.3
    range_m, near = plane_m(wall_m, aside_m), plane_m(plate_m, aside_m)
    inside = np.s_[14:26, 24:36]
    range_m[inside] = near[inside]

    found = shadowed(replace(LENS, light_x_m=aside_m), range_m, 0.02 * range_m)

    x_m = wall_m * (np.arange(WIDTH) - (WIDTH - 1) / 2) / LENS.fx
    left_m, right_m = (plate_m * ((edge - 0.5) - (WIDTH - 1) / 2) / LENS.fx for edge in (24, 36))
    low_m, high_m = (aside_m + (each - aside_m) * wall_m / plate_m for each in (left_m, right_m))
    expected = (x_m > low_m) & (x_m < high_m)
    expected[24:36] = False  # what the plate hides is not seen
    row = found[20]
    assert expected.sum() >= 4
    assert (row != expected).sum() <= 2  # by half a pixel at either end
    assert not found[:10].any()
    assert not found[inside].any()


def test_nothing_throws_a_shadow_on_an_empty_wall_or_behind_a_lamp_in_the_lens() -> None:
    range_m = plane_m(2.0)
    assert not shadowed(replace(LENS, light_x_m=0.3), range_m, 0.02 * range_m).any()
    range_m[10:20, 10:20] = plane_m(1.0)[10:20, 10:20]
    assert not shadowed(LENS, range_m, 0.02 * range_m).any()


def test_a_wall_beside_the_beam_is_too_bright_and_one_in_it_is_not() -> None:
    exposure_s, albedo, exponent = 1e-3, 0.9, 40.0
    range_m = plane_m(2.0)
    narrow = lamp(0.0, exponent)
    points_m = LENS.points(range_m)
    way_m = np.sqrt((points_m**2).sum(axis=0))
    cosine = points_m[2] / way_m
    direct_dn = 1e6 * exposure_s * albedo * cosine * cosine**exponent / way_m**2
    around_dn = 0.2 * direct_dn.max()

    found = brighter_than_white(narrow, points_m, direct_dn + around_dn, exposure_s)

    assert not brighter_than_white(narrow, points_m, direct_dn, exposure_s).any()
    truly = around_dn > 2 * direct_dn
    assert found[truly].mean() > 0.95
    assert not found[cosine > 0.99].any()


def test_a_highlight_is_bright_and_not_too_bright() -> None:
    points_m = LENS.points(plane_m(2.0))
    bright_dn = lamp(0.0).white_dn_per_s(points_m) * 1e-3 * 0.5
    bright_dn[18:22, 28:32] *= 10

    assert not brighter_than_white(lamp(0.0), points_m, bright_dn, 1e-3).any()


def test_edges_are_where_the_range_has_a_step_and_where_dim_pixels_are_beside_one() -> None:
    range_m = np.full((HEIGHT, WIDTH), 2.0)
    range_m[:, 30:] = 1.0
    std_m, bright_dn = np.full(range_m.shape, 1e-3), np.full(range_m.shape, 900.0)
    bright_dn[:, :30] = 100.0
    range_m[5, 5] = 3.0

    edge, stray = edges_and_strays(range_m, std_m, bright_dn)

    assert edge[10:, 28:31].all()
    assert not edge[10:, :27].any()
    assert not edge[10:, 33:].any()
    assert stray[5, 5]
    assert stray.sum() == 1


def test_noise_makes_no_edge() -> None:
    random = np.random.default_rng(2)
    range_m = random.normal(2.0, 0.1, (HEIGHT, WIDTH))

    edge, stray = edges_and_strays(
        range_m, np.full(range_m.shape, 0.1), np.full(range_m.shape, 500.0)
    )

    assert not edge.any()
    assert not stray.any()


def frame(change: Array, *, late: int = -1) -> RawFrame:
    """A capture of even light in which pixels change in its second half, and one image is late."""
    random = np.random.default_rng(3)
    labels = Sequence(harmonics=3).labels
    images = np.empty((len(labels), HEIGHT, WIDTH))
    for index, label in enumerate(labels):
        light_dn = 400.0 * (1 + change * (index >= len(labels) / 2))
        turn = label.phase_rad + (1.0 if index == late else 0.0)
        mean_dn = 64 + light_dn * (1 + 0.8 * np.cos(turn - 0.4 * label.harmonic)) / 2
        images[index] = random.normal(mean_dn, np.sqrt((mean_dn - 64) / 9 + (30 / 9) ** 2))
    return RawFrame(1, 1, np.rint(images).astype(np.uint16), labels, 0.0, 0.0, 0.1, 25.0, 0)


def test_pixels_whose_light_changes_during_the_capture_have_moved() -> None:
    change = np.zeros((HEIGHT, WIDTH))
    change[10:20, 10:20] = 0.5

    found = moved(frame(change), SENSOR)

    assert found[10:20, 10:20].all()
    assert not found[change == 0].any()


@pytest.mark.parametrize("late", [-1, 8])
def test_still_light_has_not_moved_even_where_an_image_is_out_of_step(late: int) -> None:
    found = moved(frame(np.zeros((HEIGHT, WIDTH)), late=late), SENSOR)

    assert not found.any()


def test_values_that_are_not_known_spread_nothing() -> None:
    plane = np.array([[1.0, np.nan, 4.0], [np.nan, np.nan, np.nan], [np.inf, np.nan, np.nan]])

    found = spread(around(plane, 3))

    np.testing.assert_array_equal(found, [[0, 3, 0], [0, 3, 0], [np.nan, np.nan, np.nan]])


@pytest.mark.parametrize("step", [1, 2])
def test_the_median_around_a_pixel_is_that_of_its_finite_neighbours(step: int) -> None:
    random = np.random.default_rng(1)
    plane = random.normal(size=(9, 11)).astype(np.float32)
    plane[random.random(plane.shape) < 0.4] = np.nan
    plane[:, 8:] = np.nan

    found = median_around(plane, step)

    for y in range(9):
        for x in range(11):
            rows, columns = (
                [p for p in range(at - 2 * step, at + 2 * step + 1, step) if 0 <= p < size]
                for at, size in ((y, 9), (x, 11))
            )
            window = plane[np.ix_(rows, columns)]
            ranked = np.sort(window[np.isfinite(window)])
            expected = ranked[(ranked.size - 1) // 2] if ranked.size else 0.0
            assert found[y, x] == expected
