"""Compiled: which shares of pixels show an ellipsoid, and where their lines enter it."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import DOUBLES, FLAG, REGION, ROWS, WHOLE, inner, lane
from transientcam_simulation.light._bundle import Numbers
from transientcam_simulation.light._compiled_edges import mark_borders, row_of, share_and_root
from transientcam_simulation.light._compiled_numbers import ball_of, near_ellipsoid
from transientcam_simulation.light._coverage import ZERO, Ball, Plane


@inner
def _cross_row(
    ball: Ball, x: Plane, y: Plane, z: Plane, inside: Plane, at: Plane
) -> tuple[int, int]:
    """Cross a row of lines with an ellipsoid; return the span of those that meet it.

    Put the t at which they enter it, but for pixels at its border.
    """
    for i in range(len(x)):
        value, closest, squared = near_ellipsoid(ball, x[i], y[i], z[i])
        inside[i] = value
        at[i] = closest - np.sqrt(max(value, ZERO)) / np.sqrt(squared)
    first, after = 0, len(x)
    while first < after and not inside[first] > ZERO:
        first += 1
    while after > first and not inside[after - 1] > ZERO:
        after -= 1
    return (first, after) if first < after else (len(x), 0)


@inner
def _cross(
    ball: Ball, x: Plane, y: Plane, z: Plane, of: Numbers, inside: Plane, at: Plane,
    spans: NDArray[np.int64],
) -> None:  # fmt: skip
    """Cross the lines of a region; row by row, put where pixels may be covered in ``spans``."""
    top, left, height, width = of
    right = left + width
    met = np.empty((height, 2), np.int64)
    for row in range(height):
        r = top + row
        met[row, 0], met[row, 1] = _cross_row(
            ball, x[r, left:right], y[r, left:right], z[r, left:right], inside[row], at[row]
        )
    for row in range(height):
        first, after = met[row, 0] - 1, met[row, 1] + 1
        for beside in range(max(row - 1, 0), min(row + 2, height)):
            first, after = min(first, met[beside, 0]), max(after, met[beside, 1])
        spans[row, 0], spans[row, 1] = max(first, 0), min(after, width)


@inner
def _show(
    at: Plane, inside: Plane, near: Plane, far: Plane, fills: Plane, share: Plane
) -> None:  # fmt: skip
    """Put shares of pixels of a row that show an ellipsoid, but for those at its border."""
    for i in range(len(at)):
        shows = (inside[i] > ZERO) & (at[i] > near[i]) & (at[i] < far[i])
        share[i] = fills[i] if shows else ZERO


@lane(ROWS, DOUBLES, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, REGION, FLAG)
def seen(
    axes: NDArray[np.float64], apex: NDArray[np.float64], x: Plane, y: Plane, z: Plane,
    near: Plane, far: Plane, fills: Plane, of: Numbers, soft: bool,
) -> tuple[Plane, Plane]:  # fmt: skip
    """Return shares of pixels that show an ellipsoid, and where their lines enter it.

    Of planes of one row, all rows are alike. Soft: pixels at its border take a share of it.
    """
    top, left, height, width = of
    ball = ball_of(axes[0], axes[1], apex)
    inside, at = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    share, spans = np.zeros((height, width), np.float32), np.empty((height, 2), np.int64)
    border = np.zeros(width, np.bool_)
    _cross(ball, x, y, z, of, inside, at, spans)
    for row in range(height):
        r, start, end = top + row, spans[row, 0], spans[row, 1]
        if start >= end:
            continue
        since, until, full = row_of(near, r), row_of(far, r), row_of(fills, r)
        a, b = left + start, left + end
        _show(
            at[row, start:end], inside[row, start:end], since[a:b], until[a:b], full[a:b],
            share[row, start:end],
        )  # fmt: skip
        if not soft:
            continue
        mark_borders(inside, row, start, end, border)
        for column in range(start, end):
            if border[column]:
                c = left + column
                part, root = share_and_root(inside, row, column)
                _value, closest, squared = near_ellipsoid(ball, x[r, c], y[r, c], z[r, c])
                at[row, column] = closest - root / np.sqrt(squared)
                shows = at[row, column] > since[c] and at[row, column] < until[c]
                share[row, column] = part * full[c] if shows else ZERO
    return share, at
