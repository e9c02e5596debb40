"""The arithmetic of `coverage`, `shares` and `ends` at edges, compiled.

Each gives the same bytes as the statement in NumPy that it stands beside: every operation is in
single precision, in the same order, and none is fused with another.
"""

from typing import Any

import numpy as np

from transientcam_simulation.compiled import (
    AROUND,
    CHUNK,
    DOUBLES,
    FLAGS,
    INDICES,
    LINE,
    MARKS,
    NUMBERS,
    PLANE,
    PLANES,
    REGION,
    ROWS,
    TILES,
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
_HALF, _SURELY, _ROUNDED = np.float32(0.5), np.float32(1.001), np.float32(1e-5)
_NAN, _TINY = np.float32(np.nan), np.float32(1e-12)


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
def _beside(place: int, count: int) -> Any:
    """Return the places before and after one; at an end, the one on the other side for both."""
    before = place - 1 if place > 0 else min(1, count - 1)
    after = place + 1 if place < count - 1 else max(count - 2, 0)
    return before, after


@inner
def _share(inside: Plane, row: int, column: int) -> Any:
    """Return share of a pixel at a border as `coverage.covered`, and the mean square root there."""
    above, below = _beside(row, inside.shape[0])
    before, after = _beside(column, inside.shape[1])
    share, value, along, across = _at_border(
        inside[row, column], inside[above, column], inside[below, column],
        inside[row, before], inside[row, after],
    )  # fmt: skip
    width = np.sqrt(along * along + across * across)
    high, low = max(value + width / _TWO, _LEAST), max(value - width / _TWO, _ZERO)
    cubes = high * np.sqrt(high) - low * np.sqrt(low)
    return share, cubes / max(_CUBE * (high - low), _LEAST)


@inner
def _mark(inside: Plane, row: int, start: int, end: int, border: Any) -> None:
    """Mark pixels of a row, from ``start`` to ``end``, with a neighbour on the other side of 0.

    In loops that a compiler makes vectors of: few pixels are at a border.
    """
    height, width = inside.shape
    above, below = _beside(row, height)
    on, marks = inside[row, start:end], border[start:end]
    up, down = inside[above, start:end], inside[below, start:end]
    for i in range(len(on)):
        there = on[i] > _ZERO
        marks[i] = ((up[i] > _ZERO) != there) | ((down[i] > _ZERO) != there)
    # at an end, the neighbour on the other side stands for both, which the other loop compares
    first, after = max(start, 1), min(end, width - 1)
    on, beside, marks = inside[row, first:end], inside[row, first - 1 : end - 1], border[first:end]
    for i in range(len(on)):
        marks[i] |= (on[i] > _ZERO) != (beside[i] > _ZERO)
    on, beside, marks = (
        inside[row, start:after],
        inside[row, start + 1 : after + 1],
        border[start:after],
    )
    for i in range(len(on)):
        marks[i] |= (on[i] > _ZERO) != (beside[i] > _ZERO)


@inner
def _at_rim(values: Any, around: Any, i: int) -> Any:
    """Return share of one of some pixels at a border; the last value is NaN."""
    up, down = values[around[0, i]], values[around[1, i]]
    left, right = values[around[2, i]], values[around[3, i]]
    return _at_border(values[i], up, down, left, right)[0]


@inner
def _shares_among(values: Any, around: Any, start: int, share: Any, border: Any) -> None:
    """Put shares of a chunk of pixels, as `coverage.covered_among`; the last value is NaN.

    Borders are marked in loops that a compiler makes vectors of: few pixels are at one.
    """
    on = values[start : start + len(share)]
    for i in range(len(share)):
        share[i] = _ONE if on[i] > _ZERO else _ZERO
        border[i] = False
    for side in range(4):
        places = around[side, start : start + len(share)]
        for i in range(len(share)):
            border[i] |= (values[places[i]] > _ZERO) != (on[i] > _ZERO)
    for i in range(len(share)):
        if border[i]:
            share[i] = _at_rim(values, around, start + i)


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
def _ball(axes: Any, apex: Any) -> Any:
    """Return the numbers of an ellipsoid, as `coverage.ball_of`, of its centre and its radii."""
    centre, radii = axes[0], axes[1]
    x = (apex[0] - centre[0]) / radii[0]
    y = (apex[1] - centre[1]) / radii[1]
    z = (apex[2] - centre[2]) / radii[2]
    return (
        float32(1 / radii[0]), float32(1 / radii[1]), float32(1 / radii[2]),
        float32(x), float32(y), float32(z),
        float32(1 - (x * x + y * y + z * z)), _TINY,
    )  # fmt: skip


@inner
def _axes(plate: Any) -> Any:
    one, two, three = plate[0], plate[1], plate[2]
    return (
        (one[0], one[1], one[2], one[3], one[4]),
        (two[0], two[1], two[2], two[3], two[4]),
        (three[0], three[1], three[2], three[3], three[4]),
    )


@inner
def _row(plane: Plane, row: int) -> Any:
    """Return a row of a plane; of one that holds a single row, that one stands for all."""
    return plane[min(row, len(plane) - 1)]


@inner
def _cross_row(ball: Any, x: Any, y: Any, z: Any, inside: Any, at: Any) -> Any:
    """Cross a row of lines with an ellipsoid; return the span of those that meet it.

    Put the t at which they enter it, but for pixels at its border.
    """
    for i in range(len(x)):
        squared, along = _squared(ball, x[i], y[i], z[i]), _along(ball, x[i], y[i], z[i])
        closest = along / squared
        value = along * closest + ball[6]
        inside[i] = value
        at[i] = -closest - np.sqrt(max(value, _ZERO)) / np.sqrt(squared)
    first, after = 0, len(x)
    while first < after and not inside[first] > _ZERO:
        first += 1
    while after > first and not inside[after - 1] > _ZERO:
        after -= 1
    return (first, after) if first < after else (len(x), 0)


@inner
def _cross(
    ball: Any, x: Plane, y: Plane, z: Plane, of: Any, inside: Plane, at: Plane, spans: Any
) -> None:
    """Cross the lines of a region; row by row, put where pixels may be covered in ``spans``."""
    top, left, height, width = of
    right = left + width
    met = np.empty((height, 2), int64)
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
def _show(at: Any, inside: Any, near: Any, far: Any, fills: Any, share: Any) -> None:
    """Put shares of pixels of a row that show an ellipsoid, but for those at its border."""
    for i in range(len(at)):
        shows = (inside[i] > _ZERO) & (at[i] > near[i]) & (at[i] < far[i])
        share[i] = fills[i] if shows else _ZERO


@lane(ROWS, DOUBLES, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, REGION)
def seen(
    axes: Any, apex: Any, x: Plane, y: Plane, z: Plane, near: Plane, far: Plane, fills: Plane,
    of: Any,
) -> Any:  # fmt: skip
    """Return shares of pixels that show an ellipsoid, and where their lines enter it.

    Of planes of one row, all rows are alike.
    """
    top, left, height, width = of
    ball = _ball(axes, apex)
    inside, at = np.empty((height, width), float32), np.empty((height, width), float32)
    share, spans = np.zeros((height, width), float32), np.empty((height, 2), int64)
    border = np.zeros(width, np.bool_)
    _cross(ball, x, y, z, of, inside, at, spans)
    for row in range(height):
        r, start, end = top + row, spans[row, 0], spans[row, 1]
        if start >= end:
            continue
        _mark(inside, row, start, end, border)
        since, until, full = _row(near, r), _row(far, r), _row(fills, r)
        a, b = left + start, left + end
        _show(
            at[row, start:end], inside[row, start:end], since[a:b], until[a:b], full[a:b],
            share[row, start:end],
        )  # fmt: skip
        for column in range(start, end):
            if border[column]:
                c = left + column
                part, root = _share(inside, row, column)
                squared = _squared(ball, x[r, c], y[r, c], z[r, c])
                closest = -(_along(ball, x[r, c], y[r, c], z[r, c]) / squared)
                at[row, column] = closest - root / np.sqrt(squared)
                shows = at[row, column] > since[c] and at[row, column] < until[c]
                share[row, column] = part * full[c] if shows else _ZERO
    return share, at


@inner
def _runs(tiles: Any, side: int, of: Any, grown: int) -> Any:
    """Return runs of tiles in the rows of a region that are met, or beside such if grown.

    As rows and columns of pixels in the region: the first ones, and those after the last.
    """
    top, start, height, width = of
    first_tile, tile_after = start // side, (start + width + side - 1) // side
    rows, columns = (height + side - 1) // side, tile_after - first_tile
    runs, count = np.empty((rows * (columns // 2 + 1), 4), int64), 0
    wanted = np.empty(columns + 1, np.bool_)
    wanted[columns] = False
    for k in range(rows):
        row = top // side + k
        line = tiles[row, first_tile:tile_after]
        wanted[:columns] = line
        if grown:
            for r in range(max(row - 1, 0), min(row + 2, tiles.shape[0])):
                line = tiles[r, first_tile:tile_after]
                for c in range(columns):
                    wanted[c] |= line[c]
                for c in range(columns - 1):
                    wanted[c] |= line[c + 1]
                for c in range(1, columns):
                    wanted[c] |= line[c - 1]
        first = -1
        for c in range(columns + 1):
            if wanted[c] and first < 0:
                first = c
            elif not wanted[c] and first >= 0:
                runs[count, 0], runs[count, 1] = k * side, min((k + 1) * side, height)
                runs[count, 2], runs[count, 3] = first * side, min(c * side, width)
                first, count = -1, count + 1
    return runs[:count]


@inner
def _cross_run(ball: Any, x: Any, y: Any, z: Any, inside: Any, closest: Any, share: Any) -> None:
    """Cross some lines of a row with an ellipsoid."""
    for i in range(len(x)):
        along = _along(ball, x[i], y[i], z[i])
        at = along / _squared(ball, x[i], y[i], z[i])
        inside[i] = along * at + ball[6]
        closest[i] = -at
        share[i] = _ZERO


@inner
def _block(inside: Any, closest: Any, near: Any, far: Any, touching: Any, share: Any) -> Any:
    """Put shares of pixels of a row whose light is blocked, but for those at a border."""
    found = 0
    for i in range(len(inside)):
        blocks = (closest[i] > near[i] + touching) & (closest[i] < far[i] * (_ONE - touching))
        share[i] = _ONE if blocks & (inside[i] > _ZERO) else _ZERO
        found += share[i] > _ZERO
    return found > 0


@inner
def _overlap(one: Any, other: Any, row: int, column: int, of: Any, sign: Any) -> Any:
    """Return the share of a pixel in both of two shapes.

    The first has a plane of all pixels, the second one of a region, of its rest if the sign is -1.
    """
    top, start, height, width = of
    first, second = one[top + row, start + column], other[row, column]
    if sign < _ZERO:
        second = _ONE - second
    across = first * second
    if not (first > _ZERO and first < _ONE and second > _ZERO and second < _ONE):
        return across
    (up, down), (left, right) = _beside(row, height), _beside(column, width)
    r, c = top + row, start + column
    x = one[top + down, c] - one[top + up, c]
    y = one[r, start + right] - one[r, start + left]
    u, v = other[down, column] - other[up, column], other[row, right] - other[row, left]
    if sign < _ZERO:
        u = (_ONE - other[down, column]) - (_ONE - other[up, column])
        v = (_ONE - other[row, right]) - (_ONE - other[row, left])
    size = np.sqrt((x * x + y * y) * (u * u + v * v))
    cosine = (x * u + y * v) / max(size, _LEAST)
    along = max(first + second - _ONE, _ZERO)
    if cosine > _ZERO:
        along = min(first, second)
    return across + cosine * cosine * (along - across)


@inner
def _shade(
    ball: Any, lines: Any, tiles: Any, side: int, of: Any, touching: Any, left: Plane
) -> bool:
    """Take from shares of light what an ellipsoid blocks; whether it blocks any."""
    x, y, z, near, far = lines
    top, start, height, width = of
    inside, closest = np.empty((height, width), float32), np.empty((height, width), float32)
    share, marks = np.empty((height, width), float32), np.empty(width, np.bool_)
    for run in _runs(tiles, side, of, 1):
        first, end = run[2], run[3]
        for row in range(run[0], run[1]):
            r, a, b = top + row, start + first, start + end
            _cross_run(
                ball, x[r, a:b], y[r, a:b], z[r, a:b], inside[row, first:end],
                closest[row, first:end], share[row, first:end],
            )  # fmt: skip
    found, runs, count = False, _runs(tiles, side, of, 0), 0
    border = np.empty((height * width, 2), np.int32)
    for run in runs:
        first, end = run[2], run[3]
        for row in range(run[0], run[1]):
            since, until = _row(near, top + row), _row(far, top + row)
            _mark(inside, row, first, end, marks)
            found |= _block(
                inside[row, first:end], closest[row, first:end],
                since[start + first : start + end], until[start + first : start + end],
                touching, share[row, first:end],
            )  # fmt: skip
            for column in range(first, end):
                if marks[column]:
                    at, c = closest[row, column], start + column
                    part = _share(inside, row, column)[0]
                    between = at > since[c] + touching and at < until[c] * (_ONE - touching)
                    share[row, column] = part if between else _ZERO
                    found |= share[row, column] > _ZERO
                    border[count, 0], border[count, 1] = row, column
                    count += 1
    if found:
        _take(left, share, border[:count], runs, of)
    return found


@inner
def _take(left: Plane, share: Plane, border: Any, runs: Any, of: Any) -> None:
    """Take shares of pixels from what is left of light, as `coverage.overlapped`."""
    top, start, _height, _width = of
    kept = np.empty(len(border), float32)
    for k in range(len(border)):  # before anything is taken that others are compared with
        kept[k] = _overlap(left, share, border[k, 0], border[k, 1], of, -_ONE)
    for run in runs:
        for row in range(run[0], run[1]):
            light, dark = (
                left[top + row, start + run[2] : start + run[3]],
                share[row, run[2] : run[3]],
            )
            for i in range(len(light)):
                light[i] *= _ONE - dark[i]
    for k in range(len(border)):
        left[top + border[k, 0], start + border[k, 1]] = kept[k]


@lane(PLANES, DOUBLES, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, TILES, int64, NUMBERS, float32, WHOLE)
def shade(
    axes: Any, apex: Any, x: Plane, y: Plane, z: Plane, near: Plane, far: Plane, tiles: Any,
    side: int, of: Any, touching: Any, left: Plane,
) -> Any:  # fmt: skip
    """Take from the shares of light that are left what ellipsoids block; return which block any."""
    blocks = np.zeros(len(axes), np.bool_)
    for k in range(len(axes)):
        region = of[k, 0], of[k, 1], of[k, 2], of[k, 3]
        if region[2] > 0:
            lines = x, y, z, near, far
            blocks[k] = _shade(_ball(axes[k], apex), lines, tiles[k], side, region, touching, left)
    return blocks


@inner
def _shadowed(left: Any, shown: Any) -> Any:
    """Whether any pixel is seen in shadow, and any such in part."""
    dark, part = False, False
    for i in range(len(left)):
        dims = (left[i] < _ONE) & (shown[i] > _ZERO)
        dark |= dims
        part |= dims & (shown[i] < _ONE)
    return dark, part


@inner
def _leave(left: Any, shown: Any, light: Any) -> None:
    """Put the light that is left in pixels that are seen as a whole."""
    for i in range(len(left)):
        light[i] = left[i] if shown[i] > _ZERO else _ONE


@lane(WHOLE, WHOLE, WHOLE, MARKS, REGION)
def dimmed(seen: Plane, left: Plane, light: Plane, marks: Any, of: Any) -> None:
    """Put the shares of light left in pixels of a region that are seen in shadow, of others 1.

    And whether there are any in successive chunks of each row. Planes are of all pixels.
    """
    top, start, height, width = of
    part = left[top : top + height, start : start + width]
    for row in range(height):
        r = top + row
        for c in range((width + CHUNK - 1) // CHUNK):
            a, b = start + c * CHUNK, start + min((c + 1) * CHUNK, width)
            # of rows of ``part`` numba does not know that they are contiguous
            line, shown, put = left[r, a:b], seen[r, a:b], light[r, a:b]
            marks[r, c], mixed = _shadowed(line, shown)
            _leave(line, shown, put)
            if not mixed:
                continue
            for i in range(len(line)):
                share = shown[i]
                if not (line[i] < _ONE and _ZERO < share < _ONE):
                    continue
                put[i] = _ZERO
                if line[i] > _ZERO:
                    both = _overlap(seen, part, row, a - start + i, of, _ONE)
                    put[i] = both / max(share, _LEAST)


@inner
def _part_above(values: Plane, row: int, column: int) -> Any:
    """Return the share of a pixel where values are above 0."""
    value = values[row, column]
    above, below = _beside(row, values.shape[0])
    before, after = _beside(column, values.shape[1])
    beside = values[above, column], values[below, column], values[row, before], values[row, after]
    if _alike(value, *beside):
        return _ONE if value > _ZERO else _ZERO
    return _share(values, row, column)[0]


@lane(PLANE, PLANE, PLANE, PLANE, PLANE, PLANE)
def hide(
    one: Plane, at: Plane, left: Plane, other: Plane, its: Plane, rest: Plane
) -> None:  # fmt: skip
    """Take from shares of pixels that are left of two shapes what each hides of the other.

    Both of whose shares, and t, are planes of the same region.
    """
    away, of = its - at, (0, 0, one.shape[0], one.shape[1])
    for row in range(one.shape[0]):
        for column in range(one.shape[1]):
            first, second = one[row, column], other[row, column]
            if first == _ZERO or second == _ZERO:
                continue
            hidden = _overlap(one, other, row, column, of, _ONE)
            nearer = _part_above(away, row, column)
            rest[row, column] *= _ONE - nearer * hidden / max(second, _LEAST)
            left[row, column] *= _ONE - (_ONE - nearer) * hidden / max(first, _LEAST)


@lane(PLANE, PLANE)
def overlapped(one: Plane, other: Plane) -> Any:
    """Return the share of each pixel that lies in both of two shapes."""
    both = np.empty(one.shape, float32)
    of = 0, 0, one.shape[0], one.shape[1]
    for row in range(one.shape[0]):
        for column in range(one.shape[1]):
            both[row, column] = _overlap(one, other, row, column, of, _ONE)
    return both


@inner
def _reaches(counts: Any, reach: Any, c: int) -> Any:
    """Return how many of a chunk and of those that its points' neighbours are in count.

    ``counts`` are of all chunks before each.
    """
    found = counts[c + 1] - counts[c]
    for k in range(0, 8, 2):
        found += counts[reach[c, k + 1]] - counts[reach[c, k]]
    return found


@inner
def _reaches_none_but(counts: Any, reach: Any, c: int) -> Any:
    """Whether all of them do."""
    all_of = 1
    for k in range(0, 8, 2):
        all_of += reach[c, k + 1] - reach[c, k]
    return _reaches(counts, reach, c) == all_of


@inner
def _may_meet(ball: Any, low: Any, high: Any, may: Any) -> None:
    """Put whether any line from an apex up to a point in a box may meet an ellipsoid.

    Where the ellipsoid is a unit sphere, the box is within a sphere: lines to all its points are
    no farther from the one to the middle than its radius.
    """
    x, y, z = low
    u, v, w = high
    away = ball[3] * ball[3] + ball[4] * ball[4] + ball[5] * ball[5]
    for c in range(len(may)):
        a, b, d = (
            _HALF * ball[0] * (x[c] + u[c]),
            _HALF * ball[1] * (y[c] + v[c]),
            _HALF * ball[2] * (z[c] + w[c]),
        )
        e, f, g = (
            _HALF * ball[0] * (u[c] - x[c]),
            _HALF * ball[1] * (v[c] - y[c]),
            _HALF * ball[2] * (w[c] - z[c]),
        )
        middle = a * a + b * b + d * d
        along = -(a * ball[3] + b * ball[4] + d * ball[5])
        t = min(max(along / (middle + _TINY), _ZERO), _ONE)
        squared = away - _TWO * t * along + t * t * middle
        limit = _ONE + np.sqrt(e * e + f * f + g * g)
        may[c] = squared < _SURELY * limit * limit + _ROUNDED * (away + middle)


@inner
def _cross_points(
    ball: Any, corner: Any, x: Any, y: Any, z: Any, near: Any, touching: Any, index: Any, own: Any,
    values: Any,
) -> Any:  # fmt: skip
    """Put where lines to points of other surfaces meet an ellipsoid; return how many do."""
    for i in range(len(x)):
        u, v, w = x[i] - corner[0], y[i] - corner[1], z[i] - corner[2]
        squared, along = _squared(ball, u, v, w), _along(ball, u, v, w)
        value, at = along * (along / squared) + ball[6], -(along / squared)
        counts = (at > near[i] + touching) & (at < _ONE - touching) & (index[i] != own)
        away = (at - _ONE) * np.sqrt(squared)
        values[i] = value if counts & (not away * away < value) else _NAN
    return _above(values)


@inner
def _above(values: Any) -> Any:
    """Return how many are above 0."""
    count = 0
    for i in range(len(values)):
        count += values[i] > _ZERO
    return count


@inner
def _cross_chunk(ball: Any, c: int, lines: Any, own: Any, values: Any) -> Any:
    """Do it for a chunk of them."""
    corner, x, y, z, near, touching, index = lines
    a, b = c * CHUNK, min((c + 1) * CHUNK, len(x))
    return _cross_points(
        ball, corner, x[a:b], y[a:b], z[a:b], near[a:b], touching, index[a:b], own, values[a:b]
    )


@inner
def _cross_beside(
    ball: Any, c: int, around: Any, lines: Any, own: Any, values: Any, known: Any
) -> None:
    """Do it for a chunk, and for those with neighbours of its points, where it is not done yet."""
    if not known[c]:
        _cross_chunk(ball, c, lines, own, values)
        known[c] = True
    for side in range(4):
        for i in range(c * CHUNK, min((c + 1) * CHUNK, len(values) - 1)):
            beside = around[side, i] // CHUNK
            if not known[beside]:
                _cross_chunk(ball, beside, lines, own, values)
                known[beside] = True


@inner
def _any_other(index: Any, own: Any) -> bool:
    """Whether any point is on another surface."""
    if index[0] != own:
        return True
    found = False
    for i in range(len(index)):
        found |= index[i] != own
    return found


@inner
def _any_beside(values: Any, around: Any, counts: Any, reach: Any, c: int) -> bool:
    """Whether any point of a chunk, or any neighbour of such, is above 0."""
    if counts[c + 1] > counts[c]:
        return True
    found = False
    for side in range(4):
        if counts[reach[c, 2 * side + 1]] == counts[reach[c, 2 * side]]:
            continue
        places = around[side, c * CHUNK : min((c + 1) * CHUNK, len(values) - 1)]
        for i in range(len(places)):
            found |= values[places[i]] > _ZERO
    return found


@inner
def _take_shares(clear: Any, share: Any) -> None:
    for i in range(len(share)):
        clear[i] *= _ONE - share[i]


@lane(
    PLANES,
    DOUBLES,
    INDICES,
    LINE,
    LINE,
    LINE,
    LINE,
    float32,
    INDICES,
    AROUND,
    NUMBERS,
    WHOLE,
    LINE,
)
def dim_softly(
    axes: Any, apex: Any, owns: Any, x: Any, y: Any, z: Any, near: Any, touching: Any, index: Any,
    around: Any, reach: Any, boxes: Any, clear: Any,
) -> None:  # fmt: skip
    """Take from the light at points what ellipsoids cover of the pixels around them.

    Only chunks of points in and beside which a line meets an ellipsoid have any share, and only
    those with a box that lines may meet one before are looked at. Boxes are of ways from the apex.
    """
    count, chunks = len(x), len(reach)
    values, counts = np.full(count + 1, _NAN, float32), np.zeros(chunks + 1, int64)
    known, stale = np.ones(chunks + 1, np.bool_), np.zeros(chunks, np.bool_)
    share, border = np.empty(CHUNK, float32), np.empty(CHUNK, np.bool_)
    corner = float32(apex[0]), float32(apex[1]), float32(apex[2])
    lines = corner, x, y, z, near, touching, index
    low, high = (boxes[0], boxes[1], boxes[2]), (boxes[3], boxes[4], boxes[5])
    for n in range(len(axes)):
        ball = _ball(axes[n], apex)
        _may_meet(ball, low, high, known[:chunks])
        for c in range(chunks):
            a, b = c * CHUNK, min((c + 1) * CHUNK, count)
            counts[c + 1] = counts[c]
            known[c] = known[c] and _any_other(index[a:b], owns[n])
            if known[c]:
                counts[c + 1] += _cross_chunk(ball, c, lines, owns[n], values)
            elif stale[c]:
                values[a:b] = _NAN
        for c in range(chunks):
            a, b = c * CHUNK, min((c + 1) * CHUNK, count)
            if not _reaches(counts, reach, c):
                continue
            if _any_beside(values, around, counts, reach, c):
                _cross_beside(ball, c, around, lines, owns[n], values, known)
                part = share[: b - a]
                _shares_among(values, around, a, part, border)
                _take_shares(clear[a:b], part)
        stale[:] = known[:chunks]


@lane(WHOLE, LINE, LINE, LINE, LINE, LINE, float32, INDICES, int64, LINE)
def dim_behind(
    plate: Any, apex: Any, x: Any, y: Any, z: Any, near: Any, touching: Any, index: Any, own: int,
    clear: Any,
) -> Any:  # fmt: skip
    """Take the light from points whose way to it meets a rectangle."""
    axes, (a, b, c), mine = _axes(plate), (apex[0], apex[1], apex[2]), np.int32(own)
    for i in range(len(x)):
        one, other, at, _facing = _of_rectangle(axes, x[i] - a, y[i] - b, z[i] - c)
        between = (at > near[i] + touching) & (at < _ONE - touching) & (index[i] != mine)
        clear[i] = _ZERO if between & (one > _ZERO) & (other > _ZERO) else clear[i]


@inner
def _meet(axes: Any, apex: Any, x: Any, y: Any, z: Any, touching: Any, put: Any) -> bool:
    """Put both functions, and the t, where ways to points meet a rectangle; whether any does."""
    first, second, at = put
    met = 0
    for i in range(len(x)):
        one, other, t, facing = _of_rectangle(axes, x[i] - apex[0], y[i] - apex[1], z[i] - apex[2])
        shows = (t > _ZERO + touching) & (t < _ONE - touching) & (facing > _ZERO)
        first[i], second[i], at[i] = one if shows else _NAN, other if shows else _NAN, t
        met += shows & (one > _ZERO) & (other > _ZERO)
    return met > 0


@inner
def _shares_at_rim(values: Any, around: Any, start: int, rim: Any, share: Any) -> None:
    """Put shares of a chunk of pixels that are above 0, as all beside them that are there."""
    for i in range(len(share)):
        share[i] = _ONE
    for i in range(len(share)):
        if rim[i]:
            share[i] = _at_rim(values, around, start + i)


@inner
def _times(one: Any, other: Any) -> None:
    for i in range(len(one)):
        one[i] *= other[i]


@inner
def _show_points(values: Any, around: Any, reach: Any, rim: Any, share: Any) -> Any:
    """Put shares of the pixels around points that a mirror shows the light to; count them."""
    first, second = values
    found, count, chunks = 0, len(rim), len(reach)
    along, across = np.zeros(chunks + 1, int64), np.zeros(chunks + 1, int64)
    whole, wide = np.zeros(chunks + 1, int64), np.zeros(chunks + 1, int64)
    other, border = np.empty(CHUNK, float32), np.empty(CHUNK, np.bool_)
    for c in range(chunks):
        a, b = c * CHUNK, min((c + 1) * CHUNK, count)
        on, beside = _above(first[a:b]), _above(second[a:b])
        along[c + 1], across[c + 1] = along[c] + (on > 0), across[c] + (beside > 0)
        whole[c + 1], wide[c + 1] = whole[c] + (on == b - a), wide[c] + (beside == b - a)
    for c in range(chunks):
        a, b = c * CHUNK, min((c + 1) * CHUNK, count)
        if not (
            _reaches(along, reach, c)
            and _reaches(across, reach, c)
            and _any_beside(first, around, along, reach, c)
            and _any_beside(second, around, across, reach, c)
        ):
            share[a:b] = _ZERO
            continue
        if _reaches_none_but(whole, reach, c):
            _shares_at_rim(first, around, a, rim[a:b], share[a:b])
        else:
            _shares_among(first, around, a, share[a:b], border)
        if _reaches_none_but(wide, reach, c):
            _shares_at_rim(second, around, a, rim[a:b], other[: b - a])
        else:
            _shares_among(second, around, a, other[: b - a], border)
        _times(share[a:b], other[: b - a])
        found += _above(share[a:b])
    return found


@inner
def _gather(share: Any, kept: Any) -> None:
    """Put the places where shares are above 0, and one more."""
    k = 0
    for i in range(len(share)):
        kept[k] = i
        k += share[i] > _ZERO


@inner
def _chosen(values: Any, kept: Any, put: Any) -> None:
    for k in range(len(kept)):
        put[k] = values[kept[k]]


@inner
def _lines_to(x: Any, y: Any, z: Any, apex: Any, lines: Any) -> None:
    """Put the points where lines from an apex to some points meet a mirror, given their t."""
    a, b, c = apex[0], apex[1], apex[2]
    t = lines[0]
    for k in range(len(t)):
        lines[1, k] = (x[k] - a) * t[k] + a
        lines[2, k] = (y[k] - b) * t[k] + b
        lines[3, k] = (z[k] - c) * t[k] + c


@lane(WHOLE, LINE, LINE, LINE, LINE, float32, AROUND, NUMBERS, FLAGS)
def shown(
    plate: Any, apex: Any, x: Any, y: Any, z: Any, touching: Any, around: Any, reach: Any, rim: Any
) -> Any:
    """Return the points that a mirror shows the light to, and its shares of their pixels.

    Then the t where lines to them from the light's image meet the mirror, the points there, and,
    unless all are, the points that are kept.
    """
    axes, corner, count = _axes(plate), (apex[0], apex[1], apex[2]), len(x)
    first, second = np.empty(count + 1, float32), np.empty(count + 1, float32)
    at, share = np.empty(count, float32), np.empty(count, float32)
    first[count] = second[count] = _NAN
    found = 0
    if _meet(axes, corner, x, y, z, touching, (first[:count], second[:count], at)):
        found = _show_points((first, second), around, reach, rim, share)
    if found == count:
        lines = np.empty((4, count), float32)
        lines[0] = at
        _lines_to(x, y, z, corner, lines)
        return np.arange(count), share, lines
    lines, room = np.empty((7, found), float32), np.empty(found + 1, np.int64)
    if found:
        _gather(share, room)
    kept, part = room[:found], np.empty(found, float32)
    _chosen(share, kept, part)
    _chosen(at, kept, lines[0])
    _chosen(x, kept, lines[4])
    _chosen(y, kept, lines[5])
    _chosen(z, kept, lines[6])
    _lines_to(lines[4], lines[5], lines[6], corner, lines)
    return kept, part, lines
