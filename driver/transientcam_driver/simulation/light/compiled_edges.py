"""The arithmetic of `coverage`, `shares` and `ends` at edges, compiled.

Each gives the same bytes as the statement in NumPy that it stands beside: every operation is in
single precision, in the same order, and none is fused with another.
"""

from typing import Any

import numpy as np

from transientcam_driver.simulation.light.compiling import (
    AROUND,
    LINE,
    PLACES,
    PLANE,
    REGION,
    WHOLE,
    float32,
    inner,
    int64,
    lane,
)

Plane = Any
"""A float32 array as numba compiles it."""
_ZERO, _ONE, _TWO = np.float32(0), np.float32(1), np.float32(2)
_MEAN_BEND, _CUBE = np.float32(24), np.float32(1.5)
_LEAST, _GENTLEST = np.float32(1e-9), np.float32(1e-2)
_NAN = np.float32(np.nan)


@inner
def _slope(before: Any, after: Any) -> Any:
    if before * after > _ZERO:
        return np.abs(before + after) / _TWO, after - before
    one, other = np.abs(before), np.abs(after)
    smaller = other if np.isnan(one) or other < one else one
    return (_ZERO if np.isnan(smaller) else smaller), _ZERO


@inner
def _half_plane(value: Any, steep: Any, gentle: Any) -> Any:
    steep = max(steep, _LEAST)
    gentle = max(gentle, _GENTLEST * steep)
    half, rest = (steep + gentle) / _TWO, (steep - gentle) / _TWO
    if np.isnan(value):
        return _ZERO
    if value >= half:
        return _ONE
    a, b = max(value + half, _ZERO), max(value + rest, _ZERO)
    c, d = max(value - rest, _ZERO), max(value - half, _ZERO)
    area = a * a
    area = area + -b * b
    area = area + -c * c
    area = area + d * d
    return min(max(area / (_TWO * steep * gentle), _ZERO), _ONE)


@inner
def _alike(value: Any, up: Any, down: Any, left: Any, right: Any) -> Any:
    """Whether all are on the same side of 0, so that no border crosses the pixel."""
    on = value > _ZERO
    level = (up > _ZERO) == on and (down > _ZERO) == on
    return level and (left > _ZERO) == on and (right > _ZERO) == on


@inner
def _at_border(value: Any, up: Any, down: Any, left: Any, right: Any) -> Any:
    """Return share, mean over the pixel, and slopes."""
    along, bend = _slope(value - up, down - value)
    across, more = _slope(value - left, right - value)
    value = value + (bend + more) / _MEAN_BEND
    share = _half_plane(value, max(along, across), min(along, across))
    return share, value, along, across


@inner
def _share(inside: Plane, row: int, column: int) -> Any:
    """Return share of a pixel as `coverage.covered`; at a border, the mean square root there."""
    height, width = inside.shape
    value = inside[row, column]
    up = inside[row - 1 if row > 0 else min(1, height - 1), column]
    down = inside[row + 1 if row < height - 1 else max(height - 2, 0), column]
    left = inside[row, column - 1 if column > 0 else min(1, width - 1)]
    right = inside[row, column + 1 if column < width - 1 else max(width - 2, 0)]
    if _alike(value, up, down, left, right):
        return (_ONE if value > _ZERO else _ZERO), _ZERO, False
    share, value, along, across = _at_border(value, up, down, left, right)
    width_ = np.sqrt(along * along + across * across)
    high, low = max(value + width_ / _TWO, _LEAST), max(value - width_ / _TWO, _ZERO)
    cubes = high * np.sqrt(high) - low * np.sqrt(low)
    return share, cubes / max(_CUBE * (high - low), _LEAST), True


@inner
def _share_among(values: Any, around: Any, i: int) -> Any:
    """Return share of one of some pixels, as `coverage.covered_among`; the last value is NaN."""
    value = values[i]
    up, down = values[around[0, i]], values[around[1, i]]
    left, right = values[around[2, i]], values[around[3, i]]
    if _alike(value, up, down, left, right):
        return _ONE if value > _ZERO else _ZERO
    return _at_border(value, up, down, left, right)[0]


@inner
def _squared(ball: Any, x: Any, y: Any, z: Any) -> Any:
    """Return the squared length of a line's way, where an ellipsoid is a unit sphere."""
    x, y, z = x * ball[0], y * ball[1], z * ball[2]
    squared = x * x
    squared = squared + y * y
    squared = squared + z * z
    return squared + ball[7]


@inner
def _along(ball: Any, x: Any, y: Any, z: Any) -> Any:
    """Return the way times the origin there."""
    along = x * ball[0] * ball[3]
    along = along + y * ball[1] * ball[4]
    return along + z * ball[2] * ball[5]


