"""A lens measured by a printed board, a chessboard or ChArUco, in pictures of its brightness."""

import re
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Lens
from transientcam_server.errors import InputError, MissingExtra

_Array = NDArray[Any]
_BOARD: Final = re.compile(r"(charuco:)?(\d\d?)x(\d\d?)")
_LONGER_PX: Final = 1000
"""Smaller pictures are enlarged to about this, in which corners are found more often."""
_APART: Final = 0.17
"""Between boards in rad: what stands alike tells focal lengths that may be wrong by any factor."""


class Board:
    """A printed board: ``9x6`` of inner corners across and down, or ``charuco:7x5`` of squares.

    ChArUco has markers of `DICT_4X4`, 0.7 of a square long.
    Raises InputError where the text names none; MissingExtra where OpenCV is not installed.
    """

    def __init__(self, text: str) -> None:
        try:
            import cv2
        except ModuleNotFoundError as error:
            raise MissingExtra("--board", "cv2", "board") from error
        found = _BOARD.fullmatch(text)
        across, down = map(int, found.groups()[1:]) if found else (0, 0)
        if found is None or not 3 <= min(across, down) <= max(across, down) <= 40:
            raise InputError("--board", "value", text, "9x6 or charuco:7x5, each from 3 to 40")
        self._cv2: Any = cv2
        self._size = across, down
        self._charuco: Any = None
        if found[1]:
            markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)
            board = cv2.aruco.CharucoBoard(self._size, 1.0, 0.7, markers)
            self._charuco = cv2.aruco.CharucoDetector(board)

    def corners(self, picture: _Array) -> tuple[_Array, _Array] | None:
        """Return corners (C, 3) in squares, and where a picture (H, W) has them (C, 2) in pixels.

        None where it does not show the board: a chessboard whole, of ChArUco 6 corners.
        """
        scale = max(1, round(_LONGER_PX / max(picture.shape)))
        light = np.nan_to_num(picture)
        white = max(np.percentile(light, 99), np.finfo(np.float32).tiny)
        grey = (255 * np.clip(light / white, 0.0, 1.0)).astype(np.uint8)
        grey = self._cv2.resize(grey, None, fx=scale, fy=scale, interpolation=self._cv2.INTER_CUBIC)
        known: Any = np.mgrid[: self._size[0], : self._size[1], :1].T
        if self._charuco is None:
            _, seen = self._cv2.findChessboardCornersSB(grey, self._size)
        else:
            seen, ids, *_ = self._charuco.detectBoard(grey)
            if seen is not None:
                known, seen = self._charuco.getBoard().matchImagePoints(seen, ids)
        if seen is None or len(seen) < 6:
            return None
        return known.reshape(-1, 3), (seen.reshape(-1, 2) + 0.5) / scale - 0.5

    def lens(self, pictures: Sequence[_Array], start: Lens) -> tuple[Lens, dict[str, Any]]:
        """Return the lens that took pictures (H, W), with the light of ``start``, and figures.

        These are how many show the board, how far its corners are off, and the standard deviations
        of fx, fy, cx and cy. Raises InputError for less than 3, or boards that stand alike.
        """
        height, width = pictures[0].shape
        shown = [each for each in map(self.corners, pictures) if each is not None]
        tilted = "in 3 or more, tilted by 10 degrees or more"
        if len(shown) < 3:  # as Zhang's method needs
            raise InputError("--board", "shown", f"in {len(shown)} pictures", tilted)
        known, seen = zip(*((a.astype("f4"), b.astype("f4")) for a, b in shown), strict=True)
        try:
            off_px, k, bent, turns, _, deviations, *_ = self._cv2.calibrateCameraExtended(
                known, seen, (width, height), None, None, flags=self._cv2.CALIB_FIX_K3
            )
        except self._cv2.error as error:
            raise InputError("--board", "corners", str(error), "usable") from error
        normals = np.stack([self._cv2.Rodrigues(each)[0][:, 2] for each in turns])
        apart = float(np.arccos(np.clip((normals @ normals.T).min(), -1.0, 1.0)))
        if apart < _APART:
            said = f"in {len(shown)} pictures, within {np.degrees(apart):.0f} degrees"
            raise InputError("--board", "shown", said, tilted)
        fx, fy, cx, cy = k[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
        lens = Lens(fx, fy, cx, cy, tuple(bent.ravel()[:5].tolist()), *start.light_m)
        deviations_px = deviations.ravel()[:4].tolist()
        return lens, {
            "pictures": len(shown),
            "deviation_px": off_px,
            "standard_deviation_px": deviations_px,
        }
