"""Lenses and poses that are measured, of walls and boards made by their geometry."""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import Lens
from transientcam_server.errors import InputError, MissingExtra
from transientcam_server.imaging import (
    Intrinsics,
    lens_of_boards,
    lens_of_walls,
    second_in_first,
)

WIDTH, HEIGHT = 163, 120
SIZE: dict[str, Any] = {"width": WIDTH, "height": HEIGHT}
TRUE = Lens(150.0, 153.0, 84.0, 57.0, (0.09, -0.2, 0.002, -0.003, 0.0), 0.05, -0.02, 0.0)
KNOWN = replace(Intrinsics.of_field(45.0, **SIZE), light_x_m=0.05, light_y_m=-0.02)
CORNERS, SQUARE_M = (7, 5), 0.06
RANDOM = np.random.default_rng(1)


def wall(normal: tuple[float, float, float], away_m: float = 1.5) -> NDArray[np.float64]:
    """Ranges of a wall with noise, a dead pixel and something that stands before it."""
    x, y = TRUE.slopes(**SIZE)
    rays = np.stack([x, y, np.ones_like(x)])
    points = away_m * rays / np.tensordot(normal, rays, 1)
    path_m = np.linalg.norm(points, axis=0)
    path_m += np.linalg.norm(points - np.reshape(TRUE.light_m, (3, 1, 1)), axis=0)
    range_m = path_m / 2.0 + RANDOM.normal(0.0, 0.002, path_m.shape)
    range_m[30, 40], range_m[90:, :20] = np.nan, 1.0
    return range_m


def pose(turn_rad: tuple[float, float, float], place_m: tuple[float, ...]) -> NDArray[np.float64]:
    """A pose by turns around x, y and z."""
    found = np.eye(4)
    for axis, turn in enumerate(turn_rad):
        one = np.eye(3)
        a, b = (axis + 1) % 3, (axis + 2) % 3
        one[a, a] = one[b, b] = np.cos(turn)
        one[a, b], one[b, a] = -np.sin(turn), np.sin(turn)
        found[:3, :3] = one @ found[:3, :3]
    found[:3, 3] = place_m
    return found


BOARDS = [
    pose((0.5, 0.0, 0.05), (-0.19, -0.12, 0.8)),
    pose((0.0, 0.5, 0.1), (-0.21, -0.15, 0.8)),
    pose((0.1, -0.5, 0.0), (-0.13, -0.1, 0.9)),
    pose((0.3, -0.3, 0.0), (-0.38, -0.26, 0.85)),
    pose((-0.3, 0.3, 0.0), (0.0, 0.0, 0.85)),
    pose((0.3, 0.3, 0.0), (-0.38, 0.02, 0.85)),
    pose((-0.3, -0.3, 0.0), (0.02, -0.26, 0.85)),
]


def picture(board: NDArray[np.float64], lens: Lens = TRUE) -> NDArray[np.float64]:
    """Brightness of a chessboard whose first inner corner is the origin of its pose, in DN."""
    fine = 3
    large = replace(lens, fx=fine * lens.fx, fy=fine * lens.fy, cx=fine * lens.cx + (fine - 1) / 2,
                    cy=fine * lens.cy + (fine - 1) / 2)  # fmt: skip
    x, y = large.slopes(fine * WIDTH, fine * HEIGHT)
    rays = np.stack([x, y, np.ones_like(x)], -1)
    normal, origin = board[:3, 2], board[:3, 3]
    points = rays * ((normal @ origin) / (rays @ normal))[..., np.newaxis]
    i, j, _ = np.moveaxis((points - origin) @ board[:3, :3], -1, 0) / SQUARE_M
    on = (np.abs(i - 3.0) < 4.0) & (np.abs(j - 2.0) < 3.0)
    dark = on & ((np.floor(i) + np.floor(j)) % 2 == 0)
    shown = np.where(dark, 300.0, 4000.0).reshape(HEIGHT, fine, WIDTH, fine).mean((1, 3))
    return shown + RANDOM.normal(0.0, 20.0, shown.shape)


def assert_looks_alike(found: Lens, within: float) -> None:
    for ours, true in zip(found.slopes(**SIZE), TRUE.slopes(**SIZE), strict=True):
        assert np.abs(ours - true).max() < within


def test_walls_from_several_sides_say_how_the_lens_is() -> None:
    walls = [wall(normal) for normal in ((0.0, 0.0, 1.0), (0.4, 0.1, 0.9), (-0.2, 0.4, 0.9))]

    lens, off_m = lens_of_walls(walls, KNOWN)

    assert_looks_alike(lens, 0.006)
    assert lens.light_m == TRUE.light_m
    assert off_m < 0.002


def test_a_wall_that_is_hardly_seen_is_refused() -> None:
    hidden = np.full((HEIGHT, WIDTH), np.nan)
    hidden[:40] = 1.0

    with pytest.raises(InputError, match=r"wall is seen by 3\d%"):
        lens_of_walls([hidden], KNOWN)


def test_boards_say_how_the_lens_is_and_where_a_second_camera_stands() -> None:
    aside = pose((0.0, 0.1, 0.02), (0.15, 0.01, -0.02))  # of the second camera in the first
    other = Lens(140.0, 140.0, 81.0, 59.5)
    pictures = [*map(picture, BOARDS), np.full((HEIGHT, WIDTH), 100.0)]
    seen = [picture(np.linalg.inv(aside) @ board, other) for board in BOARDS]

    lens, off_px, poses = lens_of_boards(pictures, CORNERS, SQUARE_M, KNOWN)
    _, _, theirs = lens_of_boards([*seen, pictures[-1]], CORNERS, SQUARE_M, KNOWN)
    found = second_in_first(poses, theirs)

    assert off_px < 0.2
    assert_looks_alike(lens, 0.03)
    assert lens.light_m == TRUE.light_m
    assert poses[-1] is None
    np.testing.assert_allclose(found[:3, 3], aside[:3, 3], atol=0.03)
    np.testing.assert_allclose(found[:3, :3] @ found[:3, :3].T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(found[:3, :3], aside[:3, :3], atol=0.02)


def test_too_few_boards_are_refused() -> None:
    with pytest.raises(InputError, match="found in 1 pictures"):
        lens_of_boards([picture(BOARDS[0])] + [np.ones((HEIGHT, WIDTH))] * 3, CORNERS, 0.06, KNOWN)
    with pytest.raises(InputError, match="both"):
        second_in_first([np.eye(4), None], [None, np.eye(4)])


def test_boards_need_opencv(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)

    with pytest.raises(MissingExtra, match=r"transientcam\[lens\]"):
        lens_of_boards([np.ones((HEIGHT, WIDTH))], CORNERS, SQUARE_M, KNOWN)
