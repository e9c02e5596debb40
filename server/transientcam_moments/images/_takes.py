"""Averaging repeated takes without the outliers among them (Sec. 6)."""

from typing import NamedTuple

import numpy as np

from transientcam_moments.arrays import Array, as_array, namespace, summary
from transientcam_moments.errors import ParameterError, ShapeError

_CLIP = 32  # a pixel counts at most as this many times the typical difference


class Average(NamedTuple):
    """Averaged images.

    Attributes
    ----------
    images : array, shape (N, ...)
        Means over the takes that were kept.
    kept : boolean array, shape (takes, N)
        Which image of which take was kept.
    """

    images: Array
    kept: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def average_takes(
    images: Array, *, outlier_factor: float = 3.0, left_out: Array | None = None
) -> Average:
    """Average takes, discarding whole images that differ from the others of their configuration.

    Parameters
    ----------
    images : array, shape (takes, N, ...)
        The same N images taken repeatedly.
    outlier_factor : float
        An image is an outlier when its mean absolute difference from the median over the takes is
        more than this many times the median of that figure over the takes, > 1. With fewer than
        three takes the wrong one cannot be identified, and all are kept.
    left_out : boolean array, shape (takes, N), optional
        Images known to be wrong, which are left out as well; never all takes of an image.

    Returns
    -------
    Average

    Raises
    ------
    ShapeError
        When there are fewer than two axes.
    ParameterError
        For an `outlier_factor` that isn't above 1.

    Notes
    -----
    Sec. 6: 5 to 10 % of the prototype's images were off because of synchronisation. A single wild
    or non-finite pixel decides nothing: differences are clipped, NaN counts as no difference.
    """
    images = as_array(images)
    if images.ndim < 2 or images.shape[0] < 1:
        raise ShapeError("images", f"of shape {tuple(images.shape)}", "(takes, N, ...)")
    if not outlier_factor > 1:
        raise ParameterError("outlier_factor", outlier_factor, "> 1")
    xp = namespace(images)
    kept = xp.ones(images.shape[:2], dtype=bool)
    if images.shape[0] == 1:
        return Average(images[0], kept)
    real = images if np.dtype(images.dtype).kind == "f" else images.astype(xp.float32)
    if images.shape[0] >= 3:
        difference = _difference(real)
        typical = xp.median(difference, axis=0)
        # equal takes differ by nothing; rounding is not an outlier
        slack = 4 * float(np.finfo(real.dtype).eps) * _level(real)
        kept = difference <= outlier_factor * typical + slack
    if left_out is not None:
        kept = xp.where((kept & ~left_out).any(axis=0), kept & ~left_out, ~left_out)
    weight = kept.astype(real.dtype)
    weight = (weight / weight.sum(axis=0)).reshape(kept.shape + (1,) * (real.ndim - 2))
    masked = xp.where(weight > 0, real, 0)
    return Average((masked * weight).sum(axis=0), kept)


def _difference(images: Array) -> Array:
    """Return the clipped mean absolute difference from the median take, shape (takes, N)."""
    xp = namespace(images)
    flat = images.reshape((*images.shape[:2], -1))
    distance = abs(flat - xp.median(flat, axis=0))
    distance = xp.where(xp.isfinite(distance), distance, 0)
    typical = xp.median(distance.mean(axis=2), axis=0)
    return xp.minimum(distance, _CLIP * typical[None, :, None]).mean(axis=2)


def _level(images: Array) -> Array:
    """Return the typical magnitude of each image, shape (N)."""
    xp = namespace(images)
    flat = abs(images.reshape((*images.shape[:2], -1)))
    return xp.where(xp.isfinite(flat), flat, 0).mean(axis=2).min(axis=0)
