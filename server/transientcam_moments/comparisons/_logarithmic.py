"""Sparsity by the logarithm of the light, which costs strong returns less than the 1-norm."""

import numpy as np

from transientcam_moments.arrays import Array, in_range
from transientcam_moments.comparisons._estimate import Real, SparseEstimate
from transientcam_moments.comparisons._grid import cluster, stacked
from transientcam_moments.comparisons._pixels import Complex, pixels_of
from transientcam_moments.comparisons._sra import BINS, EPSILON, program
from transientcam_moments.comparisons._technique import TEXTS, Technique, from_first
from transientcam_moments.errors import ParameterError

STEPS = 4
_LEAST = 1


def logarithmic(
    b: Array, *, epsilon: float = EPSILON, delta: float = 0.05, steps: int = STEPS, bins: int = BINS
) -> SparseEstimate:
    """Estimate the response of least sum of logarithms on a grid, pixel by pixel.

    Parameters
    ----------
    epsilon : float
        Tolerance, as of `sra`, above 0 and at most 1.
    delta : float
        Light relative to the largest moment, below which a bin counts as dark, above 0.
    steps : int
        Linear programs, at least 1; the first is that of `sra`.
    bins : int
        Phases k 2 pi / bins that light may come back at, more than 2 m.

    Notes
    -----
    min sum log(x + delta) over x >= 0 with |v - Phi x|_1 <= epsilon |v|_1. The logarithm lies below
    its tangents, so that linear programs with the costs 1 / (x + delta) of the step before never go
    up (Candes, Wakin and Boyd 2008).
    """
    in_range("epsilon", epsilon, float(np.nextafter(0.0, 1.0)), 1.0, "above 0, at most 1")
    in_range("delta", delta, float(np.nextafter(0.0, 1.0)), float("inf"), "above 0")
    if steps < 1:
        raise ParameterError("steps", steps, "at least 1")
    pixels = pixels_of(b, least=_LEAST, name="logarithmic")
    pixels.require_bins(bins)
    solve = program(range(1, pixels.m + 1), bins=bins, epsilon=epsilon)

    def descend(c: Complex) -> Real | None:
        light: Real | None = solve(c)
        for _ in range(steps - 1):
            if light is None:
                break
            darker = solve(c, delta / (np.maximum(light, 0) + delta))
            if darker is None or np.allclose(darker, light, atol=1e-9):
                break
            light = darker
        return light

    c = pixels.b[1:]
    found = [
        cluster(descend(c[:, pixel])) if usable else None
        for pixel, usable in enumerate(pixels.usable)
    ]
    return pixels.sparse(*stacked(found))


TECHNIQUE = Technique(
    **TEXTS["logarithmic"],
    harmonics=from_first,
    least_harmonics=_LEAST,
    estimate=logarithmic,
    planar=False,
)
