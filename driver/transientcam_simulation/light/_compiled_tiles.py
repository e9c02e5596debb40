"""Tiles of pixels whose lines may meet shapes, and those that are seen: compiled arithmetic.

Bytes are those of the statements in NumPy, as in `compiled_edges`.
"""

from typing import Any

import numpy as np

from transientcam_simulation.compiled import (
    DOUBLES,
    MARKS,
    PLANES,
    ROWS,
    WHOLE,
    float32,
    inner,
    int64,
    lane,
)

Plane = Any
"""A float32 array as numba compiles it."""
_ZERO = np.float32(0)
_CLEAR = 1e-9  # as in Ellipsoid.tangents


@inner
def _times(one: Any, other: Any) -> Any:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


@inner
def _tangents(away: Any, radii: Any, middle: Any, across: Any) -> Any:
    """Return what `Ellipsoid.tangents` does, of one that is so far away."""
    along, aside = _times(away, middle), _times(away, across)
    along_m, across_m = radii * middle, radii * across
    a = along * along - _times(along_m, along_m)
    if along <= 0 or a <= _CLEAR:
        return -np.inf, np.inf
    b = along * aside - _times(along_m, across_m)
    c = aside * aside - _times(across_m, across_m)
    root = np.sqrt(max(b * b - a * c, 0.0))
    return (b - root) / a, (b + root) / a


@inner
def _met_row(tiles: Any, low: Any, high: Any, down: Any, up: Any, of: Any) -> Any:
    """Mark the tiles of a row; return the first, and the one after the last."""
    width = len(tiles)
    for k in range(width):
        across = (low[k] <= of[1]) & (high[k] >= of[0])
        tiles[k] = across & (down[k] <= of[3]) & (up[k] >= of[2])
    first, after = 0, width
    while first < after and not tiles[first]:
        first += 1
    while after > first and not tiles[after - 1]:
        after -= 1
    return first, after


@lane(PLANES, DOUBLES, ROWS, PLANES, PLANES, ROWS, ROWS)
def met(axes: Any, apex: Any, frame: Any, low: Any, high: Any, lowest: Any, highest: Any) -> Any:
    """Return tiles whose lines may meet ellipsoids, and their spans of rows and of columns."""
    count, height, width = len(axes), low.shape[1], low.shape[2]
    tiles = np.zeros((count, height, width), np.bool_)
    spans = np.zeros((count, 4), int64)
    for n in range(count):
        away, radii = axes[n, 0] - apex, axes[n, 1]
        first, last = _tangents(away, radii, frame[0], frame[1])
        start, end = _tangents(away, radii, frame[0], frame[2])
        top, bottom, left, right = height, 0, width, 0
        for row in range(height):
            if lowest[0, row] > last or highest[0, row] < first:
                continue
            if lowest[1, row] > end or highest[1, row] < start:
                continue
            found = _met_row(
                tiles[n, row], low[0, row], high[0, row], low[1, row], high[1, row],
                (first, last, start, end),
            )  # fmt: skip
            if found[0] < found[1]:
                top, bottom = min(top, row), row + 1
                left, right = min(left, found[0]), max(right, found[1])
        if bottom:
            spans[n, 0], spans[n, 1], spans[n, 2], spans[n, 3] = top, bottom, left, right
    return tiles, spans


@lane(WHOLE, int64)
def shown_tiles(shown: Plane, side: int) -> Any:
    """Return tiles (R, C) of pixels whose shares are not all 0."""
    height, width = shown.shape
    rows, columns = (height + side - 1) // side, (width + side - 1) // side
    line, tiles = np.empty(columns * side, float32), np.zeros((rows, columns), np.bool_)
    for row in range(rows):
        for i in range(len(line)):
            line[i] = _ZERO
        for r in range(row * side, min((row + 1) * side, height)):
            part = shown[r]
            for i in range(width):
                line[i] = max(line[i], part[i])
        put = tiles[row]
        for c in range(columns):
            for i in range(c * side, (c + 1) * side):
                put[c] |= line[i] > _ZERO
    return tiles


@lane(MARKS, int64)
def grown(tiles: Any, beside: int) -> Any:
    """Return tiles that are marked, and those up to so many rows and columns beside one."""
    rows, columns = tiles.shape
    tall, wide = np.zeros(tiles.shape, np.bool_), np.zeros(tiles.shape, np.bool_)
    for row in range(rows):
        put = tall[row]
        for r in range(max(row - beside, 0), min(row + beside + 1, rows)):
            part = tiles[r]
            for c in range(columns):
                put[c] |= part[c]
    for row in range(rows):
        for step in range(-beside, beside + 1):
            first, after = max(-step, 0), min(columns, columns - step)
            put, part = wide[row, first:after], tall[row, first + step : after + step]
            for c in range(len(put)):
                put[c] |= part[c]
    return wide
