"""Phases that are evaluated together: several share the sums of Eq. (2), or at least its loads."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numba import njit

from transientcam_moments._kernels.arrays import RealPlane, RealPlanes, Reals, Table, WideRealPlane
from transientcam_moments._kernels.compiled_entry import entry
from transientcam_moments.arrays import Length

ANY: Final = 0
MIRRORED: Final = 1
TURN: Final = 2
_LEAST_EQUIDISTANT: Final = 8
_REMEMBERED: Final = 4096  # phases; more are a computation rather than a film


class Groups(NamedTuple):
    """Phases in n groups."""

    rows: Any
    """Shape (n, 4): of the phases of a group; of a pair in the first two. A phase alone has its row
    twice, and what is evaluated for the first is right."""
    waves: Any
    """Shape (n, 4 m): cos and sin of j phi for the first two of a group; but for `ANY`, of their
    distance from the centre."""
    centre: Any
    """Shape (2 m): cos and sin of j times the phase that the first two lie as far before as
    behind."""
    together: int
    """`ANY` two phases; two that are `MIRRORED`; or four of a whole `TURN`: two that are
    mirrored, and those half a turn from each."""


@njit(nogil=True, error_model="numpy")
def _kind(phase_rad: Reals) -> int:
    """Say how equidistant phases are, but for the rounding of their own digits."""
    phases = phase_rad.shape[0]
    if phases < _LEAST_EQUIDISTANT:
        return ANY
    first, last = phase_rad[0], phase_rad[phases - 1]
    step = (last - first) / (phases - 1)
    digits = 4.0 * np.finfo(np.float64).eps * max(abs(first), abs(last))
    for t in range(phases):
        if not abs(phase_rad[t] - (first + t * step)) <= digits:  # or NaN
            return ANY
    whole = abs(abs(step) * phases - 2.0 * math.pi) <= digits
    return TURN if whole and phases % 4 == 0 else MIRRORED


@njit(nogil=True, error_model="numpy")
def _group(
    order: Length,
    phase_rad: WideRealPlane,
    alike: int,
    rows: Table,
    waves: RealPlanes,
    turn: RealPlane,
) -> tuple[int, int]:
    """Fill the arrays of `Groups`; return how many groups there are, and of which kind."""
    m, phases = len(order), phase_rad.shape[0]
    together = _kind(phase_rad) if alike <= 2 else ANY
    groups, centre = 0, 0.0
    if together == TURN:
        centre, half = phase_rad[0], phases // 2
        for t in range(phases // 4 + 1):
            rows[t, 0], rows[t, 1] = t, (phases - t) % phases
            rows[t, 2], rows[t, 3] = half + t, half - t
        groups = phases // 4 + 1
    elif together == MIRRORED:
        # with whole turns of rows that begin alike, those at either end of an odd number do
        fold = phases - (phases - 1) % alike
        centre = (phase_rad[0] + phase_rad[fold - 1]) / 2
        for t in range(phases):
            if t <= fold - 1 - t or t >= fold:
                rows[groups, 0], rows[groups, 1] = t, fold - 1 - t if t < fold else t
                groups += 1
    else:
        for t in range(phases):
            if t % (2 * alike) < alike:
                rows[groups, 0], rows[groups, 1] = t, t + alike if t + alike < phases else t
                groups += 1
    for group in range(groups):
        for each in range(2):
            distance = phase_rad[rows[group, each]] - centre
            for j in range(m):
                waves[group, 2 * m * each + j] = math.cos((j + 1) * distance)
                waves[group, 2 * m * each + m + j] = math.sin((j + 1) * distance)
    for j in range(m):
        turn[j], turn[m + j] = math.cos((j + 1) * centre), math.sin((j + 1) * centre)
    return groups, together


def grouping(m: int, precision: str) -> Callable[[Any, int], Groups]:
    """Compile what groups phases (double, (T,)) so that rows of a group are alike.

    Its second argument is after how many rows one is like the first. Compiled because a film is
    evaluated in a millisecond, of which NumPy would take a third when it is first asked.
    """
    order = (0,) * m
    run = entry(_group, m, precision)

    def grouped(phase_rad: Reals, alike: int) -> Groups:
        rows = np.zeros((phase_rad.size, 4), np.int64)
        waves = np.empty((phase_rad.size, 4 * m), precision)
        centre = np.empty(2 * m, precision)
        groups, together = run(order, phase_rad, alike, rows, waves, centre)
        return Groups(rows[:groups], waves[:groups], centre, together)

    @lru_cache(maxsize=16)
    def before(phase_rad: bytes, alike: int) -> Groups:
        return grouped(np.frombuffer(phase_rad), alike)

    def remembered(phase_rad: Reals, alike: int) -> Groups:
        if phase_rad.size > _REMEMBERED:
            return grouped(np.ascontiguousarray(phase_rad), alike)
        return before(phase_rad.tobytes(), alike)  # frames in a row have the same phases

    return remembered
