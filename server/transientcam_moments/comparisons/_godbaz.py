"""Two returns from four frequencies in closed form."""

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._estimate import SparseEstimate
from transientcam_moments.comparisons._pixels import pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique

_LEAST = 4


def godbaz(b: Array) -> SparseEstimate:
    """Estimate two returns from b_1 .. b_4; only one where the moments are those of one.

    With c_i = b_{i+1} = a_1 z_1^{i+1} + a_2 z_2^{i+1} the z are the roots of z^2 + P_1 z + P_0,
    P_1 = (c_0 c_3 - c_1 c_2) / D, P_0 = (c_2^2 - c_1 c_3) / D, D = c_1^2 - c_0 c_2. The original
    models returns as Cauchy densities, whose width is 1 - |z|; here, as where the paper compares,
    returns are sharp and only the angle of z counts.
    """
    pixels = pixels_of(b, least=_LEAST, name="godbaz", last=_LEAST)
    c0, c1, c2, c3 = pixels.b[1 : _LEAST + 1]
    with np.errstate(all="ignore"):
        d = c1 * c1 - c0 * c2
        half = (c1 * c2 - c0 * c3) / (2 * d)
        product = (c2 * c2 - c1 * c3) / d
        # the root with the larger modulus first, the other one without cancellation
        root = np.sqrt(half * half - product)
        root = np.where((half * root.conj()).real < 0, -root, root)
        z1 = half + root
        z2 = product / z1
        a1 = (c1 - c0 * z2) / (z1 * (z1 - z2))
        a2 = (c1 - c0 * z1) / (z2 * (z2 - z1))
    phase, weight = np.angle(np.stack([z1, z2])), np.abs(np.stack([a1, a2]))
    # D = -a_1 a_2 z_1 z_2 (z_1 - z_2)^2 is all rounding where there is but one return
    size = np.maximum(np.abs(c1) ** 2, np.abs(c0 * c2))
    one = ~(np.abs(d) > 64 * np.finfo(float).eps * size) | ~np.isfinite(weight).all(axis=0)
    phase = np.where(one, np.stack([np.angle(c0), np.full(c0.shape, np.nan)]), phase)
    weight = np.where(one, np.stack([np.abs(c0), np.zeros(c0.shape)]), weight)
    return pixels.sparse(phase, weight)


TECHNIQUE = Technique(
    **TEXTS["godbaz"], harmonics=lambda m: (1, 2, 3, 4), least_harmonics=_LEAST, estimate=godbaz
)
