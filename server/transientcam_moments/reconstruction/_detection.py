"""Whether a pixel's moments are more than noise: else their phases, and a range, mean nothing."""

from collections.abc import Callable
from typing import Final

import numpy as np

from transientcam_moments.arrays import Array, squared
from transientcam_moments.likelihood import chi_square_quantile
from transientcam_moments.noise import MomentNoise, smoothed_at

FALSE_ALARMS: Final = 0.005
"""Share of the pixels without light that are taken for lit."""


def undetected(moments: Array, noise: MomentNoise) -> Array:
    """Say which pixels have moments b_1 .. b_m that are no more than noise.

    Parameters
    ----------
    moments : array, shape (m + 1, ...)
        Calibrated; b_0 is not looked at, as light that is not the camera's may be in it.
    noise : MomentNoise
        Theirs, (m + 1, ...).

    Returns
    -------
    boolean array, shape (...)
        Where sum_j |b_j|^2 / variance_j, which is chi-square with 2 m degrees of freedom without a
        signal, is not above what noise exceeds in `FALSE_ALARMS` of the pixels. False where a
        moment is not finite.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        energy = (squared(moments[1:]) / noise.variance[1:]).sum(axis=0)
    return energy < _limit(len(moments) - 1)


def undetected_pixels(
    moments: Array, brightness: Array, noise_of: Callable[..., MomentNoise], sigma_px: float,
    calibration: Array | None, ambient: Array | None, share: Array | None = None,
) -> Array | None:  # fmt: skip
    """Return what `undetected` does of smoothed moments (m + 1, ...), quickly where most are lit.

    ``noise_of`` returns the noise of moments that no gain was taken out of, as `smoothed_of` takes
    it, ``ambient`` is in DN an image, and ``share`` what averaging has left of a pixel's variance,
    where that was no Gaussian. None where there is no such pixel.

    Smoothing leaves no more noise than a pixel with its brightness has by itself: a pixel whose
    b_1 alone is above that is lit, and needs no look at its neighbours.
    """
    planes = len(moments)
    size = np.ones(planes) if calibration is None else squared(np.asarray(calibration) + 0j)
    of_light = noise_of(np.eye(3)[1], ambient=np.eye(3)[2]).variance[1]
    dark, lit, other = (_limit(planes - 1) * of_light).tolist()
    with np.errstate(invalid="ignore", over="ignore"):
        most = dark + (lit - dark) * np.maximum(brightness, 0)
        if ambient is not None:
            most = most + (other - dark) * ambient
        doubtful = np.flatnonzero(~(squared(moments[1]) * size[1] >= most))
    if not doubtful.size:
        return None
    if moments.ndim == 3 and sigma_px > 0:
        noise = smoothed_at(noise_of, brightness, doubtful, sigma_px, ambient=ambient).variance
    else:
        light = brightness.reshape(-1)[doubtful]
        other = 0.0 if ambient is None else ambient.reshape(-1)[doubtful]
        noise = noise_of(light, ambient=other).variance
    if share is not None:
        noise = noise * share.reshape(-1)[doubtful]
    size = size.reshape((planes, -1))
    size = size if size.shape[1] == 1 else size[:, doubtful]
    found = np.zeros(brightness.size, dtype=bool)
    with np.errstate(divide="ignore", invalid="ignore"):  # of pixels without a gain
        noise = noise / size
    found[doubtful] = undetected(moments.reshape((planes, -1))[:, doubtful], MomentNoise(noise))
    return found.reshape(brightness.shape) if found.any() else None


def _limit(m: int) -> float:
    return chi_square_quantile(2 * m, FALSE_ALARMS)