@inner
def _of_rectangle(plate: Any, x: Any, y: Any, z: Any) -> Any:
    """Return both functions and the t of a line, and its way along the normal."""
    normal, right, up = plate
    facing = x * normal[0] + y * normal[1] + z * normal[2]
    at = normal[3] / (facing + normal[4])
    place = at * (x * right[0] + y * right[1] + z * right[2] + normal[4])
    one = _ONE - np.abs(place + right[3]) * right[4]
    place = at * (x * up[0] + y * up[1] + z * up[2] + normal[4])
    other = _ONE - np.abs(place + up[3]) * up[4]
    return one, other, at, facing


@inner
def _eight(ball: Any) -> Any:
    """Return its numbers, which a loop then need not load anew."""
    return ball[0], ball[1], ball[2], ball[3], ball[4], ball[5], ball[6], ball[7]


@inner
def _axes(plate: Any) -> Any:
    one, two, three = plate[0], plate[1], plate[2]
    return (
        (one[0], one[1], one[2], one[3], one[4]),
        (two[0], two[1], two[2], two[3], two[4]),
        (three[0], three[1], three[2], three[3], three[4]),
    )


@inner
def _inside_row(ball: Any, x: Any, y: Any, z: Any, inside: Any) -> Any:
    """Cross a row of lines with an ellipsoid; return the span of those that meet it."""
    for i in range(len(x)):
        along = _along(ball, x[i], y[i], z[i])
        inside[i] = along * (along / _squared(ball, x[i], y[i], z[i])) + ball[6]
    first, after = 0, len(x)
    while first < after and not inside[first] > _ZERO:
        first += 1
    while after > first and not inside[after - 1] > _ZERO:
        after -= 1
    return (first, after) if first < after else (len(x), 0)


@inner
def _entered_row(ball: Any, x: Any, y: Any, z: Any, inside: Any, at: Any) -> None:
    """Put the t at which lines enter an ellipsoid in a row, but for pixels at its border."""
    for i in range(len(x)):
        squared = _squared(ball, x[i], y[i], z[i])
        root = np.sqrt(max(inside[i], _ZERO))
        at[i] = -(_along(ball, x[i], y[i], z[i]) / squared) - root / np.sqrt(squared)


@inner
def _cross(ball: Any, x: Plane, y: Plane, z: Plane, of: Any, inside: Plane, spans: Any) -> None:
    """Cross the lines of a region; row by row, put where pixels may be covered in ``spans``."""
    top, left, height, width = of
    right = left + width
    met = np.empty((height, 2), int64)
    for row in range(height):
        r = top + row
        met[row, 0], met[row, 1] = _inside_row(
            ball, x[r, left:right], y[r, left:right], z[r, left:right], inside[row]
        )
    for row in range(height):
        first, after = met[row, 0] - 1, met[row, 1] + 1
        for beside in range(max(row - 1, 0), min(row + 2, height)):
            first, after = min(first, met[beside, 0]), max(after, met[beside, 1])
        spans[row, 0], spans[row, 1] = max(first, 0), min(after, width)


@lane(LINE, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, REGION)
def seen(
    numbers: Any, x: Plane, y: Plane, z: Plane, near: Plane, far: Plane, fills: Plane, of: Any
) -> Any:
    """Return shares of pixels that show an ellipsoid, and where their lines enter it."""
    top, left, height, width = of
    ball, right = _eight(numbers), left + width
    inside, at = np.empty((height, width), float32), np.empty((height, width), float32)
    share, spans = np.zeros((height, width), float32), np.empty((height, 2), int64)
    _cross(ball, x, y, z, of, inside, spans)
    for row in range(height):
        r = top + row
        _entered_row(
            ball, x[r, left:right], y[r, left:right], z[r, left:right], inside[row], at[row]
        )
        for column in range(spans[row, 0], spans[row, 1]):
            c = left + column
            part, root, border = _share(inside, row, column)
            if border:
                squared = _squared(ball, x[r, c], y[r, c], z[r, c])
                closest = -(_along(ball, x[r, c], y[r, c], z[r, c]) / squared)
                at[row, column] = closest - root / np.sqrt(squared)
            if at[row, column] > near[r, c] and at[row, column] < far[r, c]:
                share[row, column] = part * fills[r, c]
    return share, at


@lane(LINE, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, REGION, float32)
def shaded(
    numbers: Any, x: Plane, y: Plane, z: Plane, near: Plane, far: Plane, of: Any, touching: Any
) -> Any:
    """Return shares of pixels whose light an ellipsoid blocks."""
    top, left, height, width = of
    ball = _eight(numbers)
    inside, spans = np.empty((height, width), float32), np.empty((height, 2), int64)
    share = np.zeros((height, width), float32)
    _cross(ball, x, y, z, of, inside, spans)
    for row in range(height):
        r = top + row
        for column in range(spans[row, 0], spans[row, 1]):
            c = left + column
            part = _share(inside, row, column)[0]
            if part > _ZERO:
                squared = _squared(ball, x[r, c], y[r, c], z[r, c])
                at = -(_along(ball, x[r, c], y[r, c], z[r, c]) / squared)
                if at > near[r, c] + touching and at < far[r, c] * (_ONE - touching):
                    share[row, column] = part
    return share


