"""Compiled: what ellipsoids leave of the light on the pixels of what stands still."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import (
    CHUNK,
    DOUBLES,
    FLAG,
    MARKS,
    NUMBERS,
    PLANES,
    REGION,
    TILES,
    WHOLE,
    inner,
    int64,
    lane,
)
from transientcam_simulation.light._bundle import Numbers
from transientcam_simulation.light._compiled_edges import mark_borders, row_of, share_and_root
from transientcam_simulation.light._compiled_numbers import ball_of, near_ellipsoid
from transientcam_simulation.light._compiled_overlaps import overlap
from transientcam_simulation.light._coverage import LEAST, ONE, TOUCHING, ZERO, Ball, Plane

Lines = tuple[Plane, Plane, Plane, Plane, Plane]
"""Ways of lines from an apex by component, and the t from and up to which they count."""


@inner
def _runs(tiles: NDArray[np.bool_], side: int, of: Numbers, grown: bool) -> NDArray[np.int64]:
    """Return runs of tiles in the rows of a region that are met, or beside such if grown.

    As rows and columns of pixels in the region: the first ones, and those after the last.
    """
    top, start, height, width = of
    first_tile, tile_after = start // side, (start + width + side - 1) // side
    rows, columns = (height + side - 1) // side, tile_after - first_tile
    runs, count = np.empty((rows * (columns // 2 + 1), 4), np.int64), 0
    wanted = np.empty(columns + 1, np.bool_)
    wanted[columns] = False
    for k in range(rows):
        row = top // side + k
        wanted[:columns] = tiles[row, first_tile:tile_after]
        if grown:
            for r in range(max(row - 1, 0), min(row + 2, tiles.shape[0])):
                _grow(tiles[r, first_tile:tile_after], wanted)
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
def _grow(line: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> None:
    """Mark tiles that are in a line or beside one of it."""
    columns = len(line)
    for c in range(columns):
        wanted[c] |= line[c]
    for c in range(columns - 1):
        wanted[c] |= line[c + 1]
    for c in range(1, columns):
        wanted[c] |= line[c - 1]


@inner
def _cross_run(
    ball: Ball, x: Plane, y: Plane, z: Plane, inside: Plane, closest: Plane, share: Plane
) -> None:
    """Cross some lines of a row with an ellipsoid."""
    for i in range(len(x)):
        inside[i], closest[i], _squared = near_ellipsoid(ball, x[i], y[i], z[i])
        share[i] = ZERO


@inner
def _block(inside: Plane, closest: Plane, near: Plane, far: Plane, share: Plane) -> bool:
    """Put shares of pixels of a row whose light is blocked, but for those at a border."""
    found = 0
    for i in range(len(inside)):
        blocks = (closest[i] > near[i] + TOUCHING) & (closest[i] < far[i] * (ONE - TOUCHING))
        share[i] = ONE if blocks & (inside[i] > ZERO) else ZERO
        found += share[i] > ZERO
    return found > 0


@inner
def _shade(
    ball: Ball, lines: Lines, tiles: NDArray[np.bool_], side: int, of: Numbers, soft: bool,
    left: Plane,
) -> bool:  # fmt: skip
    """Take from shares of light what an ellipsoid blocks; whether it blocks any."""
    x, y, z, near, far = lines
    top, start, height, width = of
    inside, closest = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    share, marks = np.empty((height, width), np.float32), np.zeros(width, np.bool_)
    for run in _runs(tiles, side, of, True):
        first, end = run[2], run[3]
        for row in range(run[0], run[1]):
            r, a, b = top + row, start + first, start + end
            _cross_run(
                ball, x[r, a:b], y[r, a:b], z[r, a:b], inside[row, first:end],
                closest[row, first:end], share[row, first:end],
            )  # fmt: skip
    found, runs, count = False, _runs(tiles, side, of, False), 0
    border = np.empty((height * width, 2), np.int32)
    for run in runs:
        first, end = run[2], run[3]
        for row in range(run[0], run[1]):
            since, until = row_of(near, top + row), row_of(far, top + row)
            found |= _block(
                inside[row, first:end], closest[row, first:end],
                since[start + first : start + end], until[start + first : start + end],
                share[row, first:end],
            )  # fmt: skip
            if not soft:
                continue
            mark_borders(inside, row, first, end, marks)
            for column in range(first, end):
                if marks[column]:
                    at, c = closest[row, column], start + column
                    part = share_and_root(inside, row, column)[0]
                    between = at > since[c] + TOUCHING and at < until[c] * (ONE - TOUCHING)
                    share[row, column] = part if between else ZERO
                    found |= share[row, column] > ZERO
                    border[count, 0], border[count, 1] = row, column
                    count += 1
    if found:
        _take(left, share, border[:count], runs, of)
    return found


@inner
def _take(
    left: Plane, share: Plane, border: NDArray[np.int32], runs: NDArray[np.int64], of: Numbers
) -> None:
    """Take shares of pixels from what is left of light."""
    top, start, _height, _width = of
    kept = np.empty(len(border), np.float32)
    for k in range(len(border)):  # before anything is taken that others are compared with
        kept[k] = overlap(left, share, border[k, 0], border[k, 1], of, -ONE)
    for run in runs:
        for row in range(run[0], run[1]):
            light = left[top + row, start + run[2] : start + run[3]]
            dark = share[row, run[2] : run[3]]
            for i in range(len(light)):
                light[i] *= ONE - dark[i]
    for k in range(len(border)):
        left[top + border[k, 0], start + border[k, 1]] = kept[k]


@lane(PLANES, DOUBLES, WHOLE, WHOLE, WHOLE, WHOLE, WHOLE, TILES, int64, NUMBERS, FLAG, WHOLE)
def shade(
    axes: NDArray[np.float64], apex: NDArray[np.float64], x: Plane, y: Plane, z: Plane,
    near: Plane, far: Plane, tiles: NDArray[np.bool_], side: int, of: NDArray[np.int64],
    soft: bool, left: Plane,
) -> NDArray[np.bool_]:  # fmt: skip
    """Take from the shares of light that are left what ellipsoids block; return which block any.

    ``axes`` (N, 2, 3) are their centres and radii, ``tiles`` (N, R, C) those of so many pixels a
    side whose lines may meet them, and ``of`` (N, 4) the regions that hold these.
    """
    blocks = np.zeros(len(axes), np.bool_)
    for k in range(len(axes)):
        region = of[k, 0], of[k, 1], of[k, 2], of[k, 3]
        if region[2] > 0:
            ball, lines = ball_of(axes[k, 0], axes[k, 1], apex), (x, y, z, near, far)
            blocks[k] = _shade(ball, lines, tiles[k], side, region, soft, left)
    return blocks


@inner
def _shadowed(left: Plane, shown: Plane) -> tuple[bool, bool]:
    """Whether any pixel is seen in shadow, and any such in part."""
    dark, part = False, False
    for i in range(len(left)):
        dims = (left[i] < ONE) & (shown[i] > ZERO)
        dark |= dims
        part |= dims & (shown[i] < ONE)
    return dark, part


@inner
def _leave(left: Plane, shown: Plane, light: Plane) -> None:
    """Put the light that is left in pixels that are seen as a whole."""
    for i in range(len(left)):
        light[i] = left[i] if shown[i] > ZERO else ONE


@lane(WHOLE, WHOLE, WHOLE, MARKS, REGION)
def dimmed(
    seen: Plane, left: Plane, light: Plane, marks: NDArray[np.bool_], of: Numbers
) -> None:  # fmt: skip
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
                if not (line[i] < ONE and ZERO < share < ONE):
                    continue
                put[i] = ZERO
                if line[i] > ZERO:
                    both = overlap(seen, part, row, a - start + i, of, ONE)
                    put[i] = both / max(share, LEAST)
