"""Smoothing moment images over neighbouring pixels (Sec. 6)."""

from functools import lru_cache

import numpy as np

from transientcam_moments._dispatch import accelerated
from transientcam_moments.arrays import Array, as_array, in_range, namespace, real_type
from transientcam_moments.errors import ShapeError

SIGMA_PX = 0.6
"""The paper's standard deviation in pixels."""


def smooth(moments: Array, sigma_px: float = SIGMA_PX) -> Array:
    """Smooth moment images with a Gaussian over the last two axes.

    Parameters
    ----------
    moments : array, shape (..., H, W)
        Moments (or any real or complex images).
    sigma_px : float
        Standard deviation in pixels, 0 to 100; 0 returns the moments as they are.

    Returns
    -------
    array, shape (..., H, W)
        Beyond the border there is nothing, and a pixel that isn't finite counts as nothing for its
        neighbours: the weights of the others are normalised. It stays as it is itself, in all
        planes of the moments.

    Raises
    ------
    ShapeError
        When there are fewer than two axes.
    ParameterError
        When `sigma_px` is not in 0 to 100.
    """
    in_range("sigma_px", sigma_px, 0.0, 100.0, "0 to 100 pixels")
    moments = as_array(moments)
    if moments.ndim < 2:
        raise ShapeError("moments", f"of shape {tuple(moments.shape)}", "(..., H, W)")
    if sigma_px == 0:
        return moments
    return _smooth(moments, gaussian_taps(sigma_px))


@accelerated("smooth", of="F")
def _smooth(moments: Array, taps: Array) -> Array:
    """Planar statement of `smooth`."""
    xp = namespace(moments)
    present = xp.isfinite(moments).reshape((-1, *moments.shape[-2:])).all(axis=0)
    share = _blur(present.astype(real_type(moments)), taps)
    smoothed = _blur(xp.where(present, moments, 0), taps)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = xp.where(present, 1 / share, 1).astype(share.dtype)
    return xp.where(present, smoothed * inverse, moments).astype(moments.dtype)


@lru_cache(maxsize=64)
def gaussian_taps(sigma_px: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return the weights along one axis, shape (2 R + 1,), R = ceil(4 sigma_px), of sum 1.

    They cannot be written to: all calls share them.
    """
    taps = np.ones(1)
    if sigma_px > 0:
        radius = int(np.ceil(4 * sigma_px))
        taps = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma_px) ** 2)
        taps /= taps.sum()
    taps.flags.writeable = False
    return taps


def _blur(images: Array, taps: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Array:
    """Convolve the last two axes with `taps`, zero beyond the border."""
    xp = namespace(images)
    radius = len(taps) // 2
    for axis in (-1, -2):
        pad = [(0, 0)] * images.ndim
        pad[axis] = (radius, radius)
        padded = xp.pad(images, pad)
        size = images.shape[axis]
        total = None
        for shift, tap in enumerate(taps.tolist()):
            part = padded[..., shift : shift + size]
            if axis == -2:
                part = padded[..., shift : shift + size, :]
            total = part * tap if total is None else total + part * tap
        images = total
    return images
