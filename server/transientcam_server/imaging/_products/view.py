"""Views of a product: a region of the picture, every n-th pixel, some times of flight."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam.documents import FrameDocument, FrameMeta
from transientcam.wire import MAX_DECIMATION
from transientcam_server.errors import invalid

_IMAGE: Final = ("y", "x")
DEFAULT_BINS: Final = 64
"""Times of flight of a product over time where a request names none."""


@dataclass(frozen=True, slots=True)
class Crop:
    """The pixels of a frame that are requested: every ``decimation``-th of ``region``, both ways.

    Equal crops of equal frames are the same bytes, so one may be part of a key.
    """

    region: tuple[int, int, int, int] | None = None
    """Column and row of the first pixel, width and height, in pixels of the frame; None for all."""
    decimation: int = 1
    """1 for every pixel. The region's first pixel is always among those that stay."""

    @classmethod
    def of(
        cls,
        region: Sequence[int] | None,
        decimation: int | None,
        *,
        height: int,
        width: int,
        path: str = "",
    ) -> "Crop":
        """Return the crop of a frame of ``height`` x ``width`` pixels; None leaves a part out.

        Raises Problem ``invalid-request`` with ``field`` (under ``path``), ``value`` and ``limit``
        if the region is not four integers, is empty or not within the frame, or if the decimation
        is out of range.
        """
        step = 1 if decimation is None else decimation
        if not _is_integer(step) or not 1 <= step <= MAX_DECIMATION:
            raise invalid(f"{path}decimation", decimation, f"an integer from 1 to {MAX_DECIMATION}")
        if region is None:
            return cls(None, step)
        inside = f"x,y,width,height within {width} x {height} pixels, each an integer"
        if len(region) != len(("x", "y", "width", "height")) or not all(map(_is_integer, region)):
            raise invalid(f"{path}region", list(region), inside)
        x, y, columns, rows = region
        fits = x >= 0 and y >= 0 and x + columns <= width and y + rows <= height
        if not fits or columns < 1 or rows < 1:
            raise invalid(f"{path}region", list(region), inside)
        whole = (columns, rows) == (width, height)
        return cls(None if whole else (x, y, columns, rows), step)

    @classmethod
    def parse(
        cls, region: str | None, decimation: int | None, *, height: int, width: int
    ) -> "Crop":
        """Do as `of` does for the region of a query: ``"x,y,width,height"``."""
        if region is None:
            return cls.of(None, decimation, height=height, width=width)
        try:
            numbers = [int(part) for part in region.split(",")]
        except ValueError:
            limit = f"x,y,width,height within {width} x {height} pixels, each an integer"
            raise invalid("region", region, limit) from None
        return cls.of(numbers, decimation, height=height, width=width)

    @property
    def is_whole(self) -> bool:
        """Whether every pixel of the frame stays."""
        return self.region is None and self.decimation == 1

    def apply(self, array: NDArray[Any], axes: Sequence[str] = _IMAGE) -> NDArray[Any]:
        """Return the pixels that stay, in C order; the array itself where all do.

        ``axes`` names the array's last axes; those called ``y`` and ``x`` are cut, others kept.
        """
        if self.is_whole:
            return array
        cuts = self._slices()
        kept: tuple[Any, ...] = (..., *(cuts.get(axis, slice(None)) for axis in axes))
        return np.ascontiguousarray(array[kept])

    def shape(self, height: int, width: int) -> tuple[int, int]:
        """Return rows and columns that stay of a frame of ``height`` x ``width`` pixels."""
        _, _, columns, rows = self.region or (0, 0, width, height)
        return -(-rows // self.decimation), -(-columns // self.decimation)

    def with_meta(self, meta: FrameDocument) -> FrameMeta:
        """Return a frame's metadata with these pixels, where ``region`` is always four numbers."""
        region = self.region or (0, 0, meta["width"], meta["height"])
        return {**meta, "region": list(region), "decimation": self.decimation}

    def _slices(self) -> dict[str, slice]:
        if self.region is None:
            every = slice(None, None, self.decimation)
            return {"y": every, "x": every}
        x, y, columns, rows = self.region
        return {
            "y": slice(y, y + rows, self.decimation),
            "x": slice(x, x + columns, self.decimation),
        }


WHOLE: Final = Crop()
"""Every pixel."""


def _is_integer(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


@dataclass(frozen=True, slots=True)
class View:
    """The part of a product that is requested; equal views of one frame are the same bytes."""

    time_s: tuple[float, ...] = ()
    """Times of flight of a product over time."""
    crop: Crop = WHOLE
    """Region and decimation."""
    y: int | None = None
    """Row of a streak, in pixels of the whole frame."""


def evenly(base_frequency_hz: float, bins: int = DEFAULT_BINS) -> tuple[float, ...]:
    """Return times of flight in s, evenly over one period of the base frequency."""
    period_s = 1.0 / base_frequency_hz
    return tuple(period_s * index / bins for index in range(bins))


EVERYTHING: Final = View()
"""All of a product that has no times of flight."""
