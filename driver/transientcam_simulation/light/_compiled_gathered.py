"""Compiled: light of patches where rays of the camera end, between the patches' centres."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import LINE, NUMBERS, PIXELS, WHOLE, inner, kernel
from transientcam_simulation.light._coverage import LEAST, ONE, ZERO, Plane

Cells = NDArray[np.int32]
_HALF, _TURN = np.float32(0.5), np.float32(2 * np.pi)
_FIRST, _THIRD = np.float32(-0.327622764), np.float32(0.15931422)
_FIFTH = np.float32(-0.0464964749)
"""Of the arc tangent of what is between 0 and 1, which they give within 0.002."""


@inner
def _place(
    x: Plane, y: Plane, z: Plane, ball: tuple[np.float32, ...], grid: tuple[int, int, int],
    cells: Cells, weights: Plane,
) -> None:  # fmt: skip
    """Do it for the points on one ellipsoid."""
    first, rows, columns = grid
    high, wide = np.float32(rows), np.float32(columns)
    for i in range(len(x)):
        across = abs((x[i] - ball[0]) * ball[3])
        along = abs((y[i] - ball[1]) * ball[4])
        height = min(max((z[i] - ball[2]) * ball[5], -ONE), ONE)
        slope = min(across, along) / max(max(across, along), LEAST)
        square = slope * slope
        turn = ((_FIFTH * square + _THIRD) * square + _FIRST) * square * slope + slope
        turn = turn / _TURN
        turn = np.float32(0.25) - turn if along > across else turn
        turn = _HALF - turn if x[i] < ball[0] else turn
        turn = -turn if y[i] < ball[1] else turn
        place = (turn + _HALF) * wide - _HALF
        below = np.floor(place)
        right = place - below
        column = np.int32(below)
        column = column + columns if column < 0 else column
        beside = column + 1 if column + 1 < columns else 0
        level = (height + ONE) * _HALF * high - _HALF
        row = min(max(np.floor(level), ZERO), high - ONE - ONE)
        up = min(max(level - row, ZERO), ONE)
        start = first + np.int32(row) * columns
        cells[0, i], cells[1, i] = start + column, start + beside
        cells[2, i], cells[3, i] = start + columns + column, start + columns + beside
        weights[0, i], weights[1, i] = (ONE - up) * (ONE - right), (ONE - up) * right
        weights[2, i], weights[3, i] = up * (ONE - right), up * right


@kernel(LINE, LINE, LINE, WHOLE, NUMBERS, PIXELS, WHOLE)
def around_on_ellipsoids(
    x: Plane, y: Plane, z: Plane, balls: Plane, spans: NDArray[np.int64], cells: Cells,
    weights: Plane,
) -> None:  # fmt: skip
    """Put the four patches (4, P) around points on ellipsoids, and weights of the interpolation.

    ``balls`` (N, 6) are centres, and one over the radii; ``spans`` (N, 5) where points of each
    begin and end, its first patch, and its rows and columns of patches.
    """
    for n in range(len(balls)):
        ball = balls[n, 0], balls[n, 1], balls[n, 2], balls[n, 3], balls[n, 4], balls[n, 5]
        a, b = spans[n, 0], spans[n, 1]
        grid = spans[n, 2], spans[n, 3], spans[n, 4]
        _place(x[a:b], y[a:b], z[a:b], ball, grid, cells[:, a:b], weights[:, a:b])


@kernel(PIXELS, WHOLE, WHOLE, WHOLE)
def gathered(cells: Cells, weights: Plane, light: Plane, factor: Plane) -> Plane:
    """Return moments (P, 2) of points, given those of patches (N, 2), times a complex factor."""
    count = cells.shape[1]
    moments = np.empty((count, 2), np.float32)
    for i in range(count):
        real, imaginary = ZERO, ZERO
        for k in range(4):
            cell, weight = cells[k, i], weights[k, i]
            real += weight * light[cell, 0]
            imaginary += weight * light[cell, 1]
        moments[i, 0] = real * factor[i, 0] - imaginary * factor[i, 1]
        moments[i, 1] = real * factor[i, 1] + imaginary * factor[i, 0]
    return moments
