"""Compiled: what shapes take of the light on its way from an apex to points of other surfaces."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import (
    AROUND,
    CHUNK,
    DOUBLES,
    INDICES,
    LINE,
    NUMBERS,
    PLANES,
    WHOLE,
    inner,
    int64,
    lane,
)
from transientcam_simulation.light._compiled_numbers import (
    ball_of,
    near_ellipsoid,
    on_rectangle,
    rows_of,
)
from transientcam_simulation.light._compiled_point_shares import (
    any_beside,
    count_above,
    count_reached,
    multiply,
    put_shares,
    take_shares,
)
from transientcam_simulation.light._coverage import ONE, TOUCHING, TWO, ZERO, Ball, Plane

Indices = NDArray[np.int32]
Corner = tuple[np.float32, np.float32, np.float32]
Lines = tuple[Corner, Plane, Plane, Plane, Plane, Indices]
"""An apex, points by component, the t from which ways between them count, and their surfaces."""
_HALF, _SURELY, _ROUNDED = np.float32(0.5), np.float32(1.001), np.float32(1e-5)
_NAN, _TINY = np.float32(np.nan), np.float32(1e-12)


@inner
def _may_meet(
    ball: Ball, low: tuple[Plane, Plane, Plane], high: tuple[Plane, Plane, Plane],
    may: NDArray[np.bool_],
) -> None:  # fmt: skip
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
        t = min(max(along / (middle + _TINY), ZERO), ONE)
        squared = away - TWO * t * along + t * t * middle
        limit = ONE + np.sqrt(e * e + f * f + g * g)
        may[c] = squared < _SURELY * limit * limit + _ROUNDED * (away + middle)


@inner
def _cross_points(
    ball: Ball, corner: Corner, x: Plane, y: Plane, z: Plane, near: Plane, index: Indices,
    own: int, values: Plane,
) -> int:  # fmt: skip
    """Put where lines to points of other surfaces meet an ellipsoid; return how many do.

    A point inside of it stands for those beside it that are seen in its pixel: it is not dark.
    """
    for i in range(len(x)):
        u, v, w = x[i] - corner[0], y[i] - corner[1], z[i] - corner[2]
        value, at, squared = near_ellipsoid(ball, u, v, w)
        counts = (at > near[i] + TOUCHING) & (at < ONE - TOUCHING) & (index[i] != own)
        away = (at - ONE) * np.sqrt(squared)
        values[i] = value if counts & (not away * away < value) else _NAN
    return count_above(values)


@inner
def _cross_chunk(ball: Ball, c: int, lines: Lines, own: int, values: Plane) -> int:
    """Do it for a chunk of them."""
    corner, x, y, z, near, index = lines
    a, b = c * CHUNK, min((c + 1) * CHUNK, len(x))
    return _cross_points(
        ball, corner, x[a:b], y[a:b], z[a:b], near[a:b], index[a:b], own, values[a:b]
    )


@inner
def _cross_beside(
    ball: Ball, c: int, around: Indices, lines: Lines, own: int, values: Plane,
    known: NDArray[np.bool_],
) -> None:  # fmt: skip
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
def _any_other(index: Indices, own: int) -> bool:
    """Whether any point is on another surface."""
    if index[0] != own:
        return True
    found = False
    for i in range(len(index)):
        found |= index[i] != own
    return found


@lane(PLANES, DOUBLES, INDICES, LINE, LINE, LINE, LINE, INDICES, AROUND, NUMBERS, WHOLE, LINE)
def dim_behind_ellipsoids(
    axes: NDArray[np.float64], apex: NDArray[np.float64], owns: Indices, x: Plane, y: Plane,
    z: Plane, near: Plane, index: Indices, around: Indices, reach: NDArray[np.int64],
    boxes: Plane, clear: Plane,
) -> None:  # fmt: skip
    """Take from the light at points what ellipsoids cover of the pixels around them.

    Only chunks of points in and beside which a line meets an ellipsoid have any share, and only
    those with a box that lines may meet one before are looked at. Boxes are of ways from the apex.
    """
    count, chunks = len(x), len(reach)
    values, counts = np.full(count + 1, _NAN, np.float32), np.zeros(chunks + 1, np.int64)
    known, stale = np.ones(chunks + 1, np.bool_), np.zeros(chunks, np.bool_)
    share, border = np.empty(CHUNK, np.float32), np.empty(CHUNK, np.bool_)
    corner = np.float32(apex[0]), np.float32(apex[1]), np.float32(apex[2])
    lines = corner, x, y, z, near, index
    low, high = (boxes[0], boxes[1], boxes[2]), (boxes[3], boxes[4], boxes[5])
    for n in range(len(axes)):
        ball = ball_of(axes[n, 0], axes[n, 1], apex)
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
            if not count_reached(counts, reach, c):
                continue
            if any_beside(values, around, counts, reach, c):
                _cross_beside(ball, c, around, lines, owns[n], values, known)
                part = share[: b - a]
                put_shares(values, around, a, part, border)
                take_shares(clear[a:b], part)
        stale[:] = known[:chunks]


@lane(WHOLE, LINE, LINE, LINE, LINE, LINE, INDICES, int64, LINE)
def dim_behind_rectangle(
    plate: Plane, apex: Plane, x: Plane, y: Plane, z: Plane, near: Plane, index: Indices, own: int,
    clear: Plane,
) -> None:  # fmt: skip
    """Take the light from points whose way to it meets a rectangle."""
    axes, (a, b, c), mine = rows_of(plate), (apex[0], apex[1], apex[2]), np.int32(own)
    for i in range(len(x)):
        one, other, at, _facing = on_rectangle(axes, x[i] - a, y[i] - b, z[i] - c)
        between = (at > near[i] + TOUCHING) & (at < ONE - TOUCHING) & (index[i] != mine)
        clear[i] = ZERO if between & (one > ZERO) & (other > ZERO) else clear[i]


@lane(WHOLE, LINE, LINE, LINE, LINE, LINE, INDICES, int64, AROUND, LINE)
def dim_softly_behind_rectangle(
    plate: Plane, apex: Plane, x: Plane, y: Plane, z: Plane, near: Plane, index: Indices, own: int,
    around: Indices, clear: Plane,
) -> None:  # fmt: skip
    """Take from the light at points what a rectangle covers of the pixels around them."""
    count, axes, (a, b, c) = len(x), rows_of(plate), (apex[0], apex[1], apex[2])
    first, second = np.full(count + 1, _NAN, np.float32), np.full(count + 1, _NAN, np.float32)
    met, mine = False, np.int32(own)
    for i in range(count):
        one, other, at, _facing = on_rectangle(axes, x[i] - a, y[i] - b, z[i] - c)
        if (at > near[i] + TOUCHING) & (at < ONE - TOUCHING) & (index[i] != mine):
            first[i], second[i] = one, other
            met |= bool((one > ZERO) & (other > ZERO))
    if not met:
        return
    share, part = np.empty(CHUNK, np.float32), np.empty(CHUNK, np.float32)
    border = np.empty(CHUNK, np.bool_)
    for start in range(0, count, CHUNK):
        size = min(CHUNK, count - start)
        put_shares(first, around, start, share[:size], border)
        put_shares(second, around, start, part[:size], border)
        multiply(share[:size], part[:size])
        take_shares(clear[start : start + size], share[:size])
