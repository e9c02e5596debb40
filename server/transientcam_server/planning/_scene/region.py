"""A region of the picture that a plan is for: a box or a polygon of pixels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.errors import Problem, kinds

MOST_CORNERS: Final = 64
_WORDS: Final = (
    f"a box [x, y, width, height], or from 3 to {MOST_CORNERS} corners [x, y] of a polygon, "
    "in whole pixels"
)


@dataclass(frozen=True, slots=True)
class Region:
    """The pixels whose centres a polygon holds, those on its edges too.

    Attributes
    ----------
    corners
        Column and row of pixels, in their order.
    """

    corners: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, value: Sequence[Any] | None) -> "Region | None":
        """Return the region of a box or of corners; None for None.

        Raises
        ------
        Problem
            ``invalid-request`` for anything else.
        """
        if value is None:
            return None
        if len(value) == 4 and all(map(_whole, value)) and min(value) >= 0 < min(value[2:]):
            x, y, width, height = value
            right, bottom = x + width - 1, y + height - 1
            return cls(((x, y), (right, y), (right, bottom), (x, bottom)))
        corners = tuple(tuple(each) if isinstance(each, list | tuple) else () for each in value)
        if 3 <= len(corners) <= MOST_CORNERS and all(map(_pixel, corners)):
            return cls(corners)
        raise _refused(list(value))

    @classmethod
    def parse(cls, text: str | None) -> "Region | None":
        """Return the region that a text has: ``x,y,width,height`` or corners ``x,y/x,y/x,y``.

        Raises
        ------
        Problem
            ``invalid-request`` for anything else.
        """
        if text is None:
            return None
        try:
            numbers = [[int(each) for each in part.split(",")] for part in text.split("/")]
        except ValueError:
            raise _refused([text]) from None
        return cls.of(numbers[0] if len(numbers) == 1 else numbers)

    def mask(self, height: int, width: int) -> NDArray[np.bool_]:
        """Return which pixels (H, W) are within.

        Raises
        ------
        Problem
            ``invalid-request`` if a corner is not in the picture.
        """
        x, y = np.array(self.corners).T
        if x.max() >= width or y.max() >= height:
            raise _refused([*map(list, self.corners)], f" within {width} x {height} pixels")
        row, column = np.mgrid[:height, :width]
        odd = np.zeros((height, width), dtype=bool)
        on_edge = np.zeros_like(odd)
        for ax, ay, bx, by in zip(x, y, np.roll(x, -1), np.roll(y, -1), strict=True):
            side = (bx - ax) * (row - ay) - (by - ay) * (column - ax)
            between = (column >= min(ax, bx)) & (column <= max(ax, bx))
            between &= (row >= min(ay, by)) & (row <= max(ay, by))
            on_edge |= (side == 0) & between
            odd ^= ((ay > row) != (by > row)) & ((side > 0) == (by > ay))
        return np.asarray(odd | on_edge)

    def to_document(self) -> list[list[int]]:
        """Return the corners as JSON."""
        return [list(corner) for corner in self.corners]


def _whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _pixel(corner: tuple[Any, ...]) -> bool:
    return len(corner) == 2 and all(map(_whole, corner)) and min(corner) >= 0


def _refused(value: list[Any], where: str = "") -> Problem:
    detail = f"region must be {_WORDS}{where}."
    return Problem(kinds.INVALID_REQUEST, detail, field="region", value=value, limit=_WORDS + where)
