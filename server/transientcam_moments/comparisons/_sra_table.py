"""Three frequencies in real time: SRA looked up in a table of four dimensions."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._estimate import Real, SparseEstimate
from transientcam_moments.comparisons._grid import cluster
from transientcam_moments.comparisons._pixels import Complex, pixels_of
from transientcam_moments.comparisons._sra import EPSILON, program
from transientcam_moments.comparisons._technique import TEXTS, Technique
from transientcam_moments.errors import ParameterError
from transientcam_moments.moment_problem import DIRECT_THRESHOLD

NODES = 9
_LEAST = 3
_BINS = 128
_SINGLE = 3**-0.5  # b_1, b_2 and b_3 of a single return, turned and divided
_DENSER = 1.5  # power of the distance from there, by which nodes get closer to each other


def sra_table(b: Array, *, nodes: int | None = None, epsilon: float = EPSILON) -> SparseEstimate:
    """Look up the first return that `sra` finds for b_1, b_2 and b_3; no other is returned.

    Parameters
    ----------
    nodes : int, optional
        Of the table along each of its axes, odd and at least 3; `NODES` when left out. The first
        call with a number builds the table, a linear program for every second of its nodes, which
        takes seconds.
    epsilon : float
        Tolerance, as of `sra`, above 0.

    Notes
    -----
    Turned by the phase of b_1 and divided by their 2-norm, three moments have four dimensions left:
    b_2 and b_3, in the unit ball. Nodes are dense around the place of a single return, which is
    one of them. The first return is the earliest within half a turn around the
    phase of b_1 that has a tenth of the strongest one's weight. Between nodes its weight times
    exp(i phi) is interpolated linearly. The tolerance of `sra`, in real and imaginary parts, does
    turn with the moments only by quarter turns; the table is that of a phase of 0.
    """
    nodes = NODES if nodes is None else nodes
    if nodes < 3 or nodes % 2 == 0:
        raise ParameterError("nodes", nodes, "odd, at least 3")
    pixels = pixels_of(b, least=_LEAST, name="sra-table", last=_LEAST)
    c = pixels.b[1 : _LEAST + 1]
    turn = np.exp(-1j * np.angle(c[0]))
    size = np.linalg.norm(c, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        second, third = np.where(size > 0, c[1:] * turn ** np.array([[2], [3]]) / size, 0)
    where = np.stack([second.real, second.imag, third.real, third.imag], axis=1)
    found = _table(nodes, epsilon)(np.clip(where, -1, 1)) * turn.conj()
    return pixels.sparse(np.angle(found)[None], (np.abs(found) * size)[None])


@lru_cache(maxsize=4)
def _table(nodes: int, epsilon: float) -> Any:
    """Return the table as a function from places (P, 4) to weight exp(i phase) (P)."""
    from scipy.interpolate import RegularGridInterpolator  # heavy, like the solver

    axes = (_axis(nodes, _SINGLE), _axis(nodes, 0.0)) * 2
    solve = program(range(1, _LEAST + 1), bins=_BINS, epsilon=epsilon)
    values = np.zeros((nodes,) * 4, dtype=complex)
    for place in map(tuple, np.argwhere(_needed(axes))):
        mirror = (place[0], nodes - 1 - place[1], place[2], nodes - 1 - place[3])
        if place > mirror:
            continue  # conjugate moments have the mirrored response
        where = np.array([axis[index] for axis, index in zip(axes, place, strict=True)])
        light = solve(_moments(where))
        values[place] = _first(light)
        values[mirror] = _first(None if light is None else np.roll(light[::-1], 1))
    return RegularGridInterpolator(axes, values)


def _axis(nodes: int, dense: float) -> Real:
    """Return nodes from -1 to 1 that are closest to each other around a place."""
    t = np.linspace(-1, 1, nodes)
    axis: Real = dense + np.where(t < 0, -1 - dense, 1 - dense) * np.abs(t) ** _DENSER
    return axis


def _needed(axes: Sequence[Real]) -> NDArray[np.bool_]:
    """Say which nodes are corners of a cell that the unit ball reaches into."""
    squares = np.zeros(())
    for axis in axes:
        low, high = np.append(axis[0], axis[:-1]), np.append(axis[1:], axis[-1])
        nearest = np.where(low * high < 0, 0, np.minimum(np.abs(low), np.abs(high)))
        squares = squares[..., None] + nearest**2
    within: NDArray[np.bool_] = squares < 1
    return within


def _moments(place: Real) -> Complex:
    """Return b_1 .. b_3 of a node; of one outside of the ball, those of its place on the border."""
    place = place / max(1.0, float(np.linalg.norm(place)))
    first = np.sqrt(max(0.0, 1.0 - float(place @ place)))
    return np.array([first, complex(*place[:2]), complex(*place[2:])])


def _first(light: Real | None) -> complex:
    """Return weight times exp(i phase) of the first return within half a turn around 0."""
    returns = cluster(light)
    if returns is None:
        return 0j
    phase, weight = np.angle(np.exp(1j * returns[0])), returns[1]
    phase = np.where(weight >= DIRECT_THRESHOLD * weight.max(), phase, np.inf)
    index = int(phase.argmin())
    return complex(weight[index] * np.exp(1j * phase[index]))


TECHNIQUE = Technique(
    **TEXTS["sra-table"], harmonics=lambda m: (1, 2, 3), least_harmonics=_LEAST, estimate=sra_table
)
