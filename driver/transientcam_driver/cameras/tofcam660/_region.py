"""The part of the sensor that is read."""

from dataclasses import dataclass
from typing import Final

COLUMNS: Final = 320
ROWS: Final = 240


@dataclass(frozen=True, slots=True)
class Region:
    """Columns and rows that are read; right and bottom are the first that are not."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def width(self) -> int:
        """In pixels."""
        return self.right - self.left

    @property
    def height(self) -> int:
        """In pixels."""
        return self.bottom - self.top

    @property
    def edges(self) -> tuple[int, int, int, int]:
        """Left, top, right, bottom."""
        return self.left, self.top, self.right, self.bottom

    @property
    def possible(self) -> bool:
        """Whether the sensor reads it: both halves are read from the middle at the same time."""
        columns = 0 <= self.left < self.right <= COLUMNS
        return columns and 0 <= self.top < self.bottom == ROWS - self.top


FULL: Final = Region(0, 0, COLUMNS, ROWS)
