"""A region of the picture that a plan is for: a box or a polygon of pixels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from transientcam_server.errors import Problem, kinds

_WORDS = "x, y, width, height of a box, or 3 to 64 corners x, y of a polygon, in whole pixels"


@dataclass(frozen=True, slots=True)
class Region:
    """The pixels that a polygon of columns and rows holds, those on its edges too."""

    corners: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, value: str | Sequence[Any] | None) -> "Region | None":
        """Return a region of four numbers or of corners; as text ``x,y,w,h`` or ``x,y/x,y/x,y``.

        Problem ``invalid-request`` for anything else; None for None.
        """
        if value is None:
            return None
        try:
            if isinstance(value, str):
                parts = [part.split(",") for part in value.split("/")]
                numbers = [[int(each) for each in part] for part in parts]
            else:
                corners_or_box: Any = [value] if np.ndim(value) == 1 else value
                numbers = [list(each) for each in corners_or_box]
            if len(numbers) == 1:
                x, y, width, height = numbers[0]
                if width < 1 or height < 1:
                    raise _refused(value)
                numbers = [[x, y], [x + width - 1, y], [x + width - 1, y + height - 1]]
                numbers.append([x, y + height - 1])
            corners = tuple((column, row) for column, row in numbers)
        except (TypeError, ValueError):
            raise _refused(value) from None
        whole = all(isinstance(each, int) and each >= 0 for corner in corners for each in corner)
        if not whole or not 3 <= len(corners) <= 64:
            raise _refused(value)
        return cls(corners)

    def mask(self, height: int, width: int) -> NDArray[np.bool_]:
        """Return which pixels (H, W) are within; ``invalid-request`` if a corner is outside."""
        if any(x >= width or y >= height for x, y in self.corners):
            raise _refused(self.to_document(), f", within {width} x {height} pixels")
        image = Image.new("1", (width, height))
        ImageDraw.Draw(image).polygon(self.corners, fill=1, outline=1)
        return np.array(image)

    def to_document(self) -> list[list[int]]:
        """Return the corners as JSON."""
        return [list(corner) for corner in self.corners]


def _refused(value: Any, where: str = "") -> Problem:
    detail = f"region must be {_WORDS}{where}."
    return Problem(kinds.INVALID_REQUEST, detail, field="region", value=value, limit=_WORDS + where)
