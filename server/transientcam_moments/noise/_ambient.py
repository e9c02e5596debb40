"""Light that is not the camera's: what images hold beside the modulated light.

The mean of the images of one frequency over whole periods of its phase is dark + b_0 / 2 + ambient,
as the modulation adds up to nothing (Sec. 3.1). Moments do not show ambient light, but its shot
noise is in them.
"""

from typing import Final

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.images import smooth
from transientcam_moments.noise._sensor import ImageNoise, Sensor

_LOOKED_AT: Final = 4096
"""Pixels, spread evenly, that say whether there is ambient light."""
_DEVIATIONS: Final = 5.0
_COUNTS: Final = 0.1
"""Part of the variance of an image that ambient light must add to count."""
_FEW: Final = 0.01
"""Share of the pixels that is let pass: single pixels have other dark levels."""


def ambient_light(
    images: Array,
    brightness: Array,
    sensor: Sensor | ImageNoise,
    *,
    sigma_px: float = 0.0,
    bad_pixels: Array | None = None,
) -> Array | None:
    """Return the light (...) in DN an image that is not the camera's.

    Parameters
    ----------
    images : array, shape (P, ...)
        Of one frequency, at phases that are spread evenly over a period.
    brightness : array, shape (...)
        b_0 in DN, smoothed; NaN where it is not known.
    sensor : Sensor or ImageNoise
        Its dark level is that of the images.
    sigma_px : float
        With which the brightness was smoothed: so is the mean of the images.
    bad_pixels : boolean array, shape (...), optional
        Pixels whose images say nothing.

    Returns
    -------
    array, shape (...), or None
        At least 0. None where there is hardly any: where no more than one pixel in a hundred has so
        much that it stands clear of the noise and adds a tenth to the variance of an image.

    Notes
    -----
    Where b_0 is estimated, what it falls short of counts as ambient light, too: noise does not
    tell them apart. An image that others differ from by more than noise (out of step, in motion)
    leaves a part of the modulation in the mean.
    """
    if not _any(images, brightness, sensor):
        return None
    signal = images.mean(axis=0, dtype=brightness.dtype) - sensor.dark_dn
    if bad_pixels is not None:
        signal[bad_pixels] = np.nan  # which smoothing fills in
    if sigma_px > 0 and signal.ndim == 2:
        signal = smooth(signal[None], sigma_px)[0]
    return np.maximum(np.nan_to_num(signal - brightness / 2), 0).astype(brightness.dtype)


def _any(images: Array, brightness: Array, sensor: Sensor | ImageNoise) -> bool:
    """Whether more pixels have clearly more light than b_0 explains than have clearly less."""
    flat = brightness.reshape(-1)
    step = max(1, flat.size // _LOOKED_AT)
    half = np.maximum(flat[::step], 0) / 2
    signal = images.reshape((len(images), -1))[:, ::step].mean(axis=0) - sensor.dark_dn
    variance = sensor.image_variance(half)
    least = np.maximum(
        _DEVIATIONS * np.sqrt(variance / len(images)), _COUNTS * variance * sensor.gain_e_per_dn
    )
    with np.errstate(invalid="ignore"):
        more = np.count_nonzero(signal - half > least)
        less = np.count_nonzero(half - signal > least)
    return bool(more - less > _FEW * half.size)
