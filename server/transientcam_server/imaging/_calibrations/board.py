"""A lens measured by a printed board, a chessboard or ChArUco, in pictures of its brightness."""

import re
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Lens
from transientcam_server.errors import InputError, MissingExtra

_Array = NDArray[Any]
_BOARD: Final = re.compile(r"(charuco:)?(\d{1,2})x(\d{1,2})")
_LONGER_PX: Final = 1000
"""Smaller pictures are enlarged to about this, in which corners are found more often."""
_MARKER: Final = 0.7
_PICTURES: Final = 3


class Board:
    """A printed board.

    ``9x6`` is a chessboard with so many inner corners across and down; ``charuco:7x5`` has so many
    squares, and markers of `DICT_4X4_250` in its white ones, 0.7 as long.

    Raises
    ------
    InputError
        If the text names none.
    MissingExtra
        If OpenCV is not installed.
    """

    def __init__(self, text: str) -> None:
        try:
            import cv2
        except ModuleNotFoundError as error:
            raise MissingExtra("--board", "cv2", "board") from error
        found = _BOARD.fullmatch(text)
        across, down = map(int, found.groups()[1:]) if found else (0, 0)
        if found is None or min(across, down) < 3:
            raise InputError("--board", "value", text, "9x6 or charuco:7x5, each from 3 to 99")
        self._cv2: Any = cv2
        self._size = across, down
        self._charuco: Any = None
        if found[1]:
            markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
            board = cv2.aruco.CharucoBoard(self._size, 1.0, _MARKER, markers)
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
        if self._charuco is None:
            _, seen = self._cv2.findChessboardCornersSB(grey, self._size)
            across, down = self._size
            known: Any = np.mgrid[:across, :down, :1].T.reshape(-1, 3).astype(np.float32)
        else:
            seen, ids, *_ = self._charuco.detectBoard(grey)
            if seen is None or len(seen) < 6:
                return None
            known, seen = self._charuco.getBoard().matchImagePoints(seen, ids)
        if seen is None:
            return None
        return known.reshape(-1, 3), (seen.reshape(-1, 2) + 0.5) / scale - 0.5

    def lens(
        self, found: Sequence[tuple[_Array, _Array]], start: Lens, *, width: int, height: int
    ) -> tuple[Lens, float, dict[str, float]]:
        """Return the lens by `corners` of pictures of a size, and how far these are off, in pixels.

        Also the standard deviations of its focal lengths and principal point, in pixels. It keeps
        the light of ``start``.

        Raises
        ------
        InputError
            If there are less than 3 pictures.
        """
        if len(found) < _PICTURES:
            raise InputError("--board", "pictures that show it", str(len(found)), "3 or more")
        known, seen = zip(*((a.astype("f4"), b.astype("f4")) for a, b in found), strict=True)
        off_px, k, bent, _, _, deviations, *_ = self._cv2.calibrateCameraExtended(
            known, seen, (width, height), None, None, flags=self._cv2.CALIB_FIX_K3
        )
        names = "fx", "fy", "cx", "cy"
        values = [float(k[row, column]) for row, column in ((0, 0), (1, 1), (0, 2), (1, 2))]
        lens = Lens(*values, tuple(bent.ravel().tolist()[:5]), *start.light_m)
        return lens, float(off_px), dict(zip(names, deviations.ravel().tolist(), strict=False))
