"""What of a deviation frames scatter by: errors of calibration are the same in all of them."""

from collections.abc import Sequence

import numpy as np

from transientcam_moments.arrays import Array, as_array, namespace
from transientcam_moments.noise._moments import MomentNoise


def scatter(b: Array, noise: MomentNoise, harmonics: Sequence[int], model_error: float) -> Array:
    """Return which share of the deviation of a phase, with a model error, is noise.

    Of the phase of one return, to first order: with w_j = 1 / (v_j + e^2) the inverse of the
    variance of noise and model error together, it is fitted with the information sum_j j^2 w_j, and
    noise alone moves it by the variance sum_j j^2 w_j^2 v_j over the square of that. Where all
    frequencies are as noisy, which they nearly are, it is the same with more returns.

    Parameters
    ----------
    b : array, shape (N, ...)
        Moments.
    noise : MomentNoise
        Of shape (N, ...); moments with a variance that is 0, infinite or NaN count as not measured.
    harmonics : sequence of int
        Which multiples of the base frequency they are; 0 tells no phase.
    model_error : float
        As `tm.likelihood` has it: a standard deviation over the pixel's largest moment.

    Returns
    -------
    array, shape (...)
        0 to 1; NaN where no frequency was measured.
    """
    xp = namespace(b)
    b, variance = as_array(b), as_array(noise.variance)
    seen = (variance > 0) & (variance < np.inf)
    largest = xp.where(seen, xp.maximum(abs(b.real), abs(b.imag)), 0).max(axis=0)
    error = (model_error * largest) ** 2
    information, by_noise = 0 * error, 0 * error
    with np.errstate(all="ignore"):  # pixels without light are computed along
        for at, j in enumerate(harmonics):
            weight = xp.where(seen[at], j * j / (variance[at] + error), 0)
            information = information + weight
            by_noise = by_noise + weight * xp.where(
                seen[at], variance[at] / (variance[at] + error), 0
            )
        share: Array = xp.sqrt(by_noise / information)
    return share.astype(b.real.dtype)
