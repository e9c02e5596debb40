"""Compiled: light of patches at points between the patches' centres."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import (
    AROUND,
    CHUNK,
    DOUBLES,
    LINE,
    NUMBERS,
    WHOLE,
    inner,
    kernel,
)
from transientcam_simulation.light._coverage import LEAST, ONE, ZERO, Plane

Indices = NDArray[np.int32]
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


@inner
def _place(
    x: Plane, y: Plane, z: Plane, ball: Plane, rows: np.float32, columns: np.float32,
    one: Indices, other: Indices, right: Plane, up: Plane,
) -> None:  # fmt: skip
    """Put which two patches are below each point of an ellipsoid, and shares of those beside.

    Numbers of patches are whole numbers of single precision until they are put.
    """
    for i in range(len(x)):
        across = (x[i] - ball[0]) * ball[3]
        along = (y[i] - ball[1]) * ball[4]
        height = min(max((z[i] - ball[2]) * ball[5], -ONE), ONE)
        wide, deep = abs(across), abs(along)
        slope = min(wide, deep) / max(wide, deep, LEAST)
        square = slope * slope
        turn = ((_FIFTH * square + _THIRD) * square + _FIRST) * square * slope + slope
        turn = turn / _TURN
        turn = _QUARTER - turn if deep > wide else turn
        turn = _HALF - turn if across < ZERO else turn
        turn = -turn if along < ZERO else turn
        place = (turn + _HALF) * columns - _HALF
        level = (height + ONE) * _HALF * rows - _HALF
        column = np.floor(place)
        row = min(max(np.floor(level), ZERO), rows - ONE - ONE)
        right[i], up[i] = place - column, min(max(level - row, ZERO), ONE)
        after = column + ONE
        one[i] = np.int32(row * columns + (column + columns if column < ZERO else column))
        other[i] = np.int32(row * columns + (ZERO if after >= columns else after))


@kernel(LINE, LINE, LINE, WHOLE, NUMBERS, WHOLE, WHOLE)
def on_ellipsoids(
    x: Plane, y: Plane, z: Plane, balls: Plane, spans: NDArray[np.int64], light: Plane, on: Plane
) -> None:  # fmt: skip
    """Put moments (P, 2) on points of ellipsoids, given those of patches (M, 2).

    ``balls`` (N, 6) are centres, and one over the radii; ``spans`` (N, 5) where the points of each
    begin and end, its first patch, and its rows and columns of patches.
    """
    one, other = np.empty(CHUNK, np.int32), np.empty(CHUNK, np.int32)
    right, up = np.empty(CHUNK, np.float32), np.empty(CHUNK, np.float32)
    for n in range(len(balls)):
        first, rows, columns = spans[n, 2], spans[n, 3], spans[n, 4]
        for start in range(spans[n, 0], spans[n, 1], CHUNK):
            count = min(spans[n, 1] - start, CHUNK)
            end = start + count
            _place(
                x[start:end], y[start:end], z[start:end], balls[n],
                np.float32(rows), np.float32(columns),
                one[:count], other[:count], right[:count], up[:count],
            )  # fmt: skip
            for i in range(count):
                low, next_low = first + one[i], first + other[i]
                high, next_high = low + columns, next_low + columns
                for part in range(2):
                    below = light[low, part] + right[i] * (light[next_low, part] - light[low, part])
                    above = light[high, part] + right[i] * (
                        light[next_high, part] - light[high, part]
                    )
                    on[start + i, part] = below + up[i] * (above - below)


@kernel(WHOLE, DOUBLES, LINE, LINE)
def sent(on: Plane, reflectance: NDArray[np.float64], cosine: Plane, sine: Plane) -> None:
    """Turn moments (P, 2) on points by their ways to the camera, which get a share of them."""
    for i in range(len(on)):
        share = np.float32(reflectance[i])
        real, imaginary = share * on[i, 0], share * on[i, 1]
        on[i, 0] = real * cosine[i] - imaginary * sine[i]
        on[i, 1] = real * sine[i] + imaginary * cosine[i]