@lane(PLANE)
def covered(inside: Plane) -> Any:
    """Return shares of pixels where a function is above 0."""
    share = np.empty(inside.shape, float32)
    for row in range(inside.shape[0]):
        for column in range(inside.shape[1]):
            share[row, column] = _share(inside, row, column)[0]
    return share


@lane(PLANE, PLANE)
def overlapped(one: Plane, other: Plane) -> Any:
    """Return the share of each pixel that lies in both of two shapes."""
    height, width = one.shape
    both = np.empty(one.shape, float32)
    for row in range(height):
        up = row - 1 if row > 0 else min(1, height - 1)
        down = row + 1 if row < height - 1 else max(height - 2, 0)
        for column in range(width):
            first, second = one[row, column], other[row, column]
            across = first * second
            both[row, column] = across
            if not (first > _ZERO and first < _ONE and second > _ZERO and second < _ONE):
                continue
            left = column - 1 if column > 0 else min(1, width - 1)
            right = column + 1 if column < width - 1 else max(width - 2, 0)
            x, y = one[down, column] - one[up, column], one[row, right] - one[row, left]
            u, v = other[down, column] - other[up, column], other[row, right] - other[row, left]
            size = np.sqrt((x * x + y * y) * (u * u + v * v))
            cosine = (x * u + y * v) / max(size, _LEAST)
            along = max(first + second - _ONE, _ZERO)
            if cosine > _ZERO:
                along = min(first, second)
            both[row, column] = across + cosine * cosine * (along - across)
    return both


@lane(LINE, LINE, LINE, LINE, LINE, float32, PLACES, int64, AROUND, LINE)
def dim_softly(
    numbers: Any, x: Any, y: Any, z: Any, near: Any, touching: Any, index: Any, own: int,
    around: Any, clear: Any,
) -> Any:  # fmt: skip
    """Take from the light at points what an ellipsoid covers of the pixels around them."""
    ball, count, met = _eight(numbers), len(x), 0
    values = np.empty(count + 1, float32)
    values[count] = _NAN
    for i in range(count):
        squared, along = _squared(ball, x[i], y[i], z[i]), _along(ball, x[i], y[i], z[i])
        value, at = along * (along / squared) + ball[6], -(along / squared)
        counts = (at > near[i] + touching) & (at < _ONE - touching) & (index[i] != own)
        met += counts & (value > _ZERO)
        away = (at - _ONE) * np.sqrt(squared)
        values[i] = value if counts & (not away * away < value) else _NAN
    if met:
        for i in range(count):
            clear[i] *= _ONE - _share_among(values, around, i)


@lane(WHOLE, LINE, LINE, LINE, LINE, float32, PLACES, int64, LINE)
def dim_behind(
    plate: Any, x: Any, y: Any, z: Any, near: Any, touching: Any, index: Any, own: int, clear: Any
) -> Any:
    """Take the light from points whose way to it meets a rectangle."""
    axes = _axes(plate)
    for i in range(len(x)):
        one, other, at, _facing = _of_rectangle(axes, x[i], y[i], z[i])
        between = (at > near[i] + touching) & (at < _ONE - touching) & (index[i] != own)
        clear[i] = _ZERO if between & (one > _ZERO) & (other > _ZERO) else clear[i]


@lane(WHOLE, LINE, LINE, LINE, float32, AROUND)
def shown(plate: Any, x: Any, y: Any, z: Any, touching: Any, around: Any) -> Any:
    """Return the points that a mirror shows the light to, its shares of their pixels, and its t."""
    axes, count, met = _axes(plate), len(x), 0
    first, second = np.empty(count + 1, float32), np.empty(count + 1, float32)
    at, kept, found = np.empty(count, float32), np.empty(count, int64), 0
    first[count] = second[count] = _NAN
    for i in range(count):
        one, other, t, facing = _of_rectangle(axes, x[i], y[i], z[i])
        shows = (t > _ZERO + touching) & (t < _ONE - touching) & (facing > _ZERO)
        first[i], second[i], at[i] = one if shows else _NAN, other if shows else _NAN, t
        met += shows & (one > _ZERO) & (other > _ZERO)
    share = np.empty(count, float32)
    for i in range(count if met else 0):
        part = _share_among(first, around, i) * _share_among(second, around, i)
        if part != _ZERO:
            share[found], at[found], kept[found] = part, at[i], i
            found += 1
    return kept[:found], share[:found], at[:found]
