"""How much a measured value differs from frame to frame."""

from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam.frame import Frame

FRAMES: Final = 16
"""How many frames are compared."""
_SAME: Final = ("sequence_id", "calibration_id", "reconstruction_id", "region", "decimation")


class Scatter:
    """The standard deviation of a product over its last `FRAMES` frames.

    What moves in the scene is in it, too.
    """

    def __init__(self) -> None:
        self._arrays: deque[NDArray[np.float64]] = deque(maxlen=FRAMES)
        self._settings: tuple[object, ...] | None = None

    def add(self, frame: Frame) -> float | None:
        """Return the median over the pixels of the standard deviation, in the product's unit.

        None until there are `FRAMES` frames of the same settings, and where no pixel has a value in
        all of them.
        """
        settings = tuple(frame.meta.get(name) for name in _SAME)
        if settings != self._settings:
            self._settings = settings
            self._arrays.clear()
        self._arrays.append(np.asarray(frame.array, dtype=np.float64))
        if len(self._arrays) < FRAMES:
            return None
        deviation = np.std(np.stack(self._arrays), axis=0, ddof=1)
        finite = deviation[np.isfinite(deviation)]
        return float(np.median(finite)) if finite.size else None
