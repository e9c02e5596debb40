"""K returns from 2 K + 1 frequencies by the eigenvalues of a matrix pencil."""

import numpy as np

from transientcam_moments.arrays import Array, by_blocks
from transientcam_moments.comparisons._estimate import Real, SparseEstimate
from transientcam_moments.comparisons._pixels import Complex, pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique, from_first
from transientcam_moments.comparisons._weights import nonnegative_weights
from transientcam_moments.errors import ParameterError

_LEAST = 3


def matrix_pencil(b: Array, *, returns: int | None = None) -> SparseEstimate:
    """Estimate returns from b_1 .. b_m, m >= 3.

    Parameters
    ----------
    returns : int, optional
        How many, at most (m - 1) // 2, which is the default.

    Notes
    -----
    The Hankel matrices Y_0 = (c_{i+j}), Y_1 = (c_{i+j+1}) of c_i = b_{i+1} are made of the same
    returns, so that the non-zero eigenvalues of pinv(Y_0) Y_1 are their exp(i phi) (Hua and Sarkar
    1990). Y_0 is cut to its K largest singular values.
    """
    pixels = pixels_of(b, least=_LEAST, name="matrix-pencil")
    c = pixels.b[1:]
    most = (len(c) - 1) // 2
    count = most if returns is None else returns
    if not 1 <= count <= most:
        raise ParameterError("returns", returns, f"1 to {most} for m = {len(c)}")
    (phase,) = by_blocks(lambda part: (_phases(part, count),), c)
    weight = nonnegative_weights(c, np.arange(1.0, len(c) + 1), phase)
    return pixels.sparse(phase, weight)


def _phases(c: Complex, count: int) -> Real:
    """Return the angles (K, P) of the pencil's eigenvalues, NaN where there is none."""
    width = len(c) // 2
    index = np.arange(len(c) - width)[:, None] + np.arange(width)
    first = np.moveaxis(c[index], -1, 0)  # (P, rows, columns)
    second = np.moveaxis(c[index + 1], -1, 0)
    u, s, vh = np.linalg.svd(first, full_matrices=False)
    u, s, vh = u[:, :, :count], s[:, :count], vh[:, :count]
    with np.errstate(divide="ignore"):
        inverse = np.where(s > 1e-12 * s[:, :1], 1 / s, 0)
    # K x K: the eigenvalues of pinv(Y_0) Y_1 that are not zero
    reduced = inverse[:, :, None] * (u.conj().swapaxes(1, 2) @ second @ vh.conj().swapaxes(1, 2))
    z = np.linalg.eigvals(reduced).T
    found: Real = np.where(np.abs(z) > 1e-6, np.angle(z), np.nan)
    return found


TECHNIQUE = Technique(
    **TEXTS["matrix-pencil"], harmonics=from_first, least_harmonics=_LEAST, estimate=matrix_pencil
)
