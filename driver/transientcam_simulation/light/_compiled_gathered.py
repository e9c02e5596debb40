"""Compiled: light of patches at points between the patches' centres."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import AROUND, LINE, NUMBERS, WHOLE, kernel
from transientcam_simulation.light._coverage import LEAST, ONE, ZERO, Plane

_HALF, _QUARTER, _TURN = np.float32(0.5), np.float32(0.25), np.float32(2 * np.pi)
_FIRST, _THIRD = np.float32(-0.327622764), np.float32(0.15931422)
_FIFTH = np.float32(-0.0464964749)
"""Of the arc tangent of what is between 0 and 1, which they give within 0.002."""


@kernel(AROUND, WHOLE, WHOLE, WHOLE)
def on_ends(places: NDArray[np.int32], shares: Plane, light: Plane, on: Plane) -> None:
    """Put moments (P, 2) on points, given those of patches (M, 2) and shares (P, 4) of four."""
    for i in range(len(places)):
        for part in range(2):
            total = ZERO
            for k in range(4):
                total += shares[i, k] * light[places[i, k], part]
            on[i, part] = total


@kernel(LINE, LINE, LINE, WHOLE, NUMBERS, WHOLE, WHOLE)
def on_ellipsoids(
    x: Plane, y: Plane, z: Plane, balls: Plane, spans: NDArray[np.int64], light: Plane, on: Plane
) -> None:  # fmt: skip
    """Put moments (P, 2) on points of ellipsoids, given those of patches (M, 2).

    ``balls`` (N, 6) are centres, and one over the radii; ``spans`` (N, 5) where the points of each
    begin and end, its first patch, and its rows and columns of patches.
    """
    for n in range(len(balls)):
        first, rows, columns = spans[n, 2], spans[n, 3], spans[n, 4]
        for i in range(spans[n, 0], spans[n, 1]):
            across = (x[i] - balls[n, 0]) * balls[n, 3]
            along = (y[i] - balls[n, 1]) * balls[n, 4]
            height = min(max((z[i] - balls[n, 2]) * balls[n, 5], -ONE), ONE)
            slope = min(abs(across), abs(along)) / max(abs(across), abs(along), LEAST)
            square = slope * slope
            turn = ((_FIFTH * square + _THIRD) * square + _FIRST) * square * slope + slope
            turn = turn / _TURN
            turn = _QUARTER - turn if abs(along) > abs(across) else turn
            turn = _HALF - turn if across < ZERO else turn
            turn = -turn if along < ZERO else turn
            place = (turn + _HALF) * np.float32(columns) - _HALF
            level = (height + ONE) * _HALF * np.float32(rows) - _HALF
            column, row = int(np.floor(place)), min(max(int(np.floor(level)), 0), rows - 2)
            right, up = place - np.float32(column), min(max(level - np.float32(row), ZERO), ONE)
            start = first + row * columns
            one, other = start + (column + columns) % columns, start + (column + 1) % columns
            for part in range(2):
                low = (ONE - right) * light[one, part] + right * light[other, part]
                high = (ONE - right) * light[one + columns, part]
                high += right * light[other + columns, part]
                on[i, part] = (ONE - up) * low + up * high
