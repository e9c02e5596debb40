"""Compiled: tiles of pixels whose lines may meet shapes, and those that are seen."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import (
    DOUBLES,
    MARKS,
    PLANES,
    ROWS,
    WHOLE,
    inner,
    int64,
    lane,
)
from transientcam_simulation.light._coverage import ZERO, Plane

Tiles = NDArray[np.bool_]
Doubles = NDArray[np.float64]
_CLEAR = 1e-9  # fraction of a way that counts as its end


@inner
def _dot(one: Doubles, other: Doubles) -> float:
    product: float = one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
    return product


@inner
def _tangents(
    away: Doubles, radii: Doubles, middle: Doubles, across: Doubles
) -> tuple[float, float]:
    """Return what `Rectangle.tangents` does, of an ellipsoid with its centre so far away."""
    along, aside = _dot(away, middle), _dot(away, across)
    along_m, across_m = radii * middle, radii * across
    a = along * along - _dot(along_m, along_m)
    if along <= 0 or a <= _CLEAR:
        return -np.inf, np.inf
    # planes through the apex that touch it: (aside - t along)^2 = |radii (across - t middle)|^2
    b = along * aside - _dot(along_m, across_m)
    c = aside * aside - _dot(across_m, across_m)
    root = np.sqrt(max(b * b - a * c, 0.0))
    return (b - root) / a, (b + root) / a


@lane(PLANES, DOUBLES, ROWS)
def tangents(axes: Doubles, apex: Doubles, frame: Doubles) -> Doubles:
    """Return lowest and highest tangents (N, 2, 2) of ellipsoids' angles at an apex.

    To the first of the directions of a frame, in the planes with each of the two others.
    ``axes`` (N, 2, 3) are centres and radii. Infinite where one reaches behind the apex.
    """
    limits = np.empty((len(axes), 2, 2), np.float64)
    for n in range(len(axes)):
        away, radii = axes[n, 0] - apex, axes[n, 1]
        for k in range(2):
            limits[n, k, 0], limits[n, k, 1] = _tangents(away, radii, frame[0], frame[k + 1])
    return limits


@inner
def _met_row(
    tiles: Tiles, low: Doubles, high: Doubles, down: Doubles, up: Doubles,
    of: tuple[float, float, float, float],
) -> tuple[int, int]:  # fmt: skip
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


@lane(PLANES, PLANES, PLANES, ROWS, ROWS)
def met(
    limits: Doubles, low: Doubles, high: Doubles, lowest: Doubles, highest: Doubles
) -> tuple[Tiles, NDArray[np.int64]]:
    """Return tiles whose lines may meet shapes, and their spans of rows and of columns.

    Of `tangents` of the shapes, of each tile's lines (2, R, C), and of each row's (2, R).
    """
    count, height, width = len(limits), low.shape[1], low.shape[2]
    tiles = np.zeros((count, height, width), np.bool_)
    spans = np.zeros((count, 4), np.int64)
    for n in range(count):
        first, last = limits[n, 0, 0], limits[n, 0, 1]
        start, end = limits[n, 1, 0], limits[n, 1, 1]
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
def shown_tiles(shown: Plane, side: int) -> Tiles:
    """Return tiles (R, C) of pixels whose shares are not all 0."""
    height, width = shown.shape
    rows, columns = (height + side - 1) // side, (width + side - 1) // side
    line, tiles = np.empty(columns * side, np.float32), np.zeros((rows, columns), np.bool_)
    for row in range(rows):
        for i in range(len(line)):
            line[i] = ZERO
        for r in range(row * side, min((row + 1) * side, height)):
            part = shown[r]
            for i in range(width):
                line[i] = max(line[i], part[i])
        put = tiles[row]
        for c in range(columns):
            for i in range(c * side, (c + 1) * side):
                put[c] |= line[i] > ZERO
    return tiles


@lane(MARKS, int64)
def grown(tiles: Tiles, beside: int) -> Tiles:
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
