"""Compiled: the share of a pixel that lies in both of two shapes, and what each hides.

Two borders in one pixel are mostly nearly parallel, as of a surface and of its own shadow: the
shares then overlap as far as they can, or not at all if the borders face each other. Across each
other they overlap by their product.
"""

import numpy as np

from transientcam_simulation.compiled import FLAG, PLANE, inner, lane
from transientcam_simulation.light._bundle import Numbers
from transientcam_simulation.light._compiled_edges import beside, part_above
from transientcam_simulation.light._coverage import LEAST, ONE, ZERO, Plane


@inner
def overlap(
    one: Plane, other: Plane, row: int, column: int, of: Numbers, sign: np.float32
) -> np.float32:
    """Return the share of a pixel of a region in both of two shapes.

    The first has a plane of all pixels, the second one of the region, of its rest if the sign is
    -1.
    """
    top, start, height, width = of
    first, second = one[top + row, start + column], other[row, column]
    if sign < ZERO:
        second = ONE - second
    across: np.float32 = first * second
    if not (first > ZERO and first < ONE and second > ZERO and second < ONE):
        return across
    (up, down), (left, right) = beside(row, height), beside(column, width)
    r, c = top + row, start + column
    x = one[top + down, c] - one[top + up, c]
    y = one[r, start + right] - one[r, start + left]
    u, v = other[down, column] - other[up, column], other[row, right] - other[row, left]
    if sign < ZERO:
        u = (ONE - other[down, column]) - (ONE - other[up, column])
        v = (ONE - other[row, right]) - (ONE - other[row, left])
    size = np.sqrt((x * x + y * y) * (u * u + v * v))
    cosine = (x * u + y * v) / max(size, LEAST)
    along = max(first + second - ONE, ZERO)
    if cosine > ZERO:
        along = min(first, second)
    across += cosine * cosine * (along - across)
    return across


@lane(PLANE, PLANE)
def overlapped(one: Plane, other: Plane) -> Plane:
    """Return the share of each pixel (H, W) that lies in both of two shapes, given each's."""
    both = np.empty(one.shape, np.float32)
    of = 0, 0, one.shape[0], one.shape[1]
    for row in range(one.shape[0]):
        for column in range(one.shape[1]):
            both[row, column] = overlap(one, other, row, column, of, ONE)
    return both


@lane(PLANE, PLANE, PLANE, PLANE, PLANE, PLANE, FLAG)
def hide(
    one: Plane, at: Plane, left: Plane, other: Plane, its_at: Plane, its_left: Plane, soft: bool
) -> None:
    """Take from what is left of two shapes' shares what each hides of the other.

    Of each: its shares of the pixels of a region (h, w), the t of its front, and what is left of
    the shares. Soft: where one passes before the other, it hides a share.
    """
    away, of = its_at - at, (0, 0, one.shape[0], one.shape[1])
    for row in range(one.shape[0]):
        for column in range(one.shape[1]):
            first, second = one[row, column], other[row, column]
            if first == ZERO or second == ZERO:
                continue
            hidden = overlap(one, other, row, column, of, ONE)
            nearer = ONE if away[row, column] > ZERO else ZERO
            if soft:
                nearer = part_above(away, row, column)
            its_left[row, column] *= ONE - nearer * hidden / max(second, LEAST)
            left[row, column] *= ONE - (ONE - nearer) * hidden / max(first, LEAST)
