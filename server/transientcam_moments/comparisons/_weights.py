"""Weights of returns whose phases are known: non-negative least squares, pixel by pixel."""

import numpy as np

from transientcam_moments.arrays import by_blocks
from transientcam_moments.comparisons._estimate import Real
from transientcam_moments.comparisons._pixels import Complex


def nonnegative_weights(b: Complex, orders: Real, phase_rad: Real) -> Real:
    """Return the weights (K, P) >= 0 with which returns come closest to moments.

    Parameters
    ----------
    b : array, shape (N, P)
        Finite moments of the orders given.
    orders : array, shape (N)
        Multiples of the base frequency.
    phase_rad : array, shape (K, P)
        Of the returns; NaN for one that isn't there, which gets 0.

    Notes
    -----
    Where ordinary least squares has no negative weight it is the answer. The other pixels go to
    SciPy's NNLS one by one.
    """
    (weight,) = by_blocks(lambda b, phase: (_weights(b, orders, phase),), b, phase_rad)
    result: Real = weight
    return result


def _weights(b: Complex, orders: Real, phase_rad: Real) -> Real:
    there = np.isfinite(phase_rad)
    angles = orders[:, None, None] * np.where(there, phase_rad, 0)
    waves: Complex = np.where(there, np.exp(1j * angles), 0)  # (N, K, P)
    matrix = np.moveaxis(np.concatenate([waves.real, waves.imag]), -1, 0)  # (P, 2 N, K)
    right = np.concatenate([b.real, b.imag]).T  # (P, 2 N)
    # a pseudo-inverse: equal phases share their weight instead of failing
    weight = (np.linalg.pinv(matrix, rcond=1e-10) @ right[..., None])[..., 0]
    negative = np.flatnonzero((weight < 0).any(axis=1))
    if negative.size:
        from scipy.optimize import nnls  # heavy, and not needed by those who don't compare

        for pixel in negative:
            try:
                weight[pixel] = nnls(matrix[pixel], right[pixel])[0]
            except RuntimeError:  # too many iterations
                weight[pixel] = np.maximum(weight[pixel], 0)
    result: Real = weight.T
    return result
