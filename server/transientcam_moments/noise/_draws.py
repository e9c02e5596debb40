"""Noisy moments, for where first order does not hold."""

import numpy as np

from transientcam_moments.arrays import Array, as_array
from transientcam_moments.noise._moments import MomentNoise


def draw(b: Array, noise: MomentNoise, random: np.random.Generator, *, draws: int) -> Array:
    """Draw moments with the given mean and noise.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Mean moments.
    noise : MomentNoise
        Of shape (m + 1, ...).
    random : numpy.random.Generator
        Where chance comes from.
    draws : int
        How many.

    Returns
    -------
    array, shape (m + 1, draws, ...), complex64 or complex128 as `b`
        Normally distributed: hundreds of electrons make an image.
    """
    b = np.asarray(as_array(b))
    real = np.empty(0, b.dtype).real.dtype
    shape = (b.shape[0], draws, *b.shape[1:])
    deviation = np.sqrt(noise.variance)[:, None]
    noisy = np.empty(shape, b.dtype)
    noisy.real = b.real[:, None] + deviation * random.standard_normal(shape, dtype=real)
    noisy.imag = b.imag[:, None] + deviation * random.standard_normal(shape, dtype=real)
    noisy[0].imag = 0
    return noisy
