"""Compiled: the points that a mirror shows the light to, and where it does."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import AROUND, CHUNK, FLAGS, LINE, NUMBERS, WHOLE, inner, lane
from transientcam_simulation.light._compiled_numbers import on_rectangle, rows_of
from transientcam_simulation.light._compiled_point_shares import (
    any_beside,
    count_above,
    count_reached,
    multiply,
    put_shares,
    share_at_border,
)
from transientcam_simulation.light._coverage import ONE, TOUCHING, ZERO, Plane, Plate

Indices = NDArray[np.int64]
Corner = tuple[np.float32, np.float32, np.float32]
Chunks = tuple[Indices, Indices]
"""Numbers of points before each chunk, of all whose value is above 0, and of whole such chunks."""
_NAN = np.float32(np.nan)


@inner
def _meet(
    axes: Plate, apex: Corner, x: Plane, y: Plane, z: Plane, put: tuple[Plane, Plane, Plane]
) -> bool:
    """Put both functions, and the t, where ways to points meet a rectangle; whether any does."""
    first, second, at = put
    met = 0
    for i in range(len(x)):
        one, other, t, facing = on_rectangle(axes, x[i] - apex[0], y[i] - apex[1], z[i] - apex[2])
        shows = (t > ZERO + TOUCHING) & (t < ONE - TOUCHING) & (facing > ZERO)
        first[i], second[i], at[i] = one if shows else _NAN, other if shows else _NAN, t
        met += int(shows & (one > ZERO) & (other > ZERO))
    return met > 0


@inner
def _count(values: Plane, chunks: int) -> Chunks:
    """Count the chunks of which any value is above 0, and those of which all are."""
    some, whole = np.zeros(chunks + 1, np.int64), np.zeros(chunks + 1, np.int64)
    for c in range(chunks):
        a, b = c * CHUNK, min((c + 1) * CHUNK, len(values) - 1)
        on = count_above(values[a:b])
        some[c + 1], whole[c + 1] = some[c] + (on > 0), whole[c] + (on == b - a)
    return some, whole


@inner
def _all_reached(whole: Indices, reach: Indices, c: int) -> bool:
    """Whether a chunk and those that its points' neighbours are in all count."""
    every = 1
    for k in range(0, 8, 2):
        every += reach[c, k + 1] - reach[c, k]
    return count_reached(whole, reach, c) == every


@inner
def _shares(
    values: Plane, whole: Indices, around: NDArray[np.int32], reach: Indices,
    rim: NDArray[np.bool_], c: int, share: Plane, border: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Put shares of a chunk of pixels where values are above 0.

    Where they all are, it is only some of those without a neighbour that have not all.
    """
    start = c * CHUNK
    if not _all_reached(whole, reach, c):
        put_shares(values, around, start, share, border)
        return
    for i in range(len(share)):
        share[i] = ONE
    for i in range(len(share)):
        if rim[start + i]:
            share[i] = share_at_border(values, around, start + i)


@inner
def _show(
    values: tuple[Plane, Plane], around: NDArray[np.int32], reach: Indices,
    rim: NDArray[np.bool_], share: Plane,
) -> int:  # fmt: skip
    """Put shares of the pixels around points that a mirror shows the light to; count them."""
    first, second = values
    found, count, chunks = 0, len(rim), len(reach)
    (along, along_whole), (across, across_whole) = _count(first, chunks), _count(second, chunks)
    other, border = np.empty(CHUNK, np.float32), np.empty(CHUNK, np.bool_)
    for c in range(chunks):
        a, b = c * CHUNK, min((c + 1) * CHUNK, count)
        if not (
            count_reached(along, reach, c)
            and count_reached(across, reach, c)
            and any_beside(first, around, along, reach, c)
            and any_beside(second, around, across, reach, c)
        ):
            share[a:b] = ZERO
            continue
        _shares(first, along_whole, around, reach, rim, c, share[a:b], border)
        _shares(second, across_whole, around, reach, rim, c, other[: b - a], border)
        multiply(share[a:b], other[: b - a])
        found += count_above(share[a:b])
    return found


@inner
def _gather(share: Plane, kept: Indices) -> None:
    """Put the places where shares are above 0, and one more."""
    k = 0
    for i in range(len(share)):
        kept[k] = i
        k += share[i] > ZERO


@inner
def _choose(values: Plane, kept: Indices, put: Plane) -> None:
    for k in range(len(kept)):
        put[k] = values[kept[k]]


@inner
def _lines_to(x: Plane, y: Plane, z: Plane, apex: Corner, lines: Plane) -> None:
    """Put the points where lines from an apex to some points meet a mirror, given their t."""
    a, b, c = apex[0], apex[1], apex[2]
    t = lines[0]
    for k in range(len(t)):
        lines[1, k] = (x[k] - a) * t[k] + a
        lines[2, k] = (y[k] - b) * t[k] + b
        lines[3, k] = (z[k] - c) * t[k] + c


@lane(WHOLE, LINE, LINE, LINE, LINE, AROUND, NUMBERS, FLAGS)
def shown(
    plate: Plane, apex: Plane, x: Plane, y: Plane, z: Plane, around: NDArray[np.int32],
    reach: Indices, rim: NDArray[np.bool_],
) -> tuple[Indices, Plane, Plane]:  # fmt: skip
    """Return the points that a mirror shows the light to, and its shares of their pixels.

    Then the t where lines to them from the light's image meet the mirror, the points there, and,
    unless all are, the points that are kept.
    """
    corner, count = (apex[0], apex[1], apex[2]), len(x)
    first, second = np.empty(count + 1, np.float32), np.empty(count + 1, np.float32)
    at, share = np.empty(count, np.float32), np.empty(count, np.float32)
    first[count] = second[count] = _NAN
    found = 0
    if _meet(rows_of(plate), corner, x, y, z, (first[:count], second[:count], at)):
        found = _show((first, second), around, reach, rim, share)
    if found == count:
        lines = np.empty((4, count), np.float32)
        lines[0] = at
        _lines_to(x, y, z, corner, lines)
        return np.arange(count), share, lines
    lines, room = np.empty((7, found), np.float32), np.empty(found + 1, np.int64)
    if found:
        _gather(share, room)
    kept, part = room[:found], np.empty(found, np.float32)
    _choose(share, kept, part)
    _choose(at, kept, lines[0])
    _choose(x, kept, lines[4])
    _choose(y, kept, lines[5])
    _choose(z, kept, lines[6])
    _lines_to(lines[4], lines[5], lines[6], corner, lines)
    return kept, part, lines
