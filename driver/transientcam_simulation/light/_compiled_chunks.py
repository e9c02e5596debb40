"""Compiled: points that are seen, chunks of them, and what is beside them."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import (
    AROUND,
    CHUNK,
    INDICES,
    LINE,
    PIXELS,
    PLACES,
    WHOLE,
    inner,
    int64,
    lane,
)
from transientcam_simulation.light._coverage import ZERO, Plane

Indices = NDArray[np.int32]
Places = NDArray[np.int64]


@inner
def _put_run(
    share: Plane, at: Plane, way: tuple[Plane, Plane, Plane], apex: Plane, k: int, lines: Plane
) -> None:
    """Put what is known of successive pixels of a row into columns from one on."""
    for axis in range(3):
        each, start = way[axis], apex[axis]
        points, ways = lines[2 + axis, k : k + len(at)], lines[5 + axis, k : k + len(at)]
        for i in range(len(at)):
            points[i], ways[i] = each[i] * at[i] + start, each[i]
    shares, t = lines[0, k : k + len(at)], lines[1, k : k + len(at)]
    for i in range(len(at)):
        shares[i], t[i] = share[i], at[i]


@lane(WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, int64, int64, LINE, int64, PIXELS, WHOLE)
def points(
    share: Plane, at: Plane, x: Plane, y: Plane, z: Plane, top: int, left: int, apex: Plane,
    start: int, places: Indices, lines: Plane,
) -> None:  # fmt: skip
    """Put rows, columns, shares, t, points and ways of the pixels that show a surface."""
    k, width = start, share.shape[1]
    for row in range(share.shape[0]):
        shown, r, column = share[row], row + top, 0
        while column < width:
            if shown[column] == ZERO:
                column += 1
                continue
            first = column
            while column < width and shown[column] != ZERO:
                column += 1
            a, b, after = first + left, column + left, k + column - first
            rows, columns = places[0, k:after], places[1, k:after]
            for i in range(len(rows)):
                rows[i], columns[i] = r, a + i
            _put_run(
                shown[first:column], at[row, first:column], (x[r, a:b], y[r, a:b], z[r, a:b]),
                apex, k, lines,
            )  # fmt: skip
            k = after


@lane(INDICES, INDICES, int64, int64, int64, int64)
def around(
    rows: Indices, columns: Indices, top: int, left: int, height: int, width: int
) -> Indices:
    """Return what is around points in a region of an image."""
    count, wide = len(rows), width + 2
    place = np.full((height + 2) * wide, count, np.int32)
    at, beside = np.empty(count, np.int32), np.empty((4, count), np.int32)
    for i in range(count):
        at[i] = (rows[i] - top + 1) * wide + columns[i] - left + 1
    for i in range(count):
        place[at[i]] = i
    above, below, before, after = beside[0], beside[1], beside[2], beside[3]
    for i in range(count):
        middle = at[i]
        above[i], below[i] = place[middle - wide], place[middle + wide]
        before[i], after[i] = place[middle - 1], place[middle + 1]
    return beside


@lane(PLACES, AROUND)
def among(on: Places, beside: Indices) -> Indices:
    """Return what is beside some of the points, by their own indices."""
    place = np.empty(beside.shape[1] + 1, np.int32)
    for k in range(len(place)):
        place[k] = len(on)
    for k in range(len(on)):
        place[on[k]] = k
    found = np.empty((4, len(on)), np.int32)
    for side in range(4):
        for k in range(len(on)):
            found[side, k] = place[beside[side, on[k]]]
    return found


@lane(AROUND)
def reach(beside: Indices) -> tuple[Places, NDArray[np.bool_]]:
    """Return chunks of the points beside those of each chunk, and which points lack neighbours.

    Of those above, below, left and right, the first chunk, and the one after the last.
    """
    count = beside.shape[1]
    chunks = (count + CHUNK - 1) // CHUNK
    reached, rim = np.zeros((chunks, 8), np.int64), np.zeros(count, np.bool_)
    for c in range(chunks):
        start, stop = c * CHUNK, min((c + 1) * CHUNK, count)
        alone = rim[start:stop]
        for k in range(4):
            places, first, last = beside[k, start:stop], count, -1
            for i in range(len(places)):
                none = places[i] == count
                first, last = min(first, places[i]), max(last, -1 if none else places[i])
                alone[i] |= none
            if last >= 0:
                reached[c, 2 * k], reached[c, 2 * k + 1] = first // CHUNK, last // CHUNK + 1
    return reached, rim


@inner
def _ordered(bits: np.int32) -> np.int32:
    """Return a number that is ordered as the float32 that has these bits; again, they return."""
    return bits ^ ((bits >> np.int32(31)) & np.int32(0x7FFFFFFF))


@inner
def _bounds(bits: Indices) -> tuple[np.int32, np.int32]:
    """Return the bits of the least and the greatest of a chunk of numbers, none of them NaN.

    Compilers make vectors of such loops over integers, which have an order of all values.
    """
    least = greatest = _ordered(bits[0])
    for i in range(len(bits)):
        each = _ordered(bits[i])
        least, greatest = min(least, each), max(greatest, each)
    return _ordered(least), _ordered(greatest)


@lane(LINE, LINE, LINE)
def boxes(x: Plane, y: Plane, z: Plane) -> Plane:
    """Return boxes (6, C) around successive chunks of points: lowest coordinates, then highest."""
    count = len(x)
    chunks = (count + CHUNK - 1) // CHUNK
    found = np.empty((6, chunks), np.float32)
    bits = found.view(np.int32)
    u, v, w = x.view(np.int32), y.view(np.int32), z.view(np.int32)
    for c in range(chunks):
        a, b = c * CHUNK, min((c + 1) * CHUNK, count)
        bits[0, c], bits[3, c] = _bounds(u[a:b])
        bits[1, c], bits[4, c] = _bounds(v[a:b])
        bits[2, c], bits[5, c] = _bounds(w[a:b])
    return found
