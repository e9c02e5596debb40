"""Points that are seen, the light on them, and moments: compiled arithmetic without edges.

Bytes are those of the statements in NumPy, as in `compiled_edges`.
"""

from typing import Any

import numpy as np

from transientcam_driver.simulation.light.compiling import (
    LINE,
    PLACES,
    PLANE,
    REGION,
    WHOLE,
    float32,
    int64,
    lane,
)

Plane = Any
"""A float32 array as numba compiles it."""
_ZERO, _ONE = np.float32(0), np.float32(1)


@lane(PLANE, PLANE, PLANE, PLANE, PLANE, int64, int64, LINE)
def points(
    share: Plane, at: Plane, x: Plane, y: Plane, z: Plane, top: int, left: int, apex: Any
) -> Any:
    """Return rows, columns, shares, t, points and ways of the pixels that show a surface."""
    count = 0
    for row in range(share.shape[0]):
        for column in range(share.shape[1]):
            count += share[row, column] != _ZERO
    places, lines, k = np.empty((2, count), int64), np.empty((8, count), float32), 0
    for row in range(share.shape[0]):
        for column in range(share.shape[1]):
            if share[row, column] == _ZERO:
                continue
            places[0, k], places[1, k] = row + top, column + left
            t = at[row, column]
            lines[0, k], lines[1, k] = share[row, column], t
            way = (
                x[row + top, column + left],
                y[row + top, column + left],
                z[row + top, column + left],
            )
            for axis in range(3):
                lines[2 + axis, k] = way[axis] * t + apex[axis]
                lines[5 + axis, k] = way[axis]
            k += 1
    return places, lines


@lane(PLACES, PLACES, int64, int64, int64, int64)
def around(rows: Any, columns: Any, top: int, left: int, height: int, width: int) -> Any:
    """Return what is around points in a region of an image."""
    count = len(rows)
    place = np.full((height + 2, width + 2), count, int64)
    for i in range(count):
        place[rows[i] - top + 1, columns[i] - left + 1] = i
    beside = np.empty((4, count), int64)
    for i in range(count):
        row, column = rows[i] - top + 1, columns[i] - left + 1
        beside[0, i], beside[1, i] = place[row - 1, column], place[row + 1, column]
        beside[2, i], beside[3, i] = place[row, column - 1], place[row, column + 1]
    return beside


@lane(LINE, LINE, LINE, LINE, LINE, LINE, LINE, LINE, PLACES)
def received(
    lamp: Any, axis: Any, x: Any, y: Any, z: Any, across: Any, along: Any, up: Any, on: Any
) -> Any:
    """Return lengths of the ways to a lamp, irradiance, and cosines to its axis, of points."""
    count = len(on)
    length_m, irradiance = np.empty(count, float32), np.empty(count, float32)
    cosine = np.empty(count, float32)
    for k in range(count):
        i = on[k]
        a, b, c = lamp[0] - x[i], lamp[1] - y[i], lamp[2] - z[i]
        length = np.sqrt(a * a + b * b + c * c)
        facing = a * across[i] + b * along[i] + c * up[i]
        length_m[k] = length
        irradiance[k] = max(facing, _ZERO) / (length * length * length)
        cosine[k] = -(a * axis[0] + b * axis[1] + c * axis[2]) / length
    return length_m, irradiance, cosine


@lane(WHOLE, WHOLE, WHOLE, int64, int64, int64, int64)
def darkened(
    moments: Plane, each: Plane, left: Plane, top: int, start: int, row: int, column: int
) -> Any:
    """Take from moments the part that a shadow leaves out of those by one chain of mirrors.

    Planes of moments hold real and imaginary parts in turn; the shadow begins at a row and a column
    of the moments, and at ``top`` and ``start`` of all pixels.
    """
    for r in range(left.shape[0]):
        for c in range(left.shape[1]):
            dark = _ONE - left[r, c]
            for k in range(2):
                part = dark * each[top + r, 2 * (start + c) + k]
                moments[row + r, 2 * (column + c) + k] -= part


@lane(WHOLE, REGION, float32, WHOLE, REGION, float32, WHOLE, REGION)
def blended(
    total: Plane, of: Any, one: Any, first: Plane, of_first: Any, other: Any, second: Plane,
    of_second: Any,
) -> Any:  # fmt: skip
    """Return moments of a region between two times, from those of the regions that differ then."""
    top, left, height, width = of
    mixed = np.empty((height, 2 * width), float32)
    then, later = np.empty(2 * width, float32), np.empty(2 * width, float32)
    for row in range(height):
        r = top + row
        for c in range(2 * width):
            then[c] = later[c] = total[r, 2 * left + c]
        place = r - of_first[0]
        if 0 <= place < of_first[2]:
            shift = 2 * (of_first[1] - left)
            for c in range(2 * of_first[3]):
                then[shift + c] = first[place, c]
        place = r - of_second[0]
        if 0 <= place < of_second[2]:
            shift = 2 * (of_second[1] - left)
            for c in range(2 * of_second[3]):
                later[shift + c] = second[place, c]
        for c in range(2 * width):
            mixed[row, c] = one * then[c] + other * later[c]
    return mixed
