"""Straight lines through one point, one for each pixel: rays of the camera, or ways of light."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from transientcam_simulation.light._coverage import Plane
from transientcam_simulation.scene import Points

Region = tuple[slice, slice]
Numbers = tuple[int, int, int, int]
"""Of a region: first row and column, numbers of rows and columns."""
NOWHERE: Final[Region] = (slice(0, 0), slice(0, 0))
TILE: Final = 4
"""Pixels a side."""
_AROUND = 1  # pixels beside a tile, whose squares what is seen just outside of them may reach
_ACROSS = 0.05  # cosine to the middle line, below which a line's place beside it is not taken


@dataclass(frozen=True, slots=True)
class Bundle:
    """Lines ``apex + t way`` of H x W pixels, and where tiles of pixels lie among them."""

    apex: Points
    way: tuple[Plane, Plane, Plane]
    near: Plane
    """(H, W) t from which a line counts; it counts up to ``far``. (1, W) where all are the same."""
    far: Plane
    frame: NDArray[np.float64]
    """(3, 3) the middle line, and two unit vectors across it."""
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    """``low``, ``high``: (2, R, C) along these two, tangents of the angles of a tile's lines to the
    middle line."""
    rows: tuple[NDArray[np.float64], NDArray[np.float64]]
    """Lowest and highest (2, R) of these in each row of tiles."""

    @classmethod
    def of(
        cls,
        apex: Points,
        way: Points,
        counts: NDArray[np.bool_],
        *,
        near: NDArray[np.floating] | np.floating | float,
        far: NDArray[np.floating] | np.floating | float,
    ) -> "Bundle":
        """Make one of ways (H, W, 3); lines that do not count have any."""
        unit = way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-12)
        frame = _frame(unit[counts].sum(axis=0))
        along, *across = np.moveaxis(unit @ frame.T, -1, 0)
        aside = along <= _ACROSS
        tangents = np.array(across) / np.where(aside, 1.0, along)
        low = _of_tiles(np.where(counts, np.where(aside, -np.inf, tangents), np.inf), np.min)
        high = _of_tiles(np.where(counts, np.where(aside, np.inf, tangents), -np.inf), np.max)
        x, y, z = (np.ascontiguousarray(way[..., k], dtype=np.float32) for k in range(3))
        return cls(
            apex,
            (x, y, z),
            plane_of(near, counts.shape),
            plane_of(far, counts.shape),
            frame,
            low,
            high,
            (low.min(axis=2), high.max(axis=2)),
        )

    def within(self, region: Region) -> tuple[tuple[Plane, Plane, Plane], Plane, Plane]:
        """Return the ways of a region's lines, and from where to where they count."""
        x, y, z = (each[region] for each in self.way)
        near, far = (np.broadcast_to(each, self.way[0].shape) for each in (self.near, self.far))
        return (x, y, z), near[region], far[region]


def plane_of(values: NDArray[np.floating] | np.floating | float, shape: tuple[int, ...]) -> Plane:
    """Return a plane (H, W) in single precision; (1, W) if all values are the same."""
    plane = np.broadcast_to(np.asarray(values, dtype=np.float32), shape)
    if plane.size and (plane == plane[0, 0]).all():
        return plane[:1].copy()
    return plane.copy()


def _frame(middle: Points) -> NDArray[np.float64]:
    """Return unit vectors along a direction and across it, the first of these level."""
    length = float(np.linalg.norm(middle))  # none of rays that go all ways: then any will do
    middle = middle / length if length > 1e-12 else np.array([0.0, 1.0, 0.0])
    level = np.cross(middle, [0.0, 0.0, 1.0] if abs(middle[2]) < 0.9 else [0.0, 1.0, 0.0])
    level /= np.linalg.norm(level)
    return np.array([middle, level, np.cross(level, middle)])


def _of_tiles(
    planes: NDArray[np.float64], most: Callable[..., NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Lowest or highest values (2, R, C) of tiles and of the pixels around each."""
    height, width = planes.shape[1:]
    padding = [(_AROUND, _AROUND + -size % TILE) for size in (height, width)]
    padded = np.pad(planes, [(0, 0), *padding], mode="edge")
    side = TILE + 2 * _AROUND
    windows = sliding_window_view(padded, (side, side), axis=(1, 2))[:, ::TILE, ::TILE]
    return np.ascontiguousarray(most(windows, axis=(-2, -1)))


def extent(region: Region) -> tuple[int, int]:
    """Return the numbers of rows and columns."""
    return region[0].stop - region[0].start, region[1].stop - region[1].start


def numbers(region: Region) -> Numbers:
    """Return first row and column, and numbers of rows and columns."""
    return region[0].start, region[1].start, *extent(region)


def union(regions: list[Region]) -> Region:
    """Return the smallest region that holds all; an empty one if there are none."""
    if not regions:
        return NOWHERE
    rows, columns = zip(*regions, strict=True)
    return (
        slice(min(r.start for r in rows), max(r.stop for r in rows)),
        slice(min(c.start for c in columns), max(c.stop for c in columns)),
    )


def overlap(one: Region, other: Region) -> Region | None:
    """Return what two regions have in common; None if nothing."""
    rows, columns = (
        slice(max(a.start, b.start), min(a.stop, b.stop)) for a, b in zip(one, other, strict=True)
    )
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return None
    return rows, columns


def holds(whole: Region, region: Region) -> bool:
    """Whether a region lies in another one."""
    return all(a.start <= b.start and b.stop <= a.stop for a, b in zip(whole, region, strict=True))


def inside(region: Region, whole: Region) -> Region:
    """Return a region by its place in a larger one."""
    rows, columns = (
        slice(a.start - b.start, a.stop - b.start) for a, b in zip(region, whole, strict=True)
    )
    return rows, columns
