"""A lens, and where a second camera stands, measured by flat walls or by a printed chessboard.

Walls need ranges alone: through the right lens they are flat. Boards need OpenCV.
"""

import importlib
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Lens
from transientcam_server.errors import InputError, MissingExtra
from transientcam_server.imaging._recipe.lens import Intrinsics

_Array = NDArray[Any]
_PIXELS: Final = 32
"""Along the shorter side, by which a wall is judged."""
_WALL_M: Final = 0.01
"""What deviates by more counts less: it may be no wall."""
_LEAST_BOARDS: Final = 3


def lens_of_walls(ranges: Sequence[_Array], start: Intrinsics) -> tuple[Lens, float]:
    """Return the lens through which walls are flattest, and the median deviation in m.

    Parameters
    ----------
    ranges
        (H, W) in m, each of one flat wall that fills the image, NaN without a return.
    start
        The lens as far as it is known, and where the light is, which stays.

    Raises
    ------
    InputError
        If less than half of the pixels have a range.
    """
    from scipy.optimize import least_squares  # which a daemon need not load

    step = max(1, min(ranges[0].shape) // _PIXELS)
    seen = np.stack([each[::step, ::step] for each in ranges])
    if (share := np.isfinite(seen).mean()) < 0.5:
        raise InputError("--lens", "wall", f"seen by {share:.0%} of the pixels", "seen by half")

    def lens_of(found: _Array, step: int = 1) -> Lens:
        pinhole, bent = (found[:4] / step).tolist(), (*found[4:8].tolist(), 0.0)
        return Lens(*pinhole, bent, *start.lens.light_m)

    def off_m(found: _Array) -> _Array:
        x, y = lens_of(found, step).slopes(*seen.shape[:0:-1])
        rays = np.stack([x, y, np.ones_like(x)])
        points = rays / np.tensordot(found[8:].reshape(-1, 3), rays, 1)[:, np.newaxis]
        light = np.reshape(start.lens.light_m, (3, 1, 1))
        path_m = np.linalg.norm(points, axis=1) + np.linalg.norm(points - light, axis=1)
        off = np.nan_to_num(path_m / 2.0 - seen, nan=1.0)  # a lens without a ray there is wrong
        return np.where(np.isfinite(seen), off, 0.0).ravel()

    planes = [[0.0, 0.0, 1.0 / np.nanmedian(each)] for each in seen]  # their points p: plane p = 1
    bent = (*start.distortion, 0.0, 0.0, 0.0, 0.0)[:4]
    first = np.concatenate([[start.fx, start.fy, start.cx, start.cy, *bent], *planes])
    scale = np.concatenate([[start.fx] * 4, [1.0] * (first.size - 4)])
    # what is no wall counts little, and once the wall is found nearly nothing
    rough = least_squares(off_m, first, x_scale=scale, loss="soft_l1", f_scale=_WALL_M)
    fit = least_squares(off_m, rough.x, x_scale=scale, loss="cauchy", f_scale=_WALL_M)
    return lens_of(fit.x), float(np.median(np.abs(off_m(fit.x))))


def lens_of_boards(
    pictures: Sequence[_Array], corners: tuple[int, int], square_m: float, known: Intrinsics
) -> tuple[Lens, float, list[_Array | None]]:
    """Return the lens that shows a chessboard, its deviation in pixels, and where the board was.

    Parameters
    ----------
    pictures
        Brightness (H, W), in any unit, of a board at different places and angles.
    corners, square_m
        Inner corners along both sides of the board, and the side of a square.
    known
        Says where the light is.

    Returns
    -------
    With the lens, for each picture the pose of the board in the camera, (4, 4) in m, or None.

    Raises
    ------
    MissingExtra
        If OpenCV is not installed.
    InputError
        If less than three pictures show the board.
    """
    try:
        cv2 = importlib.import_module("cv2")
    except ModuleNotFoundError as error:
        raise MissingExtra("finding a board", "opencv-python-headless", "lens") from error
    places = [_corners(cv2, each, corners) for each in pictures]
    shown = [each for each in places if each is not None]
    if len(shown) < _LEAST_BOARDS:
        found, least = f"found in {len(shown)} pictures", f"in at least {_LEAST_BOARDS}"
        raise InputError("--lens", "board", found, least)
    flat = np.mgrid[: corners[0], : corners[1], :1].T.reshape(-1, 3).astype(np.float32) * square_m
    size = pictures[0].shape[::-1]
    # of k3 the corners of few pixels say nothing, and where no board was it folds the image
    rms_px, k, bent, *poses = cv2.calibrateCamera(
        [flat] * len(shown), shown, size, None, None, flags=cv2.CALIB_FIX_K3
    )
    pinhole = k[0, 0], k[1, 1], k[0, 2], k[1, 2]
    lens = Lens(*map(float, pinhole), tuple(bent.ravel().tolist()), *known.lens.light_m)
    each = (_pose(cv2, *pose) for pose in zip(*poses, strict=True))
    return lens, float(rms_px), [None if place is None else next(each) for place in places]


def second_in_first(first: Sequence[_Array | None], second: Sequence[_Array | None]) -> _Array:
    """Return the pose (4, 4) in m of a second camera in the first, by boards that both see.

    Raises
    ------
    InputError
        If they see none together.
    """
    pairs = zip(first, second, strict=True)
    both = [a @ np.linalg.inv(b) for a, b in pairs if a is not None and b is not None]
    if not both:
        raise InputError("--second", "board", "seen by no more than one camera", "seen by both")
    mean: _Array = np.mean(both, axis=0)
    u, _, v = np.linalg.svd(mean[:3, :3])
    mean[:3, :3] = u @ v  # the nearest rotation
    return mean


def _corners(cv2: Any, picture: _Array, corners: tuple[int, int]) -> _Array | None:
    """Return the corners (N, 1, 2) in pixels; None where no board is seen."""
    low, high = np.nanpercentile(picture, (1, 99))
    grey = np.clip((np.nan_to_num(picture) - low) / max(high - low, 1e-30), 0.0, 1.0)
    found, places = cv2.findChessboardCornersSB((255.0 * grey).astype(np.uint8), corners)
    return places if found else None


def _pose(cv2: Any, turn: _Array, place: _Array) -> _Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(turn)[0], place.ravel()
    return pose
