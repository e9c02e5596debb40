"""Two returns from six frequencies by an annihilating filter."""

import numpy as np

from transientcam_moments.arrays import Array, by_blocks
from transientcam_moments.comparisons._estimate import Real, SparseEstimate
from transientcam_moments.comparisons._pixels import Complex, pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique
from transientcam_moments.comparisons._weights import nonnegative_weights

_LEAST = 6


def spumic(b: Array) -> SparseEstimate:
    """Estimate two returns from b_1 .. b_6.

    A filter (u_0, u_1, u_2) with u_0 c_i + u_1 c_{i+1} + u_2 c_{i+2} = 0 along the moments, and
    along their conjugates backwards, by total least squares: the singular vector of the smallest
    singular value. Its roots are the returns' exp(i phi); their weights follow by non-negative
    least squares.
    """
    pixels = pixels_of(b, least=_LEAST, name="spumic", last=_LEAST)
    c = pixels.b[1 : _LEAST + 1]
    (phase,) = by_blocks(lambda part: (_phases(part),), c)
    weight = nonnegative_weights(c, np.arange(1.0, _LEAST + 1), phase)
    return pixels.sparse(phase, weight)


def _phases(c: Complex) -> Real:
    """Return the angles (2, P) of the filter's roots."""
    forward = np.stack([c[i : i + 3] for i in range(len(c) - 2)])  # (4, 3, P)
    rows = np.concatenate([forward, forward[:, ::-1].conj()])
    matrix = np.moveaxis(rows, -1, 0)
    u = np.linalg.svd(matrix, full_matrices=False)[2][:, -1].conj().T
    with np.errstate(all="ignore"):
        half, product = -u[1] / (2 * u[2]), u[0] / u[2]
        root = np.sqrt(half * half - product)
        root = np.where((half * root.conj()).real < 0, -root, root)
        first = half + root
        found: Real = np.angle(np.stack([first, product / first]))
    return found


TECHNIQUE = Technique(
    **TEXTS["spumic"],
    harmonics=lambda m: tuple(range(1, _LEAST + 1)),
    least_harmonics=_LEAST,
    estimate=spumic,
)
