"""What is around each pixel."""

from typing import Any, Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

_Array = NDArray[Any]
NEIGHBOURS_PX: Final = 5
"""Side of the square of pixels whose median separates bias from noise."""


def around(plane: _Array, side_px: int = NEIGHBOURS_PX) -> _Array:
    """Return the values (H, W, side^2) around each pixel and its own; NaN where nothing is known.

    Parameters
    ----------
    plane
        (H, W), not finite where nothing is known.
    """
    known = np.where(np.isfinite(plane), plane, np.nan).astype(np.float32)
    padded = np.pad(known, side_px // 2, constant_values=np.nan)
    return sliding_window_view(padded, (side_px, side_px)).reshape((*plane.shape, -1))


def median_around(plane: _Array) -> _Array:
    """Return the median (H, W) of the finite values around each pixel; 0 where there is none."""
    ranked = np.sort(around(plane), axis=-1)  # what is not known comes last
    count = np.isfinite(ranked).sum(axis=-1)
    middle = np.maximum(count - 1, 0) // 2
    found: _Array = np.take_along_axis(ranked, middle[..., None], axis=-1)[..., 0]
    return np.nan_to_num(found)


def spread(values: _Array) -> _Array:
    """Return how far the known ones of values (H, W, N) are apart; NaN where there are none."""
    return np.asarray(np.fmax.reduce(values, axis=-1) - np.fmin.reduce(values, axis=-1))
