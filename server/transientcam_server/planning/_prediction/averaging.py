"""What averaging over neighbours that agree will leave of a pixel's noise, and mix into its light.

The test of `tm.average_neighbours` at pixels of a picture without noise, with the noise that the
capture will have: it does not depend on which noise that is, but on its size.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_moments.noise import neighbours

_Array = NDArray[Any]
PAIRS: Final = neighbours.neighbourhood(neighbours.RADII_PX[-1])
_AHEAD: Final = np.array([pair[:2] for pair in PAIRS])
_SQUARE_PX: Final = (_AHEAD**2).sum(axis=1)
_ALL: Final = np.array([1.0, *(each for pair in PAIRS for each in (pair[2], pair[2]))])
LEAST_SHARE: Final = float((_ALL**2).sum() / _ALL.sum() ** 2)
"""Of the variance, where all neighbours agree."""
_OF_MEAN: Final = 1.5
"""Variance of a pixel less the mean of two others, over that of each."""
_NORMAL: Final = np.sqrt(_OF_MEAN) * np.array([0.1, 0.31, 0.55, 0.84, 1.28, 2.0])
"""Absolute values of their difference, about as likely, in deviations of one pixel."""


def averaged(
    picture: _Array, pixels: _Array, variance: _Array, seen: _Array | float = 0.0
) -> tuple[_Array, _Array]:
    """Return mean moments (m + 1, P), and the share (P) of the variance that is left.

    ``picture`` are moments (m + 1, H, W) of all pixels, ``pixels`` (P) places in it as it lies
    flat, ``variance`` (m + 1, P) that of a captured pixel by itself, 0 where one is not measured,
    and ``seen`` (P) that of the picture over it.
    """
    m, reach = len(picture) - 1, neighbours.REACH
    places = np.stack(np.divmod(pixels, picture.shape[2]))[:, None, :, None] + reach
    rows, columns = places + np.stack([_AHEAD, -_AHEAD]).transpose(2, 0, 1)[:, :, None]
    present, margin = np.isfinite(picture).all(axis=0), ((reach, reach), (reach, reach))
    near = np.pad(np.where(present, picture, 0), ((0, 0), *margin))[:, rows, columns]
    there = np.pad(present, margin)[rows, columns]  # of both sides (2, P, pairs)
    b = picture.reshape((m + 1, -1))[:, pixels]
    scale = np.where(variance > 0, np.maximum(variance, 1e-30), np.inf)[:, None, :, None] ** -0.5
    own = scale * b[:, None, :, None]
    tangent = np.arange(m + 1)[:, None, None, None] * own
    known = np.maximum((np.abs(tangent) ** 2).sum(0), 1e-30)
    off = own - scale * near
    alone, later = (np.abs(off) ** 2).sum(0), (tangent.conj() * off).imag.sum(0)
    both = alone.sum(0) / 4 + (off[:, 0] * off[:, 1].conj()).real.sum(0) / 2
    numbers, seen = 2 * max(m, 1), np.broadcast_to(np.asarray(seen), pixels.shape)[:, None]
    shifts, paired = later**2 / known, there[::-1]
    mirrored = later.mean(0) ** 2 / known
    expected = np.where(paired, _OF_MEAN, 2) * seen  # by noise of the picture
    one = np.maximum(np.where(paired, both, alone) - numbers * expected, 0)
    two = np.maximum(np.where(paired, mirrored, shifts) - expected, 0)
    one = (one + neighbours.MISFIT_OF_ONE * alone) / numbers
    two = np.sqrt(two + neighbours.SHIFT_OF_ONE * shifts)[..., None]
    share, total, agreement = np.ones((pixels.size, 1)), np.ones(pixels.size), 1.0 * there
    for radius_px in neighbours.RADII_PX:
        place = np.maximum(1 - _SQUARE_PX / (radius_px + 0.5) ** 2, 0)
        misfit = (one / share + _OF_MEAN)[..., None] / neighbours.MOST_MISFIT
        shift = 2 / neighbours.MOST_SHIFT * (two / np.sqrt(share)[..., None] + _NORMAL) ** 2
        agreement = there * place * np.clip(2 - np.maximum(misfit, shift), 0, 1).mean(axis=-1)
        total = 1 + agreement.sum(axis=(0, 2))
        share = ((1 + (agreement**2).sum(axis=(0, 2))) / total**2)[:, None]
    mean = (b + (agreement * near).sum(axis=(1, 3))) / total
    return mean, share[:, 0]
