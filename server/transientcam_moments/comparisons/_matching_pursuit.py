"""A few returns on a grid of phases by orthogonal matching pursuit."""

import numpy as np

from transientcam_moments.arrays import Array, by_blocks, in_range
from transientcam_moments.comparisons._estimate import Real, SparseEstimate
from transientcam_moments.comparisons._pixels import Complex, pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique, from_first
from transientcam_moments.comparisons._weights import nonnegative_weights
from transientcam_moments.errors import ParameterError

BINS = 720
_LEAST = 2
_BLOCK_PIXELS = 1024


def matching_pursuit(
    b: Array, *, returns: int = 2, bins: int = BINS, tolerance: float = 1e-6
) -> SparseEstimate:
    """Estimate returns at phases k 2 pi / bins, one after the other.

    Parameters
    ----------
    returns : int
        The most that are looked for.
    bins : int
        Of phase.
    tolerance : float
        Of the residual relative to the moments, at which a pixel needs no further return.

    Notes
    -----
    Each step takes the phase whose wave correlates best with what is left of the moments, and fits
    the weights of all phases so far anew, without negative ones.
    """
    pixels = pixels_of(b, least=_LEAST, name="matching-pursuit")
    if not 1 <= returns <= pixels.m:
        raise ParameterError("returns", returns, f"1 to m = {pixels.m}")
    pixels.require_bins(bins)
    in_range("tolerance", tolerance, 0.0, 1.0, "0 to 1")

    def pursue(c: Complex) -> tuple[Real, Real]:
        return _pursue(c, returns, bins, tolerance)

    return pixels.sparse(*by_blocks(pursue, pixels.b[1:], pixels=_BLOCK_PIXELS))


def _pursue(c: Complex, returns: int, bins: int, tolerance: float) -> tuple[Real, Real]:
    orders = np.arange(1.0, len(c) + 1)
    grid = np.arange(bins) * (2 * np.pi / bins)
    angles = grid[:, None] * orders
    dictionary = np.concatenate([np.cos(angles), np.sin(angles)], axis=1)  # (bins, 2 m)
    phase = np.full((returns, c.shape[1]), np.nan)
    weight = np.zeros_like(phase)
    left, enough = c, tolerance * np.linalg.norm(c, axis=0)
    for step in range(returns):
        likeness = dictionary @ np.concatenate([left.real, left.imag])
        best = likeness.argmax(axis=0)
        wanted = (np.linalg.norm(left, axis=0) > enough) & (likeness.max(axis=0) > 0)
        phase[step] = np.where(wanted, grid[best], np.nan)
        weight[: step + 1] = nonnegative_weights(c, orders, phase[: step + 1])
        waves = np.exp(1j * orders[:, None, None] * np.nan_to_num(phase[: step + 1]))
        left = c - (waves * weight[: step + 1]).sum(axis=1)
    return phase, weight


TECHNIQUE = Technique(
    **TEXTS["matching-pursuit"],
    harmonics=from_first,
    least_harmonics=_LEAST,
    estimate=matching_pursuit,
)
