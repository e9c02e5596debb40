"""The response of least brightness within a tolerance of the moments, by linear programming."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_moments.arrays import Array, in_range, moment_planes
from transientcam_moments.comparisons._estimate import Real, SparseEstimate
from transientcam_moments.comparisons._grid import cluster, stacked
from transientcam_moments.comparisons._pixels import Complex, Pixels, pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique, from_first
from transientcam_moments.errors import ParameterError
from transientcam_moments.likelihood import places_of
from transientcam_moments.moment_problem import pisarenko

EPSILON = 0.05
"""The tolerance that the paper compares with (Fig. 11)."""
BINS = 256
_LEAST = 1


def sra(
    b: Array, *, epsilon: float = EPSILON, bins: int = BINS, harmonics: Sequence[int] | None = None
) -> SparseEstimate:
    """Estimate the non-negative response of least 1-norm on a grid, pixel by pixel.

    Parameters
    ----------
    epsilon : float
        Largest 1-norm of what is left of b_1 .. b_m, relative to theirs, 0 to 1. At 0 the answer
        is known in closed form and the grid is not used.
    bins : int
        Phases k 2 pi / bins that light may come back at, more than 2 m.
    harmonics : sequence of int, optional
        Which multiples of the base frequency the planes of `b` are; 0 to m when left out. Where
        they are others, m is the largest, and the tolerance above 0.

    Notes
    -----
    min |x|_1 over x >= 0 with |v - Phi x|_1 <= epsilon |v|_1, over real and imaginary parts, by
    SciPy's HiGHS. Neighbouring bins with light are one return at their centroid. At epsilon = 0
    the least brightness is minus the smallest eigenvalue of the Toeplitz matrix with zero diagonal,
    and the returns are Pisarenko's (Sec. 5.1).
    """
    in_range("epsilon", epsilon, 0.0, 1.0, "0 to 1")
    if harmonics is None:
        multiples: Sequence[int] = range(1, len(moment_planes(b)[0]))
    else:
        b, multiples = _behind_zeroth(b, harmonics)
    pixels = pixels_of(b, least=_LEAST, name="sra")
    if epsilon == 0:
        if list(multiples) != list(range(1, pixels.m + 1)):
            raise ParameterError("epsilon", epsilon, "above 0 for other harmonics than 0 to m")
        return closed_form(pixels)
    if bins <= 2 * max(multiples):
        raise ParameterError("bins", bins, f"more than {2 * max(multiples)}")
    solve = program(multiples, bins=bins, epsilon=epsilon)
    c = pixels.b[1:]
    found = [
        cluster(solve(c[:, pixel])) if usable else None
        for pixel, usable in enumerate(pixels.usable)
    ]
    return pixels.sparse(*stacked(found))


def _behind_zeroth(b: Array, harmonics: Sequence[int]) -> tuple[Array, list[int]]:
    """Return the moments of the multiples above 0 behind a plane that is not looked at."""
    planes, trailing = moment_planes(b)
    places = places_of(harmonics, len(planes))
    measured = [planes[at] for at, j in enumerate(places) if j > 0]
    arranged = np.stack([0 * planes[0], *measured])
    return arranged.reshape((len(arranged), *trailing)), [j for j in places if j > 0]


def closed_form(pixels: Pixels) -> SparseEstimate:
    """Return the answer without tolerance: Pisarenko's returns for a b_0 of zero."""
    without = np.concatenate([np.zeros_like(pixels.b[:1]), pixels.b[1:]])
    returns = pisarenko(without)
    return pixels.sparse(returns.phase_rad, returns.weight)


def program(multiples: Sequence[int], *, bins: int, epsilon: float) -> Callable[..., Real | None]:
    """Return a function from the moments of these multiples (N) to the light (bins) of least cost.

    It takes what a unit of light costs in each bin as a second argument, 1 when left out, and gives
    None where the solver finds no answer.
    """
    from scipy.optimize import linprog  # heavy, and not needed by those who don't compare

    angles = np.outer(multiples, np.arange(bins) * (2 * np.pi / bins))
    waves = np.concatenate([np.cos(angles), np.sin(angles)])  # Phi, (2 N, bins)
    one = np.eye(len(waves))
    # slack s >= |v - Phi x|, sum s <= epsilon |v|_1
    rows = np.block(
        [[waves, -one], [-waves, -one], [np.zeros((1, bins)), np.ones((1, len(waves)))]]
    )
    no_cost = np.zeros(len(waves))

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
    **TEXTS["sra"], harmonics=from_first, least_harmonics=_LEAST, estimate=sra, planar=False
)
