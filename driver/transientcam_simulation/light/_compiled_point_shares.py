"""Compiled: shares of the pixels around points, in chunks of successive points.

Values of points are followed by a NaN, which stands for a neighbour that is not there. ``around``
(4, P) are the points above, below, left and right of each, by index; P is none.
"""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import CHUNK, inner
from transientcam_simulation.light._compiled_numbers import at_border
from transientcam_simulation.light._coverage import ONE, ZERO, Plane


@inner
def share_at_border(values: Plane, around: NDArray[np.int32], i: int) -> np.float32:
    """Return the share of one of some pixels at a border."""
    up, down = values[int(around[0, i])], values[int(around[1, i])]
    left, right = values[int(around[2, i])], values[int(around[3, i])]
    share: np.float32 = at_border(values[i], up, down, left, right)[0]
    return share


@inner
def put_shares(
    values: Plane, around: NDArray[np.int32], start: int, share: Plane, border: NDArray[np.bool_]
) -> None:
    """Put shares of a chunk of pixels where values are above 0.

    Borders are marked in loops that a compiler makes vectors of: few pixels are at one.
    """
    on = values[start : start + len(share)]
    for i in range(len(share)):
        share[i] = ONE if on[i] > ZERO else ZERO
        border[i] = False
    for side in range(4):
        places = around[side, start : start + len(share)]
        for i in range(len(share)):
            border[i] |= (values[places[i]] > ZERO) != (on[i] > ZERO)
    for i in range(len(share)):
        if border[i]:
            share[i] = share_at_border(values, around, start + i)


@inner
def count_above(values: Plane) -> int:
    """Return how many are above 0."""
    count = 0
    for i in range(len(values)):
        count += values[i] > ZERO
    return count


@inner
def count_reached(counts: NDArray[np.int64], reach: NDArray[np.int64], c: int) -> int:
    """Return how many of a chunk and of those that its points' neighbours are in count.

    ``counts`` are of all chunks before each.
    """
    found: int = counts[c + 1] - counts[c]
    for k in range(0, 8, 2):
        found += counts[int(reach[c, k + 1])] - counts[int(reach[c, k])]
    return found


@inner
def any_beside(
    values: Plane, around: NDArray[np.int32], counts: NDArray[np.int64],
    reach: NDArray[np.int64], c: int,
) -> bool:  # fmt: skip
    """Whether any point of a chunk, or any neighbour of such, is above 0."""
    if counts[c + 1] > counts[c]:
        return True
    found = False
    for side in range(4):
        if counts[reach[c, 2 * side + 1]] == counts[reach[c, 2 * side]]:
            continue
        places = around[side, c * CHUNK : min((c + 1) * CHUNK, len(values) - 1)]
        for i in range(len(places)):
            found |= bool(values[int(places[i])] > ZERO)
    return found


@inner
def take_shares(clear: Plane, share: Plane) -> None:
    """Leave what shares do not cover."""
    for i in range(len(share)):
        clear[i] *= ONE - share[i]


@inner
def multiply(one: Plane, other: Plane) -> None:
    """Multiply the first by the second."""
    for i in range(len(one)):
        one[i] *= other[i]
