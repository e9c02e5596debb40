"""What kernels need at the borders of an image and of their vectors."""

from functools import lru_cache
from typing import Any

import numpy as np

from transientcam_moments._dispatch import LEAST_PIXELS
from transientcam_moments._kernels.arrays import Booleans, Reals

LEAST_WIDTH = LEAST_PIXELS // 2  # of an image: its rows hold real and imaginary parts
RAMP = np.arange(LEAST_PIXELS, dtype=np.float32)
"""Places within a vector."""


def row_length(width: int, taps: int) -> int:
    """Return the room that smoothing needs for a row: margins for the taps, and for a register."""
    return 2 * width + 2 * (taps - 1) + LEAST_PIXELS


def normalisation(present: Booleans, taps: Reals) -> Any:
    """Return one over the weights that pixels which are there have, NaN for those that aren't."""
    if present.all():
        return _of_whole_images(*present.shape, taps.tobytes())
    return _inverse_share(present, taps)


@lru_cache(maxsize=4)
def _of_whole_images(height: int, width: int, taps: bytes) -> Any:
    return _inverse_share(np.ones((height, width), bool), np.frombuffer(taps))


def _inverse_share(present: Booleans, taps: Reals) -> Any:
    share = present.astype(float)
    for axis in (0, 1):
        share = np.apply_along_axis(_blurred, axis, share, taps)
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = np.where(present, 1 / share, np.nan)
    return np.repeat(weight.reshape(-1), 2).astype(np.float32)


def _blurred(row: Reals, taps: Reals) -> Any:
    radius = taps.size // 2
    return np.convolve(row, taps)[radius : radius + row.size]
