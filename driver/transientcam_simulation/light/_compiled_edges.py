"""Compiled: pixels of planes that the border of a shape crosses, and their shares of it."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import inner
from transientcam_simulation.light._compiled_numbers import at_border
from transientcam_simulation.light._coverage import LEAST, ONE, TWO, ZERO, Plane

_CUBE = np.float32(1.5)


@inner
def beside(place: int, count: int) -> tuple[int, int]:
    """Return the places before and after one; at an end, the one on the other side for both."""
    before = place - 1 if place > 0 else min(1, count - 1)
    after = place + 1 if place < count - 1 else max(count - 2, 0)
    return before, after


@inner
def row_of(plane: Plane, row: int) -> Plane:
    """Return a row of a plane; of one that holds a single row, that one stands for all."""
    line: Plane = plane[min(row, len(plane) - 1)]
    return line


@inner
def share_and_root(inside: Plane, row: int, column: int) -> tuple[np.float32, np.float32]:
    """Return the share of a pixel at a border where a function is above 0.

    And the mean of its square root there.
    """
    above, below = beside(row, inside.shape[0])
    before, after = beside(column, inside.shape[1])
    share, value, along, across = at_border(
        inside[row, column], inside[above, column], inside[below, column],
        inside[row, before], inside[row, after],
    )  # fmt: skip
    width = np.sqrt(along * along + across * across)
    high, low = max(value + width / TWO, LEAST), max(value - width / TWO, ZERO)
    cubes = high * np.sqrt(high) - low * np.sqrt(low)
    return share, cubes / max(_CUBE * (high - low), LEAST)


@inner
def part_above(values: Plane, row: int, column: int) -> np.float32:
    """Return the share of a pixel where values are above 0."""
    above, below = beside(row, values.shape[0])
    before, after = beside(column, values.shape[1])
    on = values[row, column] > ZERO
    level = (values[above, column] > ZERO) == on and (values[below, column] > ZERO) == on
    if level and (values[row, before] > ZERO) == on and (values[row, after] > ZERO) == on:
        return ONE if on else ZERO
    return share_and_root(values, row, column)[0]


@inner
def mark_borders(inside: Plane, row: int, start: int, end: int, border: NDArray[np.bool_]) -> None:
    """Mark pixels of a row, from ``start`` to ``end``, with a neighbour on the other side of 0.

    In loops that a compiler makes vectors of: few pixels are at a border.
    """
    height, width = inside.shape
    above, below = beside(row, height)
    on, marks = inside[row, start:end], border[start:end]
    up, down = inside[above, start:end], inside[below, start:end]
    for i in range(len(on)):
        there = on[i] > ZERO
        marks[i] = ((up[i] > ZERO) != there) | ((down[i] > ZERO) != there)
    # at an end, the neighbour on the other side stands for both, which the other loop compares
    first, after = max(start, 1), min(end, width - 1)
    _mark_unlike(inside[row, first:end], inside[row, first - 1 : end - 1], border[first:end])
    _mark_unlike(inside[row, start:after], inside[row, start + 1 : after + 1], border[start:after])


@inner
def _mark_unlike(on: Plane, next_to: Plane, marks: NDArray[np.bool_]) -> None:
    for i in range(len(on)):
        marks[i] |= (on[i] > ZERO) != (next_to[i] > ZERO)
