"""Lenses and poses that are measured, of walls made by their geometry."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import Lens
from transientcam_server.errors import InputError
from transientcam_server.imaging import Intrinsics, beam_of_wall, lens_of_walls, second_in_first

WIDTH, HEIGHT = 163, 120
SIZE: dict[str, Any] = {"width": WIDTH, "height": HEIGHT}
TRUE = Lens(150.0, 153.0, 84.0, 57.0, (0.09, -0.2, 0.002, -0.003, 0.0), 0.05, -0.02, 0.0)
KNOWN = replace(Intrinsics.of_field(45.0, **SIZE), light_x_m=0.05, light_y_m=-0.02)
WALLS = np.array([(0.0, 0.0, 1.0), (0.4, 0.1, 0.9), (-0.2, 0.4, 0.9)]) / 1.5


def ranges_of(plane: NDArray[np.float64]) -> NDArray[np.float64]:
    """Ranges of a wall with noise, a dead pixel and something that stands before it."""
    random = np.random.default_rng(1)
    x, y = TRUE.slopes(**SIZE)
    rays = np.stack([x, y, np.ones_like(x)])
    points = rays / np.tensordot(plane, rays, 1)
    path_m = np.linalg.norm(points, axis=0)
    path_m += np.linalg.norm(points - np.reshape(TRUE.light_m, (3, 1, 1)), axis=0)
    range_m = path_m / 2.0 + random.normal(0.0, 0.002, path_m.shape)
    range_m[30, 40], range_m[90:, :20] = np.nan, 1.0
    return np.asarray(range_m)


def test_walls_from_several_sides_say_how_the_lens_is_and_where_they_are() -> None:
    lens, off_m, found = lens_of_walls([*map(ranges_of, WALLS)], KNOWN)

    for ours, true in zip(lens.slopes(**SIZE), TRUE.slopes(**SIZE), strict=True):
        assert np.abs(ours - true).max() < 0.01
    assert lens.light_m == TRUE.light_m
    assert off_m < 0.002
    np.testing.assert_allclose(found, WALLS, atol=0.005)


def test_one_white_wall_says_how_the_light_falls_off_and_how_bright_it_is() -> None:
    """By the law of the beam itself: a slanted wall, of which a part has no range."""
    axis = np.array([0.3, -0.1, 1.0]) / np.sqrt(1.1)
    known = Intrinsics.of_lens(TRUE, **SIZE, source="camera")
    range_m = ranges_of(WALLS[1])
    points = np.moveaxis(known.points(range_m), 0, -1)
    way = points - TRUE.light_m
    far_m = np.linalg.norm(way, axis=-1)
    facing = (way @ WALLS[1]) / (far_m * np.linalg.norm(WALLS[1]))
    light_dn = 2e6 * 1e-3 * (way @ axis / far_m) ** 12 * facing / far_m**2

    *found_axis, exponent, white_dn_per_s = beam_of_wall(range_m, light_dn, 1e-3, known)

    np.testing.assert_allclose(found_axis, axis, atol=0.01)
    assert exponent == pytest.approx(12.0, rel=0.05)
    assert white_dn_per_s == pytest.approx(2e6, rel=0.05)
    striped = light_dn * np.where(np.arange(WIDTH) % 4 < 2, 1.0, 0.6)
    bent_m = range_m * np.linspace(1.0, 1.5, HEIGHT)[:, None] ** 4
    for seen_m, seen_dn, why in (
        (np.full((HEIGHT, WIDTH), np.nan), light_dn, "seen by half"),
        (range_m, striped, "brighter or darker"),
        (bent_m, light_dn, "off a plane in"),
    ):
        with pytest.raises(InputError, match=why):
            beam_of_wall(seen_m, seen_dn, 1e-3, known)


def test_the_beam_of_light_that_is_as_bright_everywhere_points_ahead() -> None:
    known = Intrinsics.of_lens(replace(TRUE, light_x_m=0.0, light_y_m=0.0), **SIZE, source="camera")
    range_m = known.points(np.ones((HEIGHT, WIDTH)))[2] ** -1.0  # of a wall at z = 1 m
    light_dn = 2e3 / range_m**3  # facing, and as far

    found = beam_of_wall(range_m, light_dn, 1e-3, known)

    assert found == pytest.approx((0.0, 0.0, 1.0, 0.0, 2e6), rel=1e-4)


def test_a_wall_that_is_hardly_seen_is_refused() -> None:
    hidden = np.full((HEIGHT, WIDTH), np.nan)
    hidden[:40] = 1.0

    with pytest.raises(InputError, match=r"wall is seen by 3\d%"):
        lens_of_walls([hidden], KNOWN)


def test_walls_in_three_directions_say_where_a_second_camera_stands() -> None:
    turn_rad, place = 0.7, np.array([0.3, -0.1, 0.05])
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(turn_rad), -np.sin(turn_rad)], [np.sin(turn_rad), np.cos(turn_rad)]]
    # a point q before the second camera is turn q + place before the first
    theirs = WALLS @ turn / (1.0 - WALLS @ place)[:, np.newaxis]

    found = second_in_first(WALLS, theirs)

    np.testing.assert_allclose(found[:3, :3], turn, atol=1e-9)
    np.testing.assert_allclose(found[:, 3], [*place, 1.0], atol=1e-9)
    for few in (WALLS[:2], WALLS[[0, 1, 1]]):
        with pytest.raises(InputError, match="too few sides"):
            second_in_first(few, few)
