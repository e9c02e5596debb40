"""The response of least brightness within a tolerance of the moments, by linear programming."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_moments._arrays import Array, in_range
from transientcam_moments.comparisons._grid import cluster, stacked
from transientcam_moments.comparisons._pixels import Complex, Pixels, pixels_of
from transientcam_moments.comparisons.estimate import Real, SparseEstimate
from transientcam_moments.comparisons.technique import Technique, from_first
from transientcam_moments.errors import ParameterError
from transientcam_moments.pisarenko import pisarenko

EPSILON = 0.05
"""The tolerance that the paper compares with (Fig. 11)."""
BINS = 256
_LEAST = 1


def sra(b: Array, *, epsilon: float = EPSILON, bins: int = BINS) -> SparseEstimate:
    """Estimate the non-negative response of least 1-norm on a grid, pixel by pixel.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Moments; b_0 is not looked at.
    epsilon : float
        Largest 1-norm of what is left of b_1 .. b_m, relative to theirs, 0 to 1. At 0 the answer
        is known in closed form and the grid is not used.
    bins : int
        Phases k 2 pi / bins that light may come back at, more than 2 m.

    Raises
    ------
    ParameterError
        For a tolerance or a number of bins outside of that.

    Notes
    -----
    min |x|_1 over x >= 0 with |v - Phi x|_1 <= epsilon |v|_1, over real and imaginary parts, by
    SciPy's HiGHS. Neighbouring bins with light are one return at their centroid. At epsilon = 0
    the least brightness is minus the smallest eigenvalue of the Toeplitz matrix with zero diagonal,
    and the returns are Pisarenko's (Sec. 5.1).
    """
    in_range("epsilon", epsilon, 0.0, 1.0, "0 to 1")
    pixels = pixels_of(b, least=_LEAST, name="sra")
    if epsilon == 0:
        return closed_form(pixels)
    if bins <= 2 * pixels.m:
        raise ParameterError("bins", bins, f"more than {2 * pixels.m}")
    solve = program(pixels.m, bins=bins, epsilon=epsilon)
    c = pixels.b[1:]
    found = [
        cluster(solve(c[:, pixel])) if usable else None
        for pixel, usable in enumerate(pixels.usable)
    ]
    return pixels.sparse(*stacked(found))


def closed_form(pixels: Pixels) -> SparseEstimate:
    """Return the answer without tolerance: Pisarenko's returns for a b_0 of zero."""
    without = np.concatenate([np.zeros_like(pixels.b[:1]), pixels.b[1:]])
    returns = pisarenko(without)
    return pixels.sparse(returns.phase_rad, returns.weight)


def program(m: int, *, bins: int, epsilon: float) -> Callable[..., Real | None]:
    """Return a function from b_1 .. b_m (m) to the light (bins) of least cost.

    It takes what a unit of light costs in each bin as a second argument, 1 when left out, and gives
    None where the solver finds no answer.
    """
    from scipy.optimize import linprog  # heavy, and not needed by those who don't compare

    angles = np.outer(np.arange(1, m + 1), np.arange(bins) * (2 * np.pi / bins))
    waves = np.concatenate([np.cos(angles), np.sin(angles)])  # Phi, (2 m, bins)
    one = np.eye(2 * m)
    # slack s >= |v - Phi x|, sum s <= epsilon |v|_1
    rows = np.block([[waves, -one], [-waves, -one], [np.zeros((1, bins)), np.ones((1, 2 * m))]])
    no_cost = np.zeros(2 * m)

    def solve(c: Complex, cost: Real | None = None) -> Real | None:
        v = np.concatenate([c.real, c.imag])
        limits = np.concatenate([v, -v, [epsilon * np.abs(v).sum()]])
        costs = np.concatenate([np.ones(bins) if cost is None else cost, no_cost])
        # so small a program is solved before it could be presolved
        found: Any = linprog(
            costs, A_ub=rows, b_ub=limits, method="highs-ds", options={"presolve": False}
        )
        light: NDArray[np.float64] | None = None if found.x is None else found.x[:bins]
        return light

    return solve


TECHNIQUE = Technique(
    name="sra",
    label="after Freedman et al. 2014 (SRA)",
    returns="2 m",
    frequencies="f .. m f, three in the original",
    harmonics=from_first,
    least_harmonics=_LEAST,
    assumptions="The least light that explains the measurement up to a tolerance is the truth.",
    cost="A linear program for each pixel, milliseconds long; closed form at epsilon = 0.",
    failure="Biased towards fewer returns and less light: a weak third return is lost within the "
    "tolerance, which in turn takes up noise.",
    estimate=sra,
    planar=False,
)
