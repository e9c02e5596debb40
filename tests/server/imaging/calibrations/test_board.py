"""A lens by a printed board: pictures of it in closed form, through a lens that is known."""

import sys
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import Lens
from transientcam_server.errors import InputError, MissingExtra
from transientcam_server.imaging import Board

WIDTH, HEIGHT, FINER = 320, 240, 3
LENS = Lens(260.0, 262.0, 164.0, 116.5, (-0.12, 0.03, 0.001, -0.002, 0.0), 0.04)
START = Lens(200.0, 200.0, 159.5, 119.5, (), 0.04)
SQUARE_M = 0.05
SIDES = [(0.3, 0.0), (-0.3, 0.1), (0.1, 0.4), (0.0, -0.4), (0.35, 0.3), (-0.25, -0.3)]
"""By how much the board is turned about x and y, in rad."""


def chessboard(across: NDArray[Any], down: NDArray[Any]) -> NDArray[Any]:
    """Brightness of a board of 10 x 7 squares on white paper, by places in squares."""
    on_it = (across > 0) & (across < 10) & (down > 0) & (down < 7)
    dark = (np.floor(across) + np.floor(down)) % 2 == 0
    return np.where(on_it & dark, 0.05, 0.9)


def charuco(across: NDArray[Any], down: NDArray[Any]) -> NDArray[Any]:
    """The same of OpenCV's own picture of a board of 10 x 7 squares."""
    markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    drawn = cv2.aruco.CharucoBoard((10, 7), 1.0, 0.7, markers).generateImage((600, 420))
    on_it = (across > 0) & (across < 10) & (down > 0) & (down < 7)
    row, column = (np.clip(each * 60, 0, most - 1) for each, most in ((down, 420), (across, 600)))
    return np.where(on_it, drawn[row.astype(int), column.astype(int)] / 255, 0.9)


@lru_cache
def rays_of_parts() -> tuple[NDArray[Any], NDArray[Any]]:
    """Slopes of the parts of pixels, `FINER` by `FINER` of each."""
    middle = (FINER - 1) / 2
    fine = Lens(
        LENS.fx * FINER,
        LENS.fy * FINER,
        LENS.cx * FINER + middle,
        LENS.cy * FINER + middle,
        LENS.distortion,
    )
    return fine.slopes(WIDTH * FINER, HEIGHT * FINER)


def picture(paint: Any, about_x: float, about_y: float) -> NDArray[np.float32]:
    """Return what the camera sees of a board 0.6 m ahead, in DN: where each ray meets its plane."""
    x, y = rays_of_parts()
    turned, _ = cv2.Rodrigues(np.array([about_x, about_y, 0.1]))
    centre = np.array([0.0, 0.0, 0.6])
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    far = (turned[:, 2] @ centre) / (rays @ turned[:, 2])
    on_board = (rays * far[..., None] - centre) @ turned / SQUARE_M
    bright = paint(on_board[..., 0] + 5, on_board[..., 1] + 3.5)
    pooled = bright.reshape(HEIGHT, FINER, WIDTH, FINER).mean((1, 3))
    noise = np.random.default_rng(1).normal(0.0, 0.01, pooled.shape)
    return np.asarray(400 * (pooled + noise), np.float32)


@pytest.mark.parametrize(("name", "paint"), [("9x6", chessboard), ("charuco:10x7", charuco)])
def test_pictures_of_a_board_give_the_lens_they_were_taken_through(name: str, paint: Any) -> None:
    pictures = [picture(paint, *side) for side in SIDES]

    lens, figures = Board(name).lens([*pictures, 0 * pictures[0]], START)

    assert figures["pictures"] == len(SIDES)
    assert figures["deviation_px"] < 0.25
    deviations = figures["standard_deviation_px"]
    for field, deviation in zip(("fx", "fy", "cx", "cy"), deviations, strict=True):
        assert abs(getattr(lens, field) - getattr(LENS, field)) < 1.5
        assert 0.0 < deviation < 1.0
    assert lens.distortion[0] == pytest.approx(-0.12, abs=0.02)
    assert lens.light_m == START.light_m
    across, down = lens.slopes(WIDTH, HEIGHT)
    true_across, true_down = LENS.slopes(WIDTH, HEIGHT)
    part = np.s_[40:200, 60:260]  # where the board was shown
    assert np.nanmax(np.hypot(across - true_across, down - true_down)[part]) < 0.004


@pytest.mark.parametrize("empty", [0.0, 50.0, np.nan])
@pytest.mark.parametrize("name", ["9x6", "charuco:10x7"])
def test_a_picture_without_a_board_has_no_corners(name: str, empty: float) -> None:
    assert Board(name).corners(np.full((HEIGHT, WIDTH), empty, np.float32)) is None


@pytest.mark.parametrize(
    "text", ["", "9", "2x6", "9x6x3", "9X6", "aruco:9x6", "-9x6", "41x9", "charuco:9x99"]
)
def test_what_is_no_board_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="--board"):
        Board(text)


def test_too_few_pictures_are_refused() -> None:
    empty = np.zeros((HEIGHT, WIDTH))

    with pytest.raises(InputError, match=r"in 0 pictures.*3 or more"):
        Board("9x6").lens([empty] * 4, START)


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_boards_that_stand_alike_are_refused(tilt: float) -> None:
    pictures = [picture(chessboard, tilt, 0.0)] * 4

    with pytest.raises(InputError, match="in 4 pictures, within 0 degrees"):
        Board("9x6").lens(pictures, START)


def test_corners_on_one_line_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    line = np.stack([np.arange(9.0), np.zeros(9), np.zeros(9)], axis=1)
    board = Board("9x6")
    monkeypatch.setattr(board, "corners", lambda _: (line, 20 * line[:, :2]))

    with pytest.raises(InputError, match="--board"):
        board.lens([np.zeros((HEIGHT, WIDTH))] * 3, START)


def test_the_largest_board_has_markers_enough() -> None:
    Board("charuco:40x40")


def test_without_opencv_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)

    with pytest.raises(MissingExtra, match=r"transientcam\[board\]"):
        Board("9x6")
