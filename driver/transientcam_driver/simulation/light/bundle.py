"""Straight lines through one point, one for each pixel: rays of the camera, or ways of light."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.light.coverage import Plane
from transientcam_driver.simulation.scene.geometry import Points, Shape

Region = tuple[slice, slice]
_TILE = 8  # pixels a side
_WIDER = 1e-3  # rad, for rounding


@dataclass(frozen=True, slots=True)
class Bundle:
    """Lines ``apex + t way`` of H x W pixels, and their directions by tiles of pixels.

    Attributes
    ----------
    near
        (H, W) t from which a line counts; it counts up to ``far``.
    axis, cosine, sine
        (R, C, 3) mean direction of a tile's lines, and (R, C) of the largest angle to it.
    counts
        (R, C) whether any line of a tile counts.
    """

    apex: Points
    way: tuple[Plane, Plane, Plane]
    near: Plane
    far: Plane
    axis: NDArray[np.float64]
    cosine: NDArray[np.float64]
    sine: NDArray[np.float64]
    counts: NDArray[np.bool_]

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
        height, width = counts.shape
        unit = way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-12)
        unit[~counts] = 0
        rows, columns = -(-height // _TILE), -(-width // _TILE)
        padded = np.zeros((rows * _TILE, columns * _TILE, 3))
        padded[:height, :width] = unit
        tiles = padded.reshape(rows, _TILE, columns, _TILE, 3).swapaxes(1, 2)
        tiles = tiles.reshape(rows, columns, -1, 3)
        axis = tiles.sum(axis=2)
        axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-12)
        cosine = np.einsum("rcpx,rcx->rcp", tiles, axis)
        there = tiles.any(axis=-1)
        angle = np.where(there, np.arccos(np.clip(cosine, -1, 1)), 0.0).max(axis=-1) + _WIDER
        x, y, z = (np.ascontiguousarray(way[..., k], dtype=np.float32) for k in range(3))
        return cls(
            apex,
            (x, y, z),
            np.broadcast_to(np.asarray(near, dtype=np.float32), counts.shape),
            np.broadcast_to(np.asarray(far, dtype=np.float32), counts.shape),
            axis,
            np.cos(angle),
            np.sin(angle),
            np.asarray(there.any(axis=-1)),
        )

    def meeting(self, shape: Shape) -> Region | None:
        """Return the region of the pixels whose lines may meet a shape; None if there are none."""
        low, high = shape.box
        centre, radius_m = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
        away = centre - self.apex
        distance_m = float(np.linalg.norm(away))
        if distance_m <= radius_m:
            return _bounds(self.counts, self.way[0].shape)
        sine = radius_m / distance_m
        # cosine of the largest angle at which a tile's lines reach the sphere around the shape
        least = np.sqrt(1 - sine * sine) * self.cosine - sine * self.sine
        return _bounds((self.axis @ (away / distance_m) >= least) & self.counts, self.way[0].shape)

    def within(self, region: Region) -> tuple[tuple[Plane, ...], Plane, Plane]:
        """Return the ways of a region's lines, and from where to where they count."""
        ways = tuple(each[region] for each in self.way)
        return ways, self.near[region], self.far[region]


def _bounds(tiles: NDArray[np.bool_], shape: tuple[int, ...]) -> Region | None:
    rows, columns = np.flatnonzero(tiles.any(axis=1)), np.flatnonzero(tiles.any(axis=0))
    if not rows.size:
        return None
    return (
        slice(int(rows[0]) * _TILE, min(int(rows[-1] + 1) * _TILE, shape[0])),
        slice(int(columns[0]) * _TILE, min(int(columns[-1] + 1) * _TILE, shape[1])),
    )


def extent(region: Region) -> tuple[int, int]:
    """Return the numbers of rows and columns."""
    return region[0].stop - region[0].start, region[1].stop - region[1].start


def union(regions: list[Region]) -> Region:
    """Return the smallest region that holds all; an empty one if there are none."""
    if not regions:
        return slice(0, 0), slice(0, 0)
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


def inside(region: Region, whole: Region) -> Region:
    """Return a region by its place in a larger one."""
    rows, columns = (
        slice(a.start - b.start, a.stop - b.start) for a, b in zip(region, whole, strict=True)
    )
    return rows, columns
