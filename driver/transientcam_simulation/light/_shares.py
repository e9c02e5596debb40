"""Which shares of pixels shapes cover along lines through one point, by lanes that are ready.

``soft`` edges take shares of the pixels that they cross; others run between pixels.
"""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import LANES
from transientcam_simulation.light._bundle import NOWHERE, TILE, Bundle, Region, numbers
from transientcam_simulation.light._coverage import (
    TOUCHING,
    Crossing,
    Plane,
    axes_of,
    covered,
    covered_among,
    crossing,
    overlapped,
)
from transientcam_simulation.scene import Ellipsoid, Shape

Hidden = tuple[Plane, Plane, Plane]
"""Of a shape, its shares of pixels, the t of its front, and which shares are left to be seen."""
_TINY = np.float32(1e-9)


class Around:
    """Which points are above, below, left and right of each, by index (4, P); P is none."""

    def __init__(self, beside: NDArray[np.int32]) -> None:
        self.beside = beside

    @cached_property
    def reach(self) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Where the neighbours of successive points are, for lanes: see `compiled_chunks.reach`."""
        lane = LANES.find("reach")
        assert lane is not None  # noqa: S101  (lanes are made ready together)
        reach, rim = lane(self.beside)
        return reach, rim


def seen(
    shape: Shape, bundle: Bundle, region: Region, fills: Plane, *, soft: bool
) -> tuple[Plane, Plane]:
    """Return shares (h, w) of what ``fills`` pixels that show a shape, and the t of its front.

    ``fills`` are shares of all pixels, (H, W), or (1, W) where all are the same.
    """
    lane = LANES.find("seen")
    if lane is not None and soft and isinstance(shape, Ellipsoid):
        lines = *bundle.way, bundle.near, bundle.far
        share, at = lane(axes_of([shape])[0], bundle.apex, *lines, fills, numbers(region))
        return share, at
    way, near, far = bundle.within(region)
    cross = crossing(shape, bundle.apex, way)
    share, root = _share(cross, soft=soft, rooted=True)
    at = cross.entered(root)
    share *= np.broadcast_to(fills, bundle.way[0].shape)[region]
    share[~((at > near) & (at < far))] = 0
    return share, at


def shown_tiles(shown: Plane) -> NDArray[np.bool_] | None:
    """Return tiles (R, C) in which anything is shown, given shares of all pixels; None for all."""
    lane = LANES.find("shown_tiles")
    if lane is None:
        return None
    tiles: NDArray[np.bool_] = lane(shown, TILE)
    return tiles


def grown_tiles(tiles: NDArray[np.bool_] | None, pixels: int) -> NDArray[np.bool_] | None:
    """Return tiles, and those up to so many pixels from one."""
    lane = LANES.find("grown")
    if tiles is None or lane is None:
        return None
    grown: NDArray[np.bool_] = lane(tiles, -(-pixels // TILE))
    return grown


def shade(
    shapes: list[Shape],
    bundle: Bundle,
    left: Plane,
    shows: NDArray[np.bool_] | None,
    *,
    soft: bool,
) -> list[Region]:
    """Take from shares (H, W) of light what shapes block; return the regions of those that do.

    Light is blocked on a bundle's lines between two of their points. It matters in tiles (R, C)
    that show it.
    """
    tiles, regions = bundle.meeting(shapes)
    if shows is not None:
        tiles &= shows
    lane = LANES.find("shade")
    axes = axes_of(shapes)
    if lane is not None and soft and len(axes) == len(shapes):
        of = np.array([numbers(each or NOWHERE) for each in regions])
        lines = *bundle.way, bundle.near, bundle.far
        blocks = lane(axes, bundle.apex, *lines, tiles, TILE, of, TOUCHING, left)
        return [each for each, does in zip(regions, blocks, strict=True) if each and does]
    blocking: list[Region] = []
    for shape, region in zip(shapes, regions, strict=True):
        if region is None:
            continue
        way, near, far = bundle.within(region)
        cross = crossing(shape, bundle.apex, way)
        dark = _share(cross, soft=soft)[0] * cross.between(near, far)
        if dark.any():
            left[region] = overlapped(left[region], 1 - dark)
            blocking.append(region)
    return blocking


def hide(one: Hidden, other: Hidden, *, soft: bool) -> None:
    """Take from what is left of two shares what each shape hides of the other."""
    lane = LANES.find("hide")
    if lane is not None and soft:
        lane(*one, *other)
        return
    (share, at, left), (its_share, its_at, rest) = one, other
    hidden = overlapped(share, its_share)
    if not hidden.any():
        return
    nearer = _above(its_at - at, soft=soft)
    rest *= 1 - nearer * hidden / np.maximum(its_share, _TINY)
    left *= 1 - (1 - nearer) * hidden / np.maximum(share, _TINY)


def _above(values: Plane, *, soft: bool) -> Plane:
    """Return the share of each pixel (h, w) where values are above 0."""
    return covered(values, rooted=False)[0] if soft else (values > 0).astype(np.float32)


def share_around(cross: Crossing, counts: NDArray[np.bool_], around: Around | None) -> Plane:
    """Return the share of the pixels around points that a shape covers, where it counts.

    Without ``around`` edges are not soft.
    """
    values = [np.where(counts, each, np.float32(np.nan)) for each in cross.inside]
    if around is None:
        return _product([(each > 0).astype(np.float32) for each in values])
    return _product([covered_among(each, around.beside) for each in values])


def around(rows: NDArray[np.int32], columns: NDArray[np.int32], region: Region) -> Around:
    """Return what is around points in a region of an image."""
    top, left, height, width = numbers(region)
    lane = LANES.find("around")
    if lane is not None:
        return Around(lane(rows, columns, top, left, height, width))
    place = np.full((height + 2, width + 2), len(rows), dtype=np.int32)
    rows, columns = rows - top + 1, columns - left + 1
    place[rows, columns] = np.arange(len(rows))
    steps = ((-1, 0), (1, 0), (0, -1), (0, 1))
    return Around(np.array([place[rows + down, columns + right] for down, right in steps]))


def among(on: NDArray[np.intp], around: Around) -> Around:
    """Return what is around some of the points, by their own indices."""
    beside = around.beside
    if len(on) == beside.shape[1]:
        return around
    lane = LANES.find("among")
    if lane is not None:
        return Around(lane(on, beside))
    place = np.full(beside.shape[1] + 1, len(on), dtype=np.int32)
    place[on] = np.arange(len(on))
    return Around(place[beside.take(on, axis=1)])


def _share(cross: Crossing, *, soft: bool, rooted: bool = False) -> tuple[Plane, Plane]:
    """Share of each pixel that a shape covers; with the mean root that says where, if asked."""
    if not soft:
        shares = [_above(each, soft=False) for each in cross.inside]
        root = np.sqrt(np.maximum(cross.inside[0], 0)) if rooted else shares[0]
        return _product(shares), root
    parts = [covered(each, rooted=rooted) for each in cross.inside]
    return _product([share for share, _root in parts]), parts[0][1]


def _product(planes: list[Plane]) -> Plane:
    product = planes[0]
    for plane in planes[1:]:
        product = product * plane
    return product
