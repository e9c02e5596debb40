"""Which shares of pixels shapes cover along lines through one point.

``soft`` edges take shares of the pixels that they cross; others run between pixels.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.light import (
    _compiled_chunks as compiled_chunks,
    _compiled_overlaps as compiled_overlaps,
    _compiled_shadows as compiled_shadows,
    _compiled_silhouettes as compiled_silhouettes,
    _compiled_tiles as compiled_tiles,
)
from transientcam_simulation.light._bundle import NOWHERE, TILE, Bundle, Region, numbers
from transientcam_simulation.light._coverage import Crossing, Plane, covered, crossing
from transientcam_simulation.scene import Ellipsoid, Primitive


@dataclass(frozen=True)
class Around:
    """Which points are above, below, left and right of each, by index (4, P); P is none."""

    beside: NDArray[np.int32]

    @cached_property
    def reach(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Where the neighbours of successive points are: see `compiled_chunks.reach`."""
        return compiled_chunks.reach(self.beside)

    def among(self, on: NDArray[np.intp]) -> "Around":
        """Return what is around some of the points, by their own indices."""
        if len(on) == self.beside.shape[1]:
            return self
        return Around(compiled_chunks.among(on, self.beside))


def around(rows: NDArray[np.int32], columns: NDArray[np.int32], region: Region) -> Around:
    """Return what is around points in a region of an image."""
    return Around(compiled_chunks.around(rows, columns, *numbers(region)))


def alone(points: int) -> Around:
    """Return that nothing is around so many points: each is covered as a whole, or not at all."""
    return Around(np.full((4, points), points, dtype=np.int32))


def axes_of(shapes: Iterable[Primitive]) -> NDArray[np.float64]:
    """Return (N, 2, 3) centres and radii of the ellipsoids among shapes."""
    axes = [(each.centre, each.radii) for each in shapes if isinstance(each, Ellipsoid)]
    return np.array(axes, dtype=np.float64).reshape(-1, 2, 3)


def meeting(
    shapes: list[Primitive], bundle: Bundle
) -> tuple[NDArray[np.bool_], list[Region | None]]:
    """Return which tiles (N, R, C) have lines that may meet shapes, and regions that hold them.

    A region is None if there are none.
    """
    limits = np.empty((len(shapes), 2, 2))
    round_ = [isinstance(each, Ellipsoid) for each in shapes]
    limits[round_] = compiled_tiles.tangents(axes_of(shapes), bundle.apex, bundle.frame)
    for limit, shape in zip(limits, shapes, strict=True):
        if not isinstance(shape, Ellipsoid):
            limit[:] = [shape.tangents(bundle.apex, bundle.frame[0], k) for k in bundle.frame[1:]]
    tiles, spans = compiled_tiles.met(limits, bundle.low, bundle.high, *bundle.rows)
    height, width = bundle.way[0].shape
    return tiles, [
        (
            slice(top * TILE, min(bottom * TILE, height)),
            slice(left * TILE, min(right * TILE, width)),
        )
        if bottom
        else None
        for top, bottom, left, right in spans.tolist()
    ]


def seen(
    shape: Primitive, bundle: Bundle, region: Region, fills: Plane, *, soft: bool
) -> tuple[Plane, Plane]:
    """Return shares (h, w) of what ``fills`` pixels that show a shape, and the t of its front.

    ``fills`` are shares of all pixels, (H, W), or (1, W) where all are the same.
    """
    if isinstance(shape, Ellipsoid):
        lines = *bundle.way, bundle.near, bundle.far
        axes = axes_of([shape])[0]
        return compiled_silhouettes.seen(axes, bundle.apex, *lines, fills, numbers(region), soft)
    way, near, far = bundle.within(region)
    cross = crossing(shape, bundle.apex, way)
    share = _share(cross, soft=soft)
    share *= np.broadcast_to(fills, bundle.way[0].shape)[region]
    share[~((cross.at > near) & (cross.at < far))] = 0
    return share, cross.at


def shown_tiles(shown: Plane) -> NDArray[np.bool_]:
    """Return tiles (R, C) in which anything is shown, given shares of all pixels."""
    return compiled_tiles.shown_tiles(shown, TILE)


def grown_tiles(tiles: NDArray[np.bool_], pixels: int) -> NDArray[np.bool_]:
    """Return tiles, and those up to so many pixels from one."""
    return compiled_tiles.grown(tiles, -(-pixels // TILE))


def shade(
    shapes: list[Primitive], bundle: Bundle, left: Plane, shows: NDArray[np.bool_], *, soft: bool
) -> list[Region]:
    """Take from shares (H, W) of light what shapes block; return the regions of those that do.

    Light is blocked on a bundle's lines between two of their points. It matters in tiles (R, C)
    that show it.
    """
    tiles, regions = meeting(shapes, bundle)
    tiles &= shows
    lines = *bundle.way, bundle.near, bundle.far
    blocking: list[Region] = []
    for is_round, group in groupby(range(len(shapes)), lambda k: isinstance(shapes[k], Ellipsoid)):
        some = list(group)
        if is_round:
            axes, of = axes_of(shapes[k] for k in some), [regions[k] or NOWHERE for k in some]
            where = tiles[some[0] : some[-1] + 1], TILE, np.array([numbers(each) for each in of])
            blocks = compiled_shadows.shade(axes, bundle.apex, *lines, *where, soft, left)
            blocking += [each for each, does in zip(of, blocks, strict=True) if does]
            continue
        for k in some:
            region = regions[k]
            if region is not None and _shade_flat(shapes[k], bundle, left, region, soft=soft):
                blocking.append(region)
    return blocking


def _shade_flat(
    shape: Primitive, bundle: Bundle, left: Plane, region: Region, *, soft: bool
) -> bool:
    """Take what a rectangle blocks in a region; whether it blocks any."""
    way, near, far = bundle.within(region)
    cross = crossing(shape, bundle.apex, way)
    dark = _share(cross, soft=soft) * cross.between(near, far)
    blocks = bool(dark.any())
    if blocks:
        left[region] = compiled_overlaps.overlapped(left[region], 1 - dark)
    return blocks


def _share(cross: Crossing, *, soft: bool) -> Plane:
    """Share of each pixel that a rectangle covers."""
    parts = [covered(each) if soft else (each > 0).astype(np.float32) for each in cross.inside]
    return parts[0] * parts[1]
