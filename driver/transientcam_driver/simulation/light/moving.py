"""Light in a scene some of whose surfaces move.

What stands still is traced once. At each time only what the moving surfaces change is computed: the
pixels that show one of them, by the share of the pixel that it covers, and the ways of light that
it blocks. Everything follows the device's time without steps.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.light.bundle import (
    Bundle,
    Region,
    extent,
    inside,
    overlap,
    union,
)
from transientcam_driver.simulation.light.coverage import (
    Crossing,
    Plane,
    covered,
    covered_among,
    crossing,
    overlapped,
)
from transientcam_driver.simulation.light.ends import Ends
from transientcam_driver.simulation.light.layers import Layer, MovingResponses, Shadow
from transientcam_driver.simulation.light.paths import ImageLight, image_lights
from transientcam_driver.simulation.light.still import Sight, StillLight
from transientcam_driver.simulation.scene.geometry import Points
from transientcam_driver.simulation.scene.scene import Scene

_TINY = np.float32(1e-9)
_AWAY = np.array([0.0, 0.0, -1e6])  # where surfaces that move are put while the rest is traced


@dataclass(frozen=True, slots=True)
class _Seen:
    """A surface that moves, where the camera sees it: shares (h, w) of the pixels of a region."""

    index: int
    sight: Sight
    region: Region
    share: Plane
    at_m: Plane

    def points(self) -> tuple[NDArray[Any], ...]:
        """Return its pixels: rows, columns, shares, distances, and points and ways by component."""
        place = np.nonzero(self.share)
        at_m, bundle = self.at_m[place], self.sight.bundle
        rows, columns = (on + of.start for on, of in zip(place, self.region, strict=True))
        way = [each[rows, columns] for each in bundle.way]
        point = [w * at_m + np.float32(a) for w, a in zip(way, bundle.apex, strict=True)]
        return rows, columns, self.share[place], at_m, *point, *way


class MovingLight:
    """The light of a scene at any time.

    Parameters
    ----------
    scene
        With moving surfaces that scatter light.
    still
        Light of what stands still (see ``still_scene``).
    soft
        Whether pixels that a silhouette or a shadow crosses take a share of it.
    """

    def __init__(self, scene: Scene, still: StillLight, *, soft: bool) -> None:
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        self.scene = scene
        self.still = still
        self._soft = soft
        self._movers = tuple(k for k, each in enumerate(scene.surfaces) if each.motions)
        self._lights = tuple(image_lights(scene))
        self._sights = still.lines_of_sight(soft=soft)
        self._chains = tuple(
            tuple(self._light_segments(k, light)) for k, light in enumerate(self._lights)
        )

    def at(self, time_s: float) -> MovingResponses:
        """Impulse responses at a time."""
        scene = self.scene.at(time_s)
        found = [self._cover(scene, k, sight) for sight in self._sights for k in self._movers]
        seen = self._visible([each for each in found if each])
        layers = self._lit(scene, seen) if seen else []
        shadows = [shadow for k in range(len(self._chains)) if (shadow := self._shadow(scene, k))]
        region = union([*(each.region for each in layers), *(each.region for each in shadows)])
        return MovingResponses(self.still, scene, tuple(layers), tuple(shadows), region)

    def _cover(self, scene: Scene, index: int, sight: Sight) -> _Seen | None:
        """Shares of pixels that a surface covers, where nothing that stands still is before it."""
        shape = scene.surfaces[index].shape
        region = sight.bundle.meeting(shape)
        if region is None:
            return None
        way, near, far = sight.bundle.within(region)
        cross = crossing(shape, sight.bundle.apex, way)
        share, root = self._share(cross, rooted=True)
        at_m = cross.entered(root)
        share *= sight.fills[region]
        share[~((at_m > near) & (at_m < far))] = 0
        return _Seen(index, sight, region, share, at_m) if share.any() else None

    def _share(self, cross: Crossing, *, rooted: bool = False) -> tuple[Plane, Plane]:
        """Share of each pixel that a shape covers; with the mean root that says where, if asked."""
        if not self._soft:
            shares = [self._above(each) for each in cross.inside]
            root = np.sqrt(np.maximum(cross.inside[0], 0)) if rooted else shares[0]
            return _product(shares), root
        parts = [covered(each, rooted=rooted) for each in cross.inside]
        return _product([share for share, _root in parts]), parts[0][1]

    def _above(self, values: Plane) -> Plane:
        """Share of each pixel where values are above 0."""
        return covered(values, rooted=False)[0] if self._soft else (values > 0).astype(np.float32)

    def _visible(self, seen: list[_Seen]) -> list[_Seen]:
        """Take from each share what nearer surfaces that move cover of it; leave out the hidden."""
        left = [each.share.copy() for each in seen]
        for k, one in enumerate(seen):
            for other, share in zip(seen[k + 1 :], left[k + 1 :], strict=True):
                both = overlap(one.region, other.region)
                if both is None:
                    continue
                mine, its = inside(both, one.region), inside(both, other.region)
                hidden = overlapped(one.share[mine], other.share[its])
                if not hidden.any():
                    continue
                nearer = self._above(other.at_m[its] - one.at_m[mine])
                share[its] *= 1 - nearer * hidden / np.maximum(other.share[its], _TINY)
                left[k][mine] *= 1 - (1 - nearer) * hidden / np.maximum(one.share[mine], _TINY)
        shown = zip(seen, left, strict=True)
        return [replace(each, share=share) for each, share in shown if share.any()]

    def _lit(self, scene: Scene, seen: list[_Seen]) -> list[Layer]:
        """Light the parts of surfaces that are seen, all at once."""
        region = union([each.region for each in seen])
        points = [each.points() for each in seen]
        counts = [len(each[0]) for each in points]
        rows, columns, share, at_m, *components = map(np.concatenate, zip(*points, strict=True))
        around = _around(rows - region[0].start, columns - region[1].start, extent(region))

        def cover(cross: Crossing, on: NDArray[np.intp], counts: NDArray[np.bool_]) -> Plane:
            values = [np.where(counts, each, np.float32(np.nan)) for each in cross.inside]
            if not self._soft:
                return _product([(each > 0).astype(np.float32) for each in values])
            beside = around if len(on) == around.shape[1] else _among(on, around)
            return _product([covered_among(each, beside) for each in values])

        lit = Ends(
            self.still.scene,
            scene.surfaces,
            np.repeat([each.index for each in seen], counts),
            (components[0], components[1], components[2]),
            at_m,
            (components[3], components[4], components[5]),
            np.repeat([each.sight.throughput for each in seen], counts),
        ).lit(self._lights, movers=self._movers, cover=cover)
        pixel = rows * self.still.width + columns
        ends = np.cumsum(counts)
        return [
            Layer(each.region, pixel[start:end], share[start:end], lit.part(slice(start, end)))
            for each, start, end in zip(seen, [0, *ends[:-1]], ends, strict=True)
        ]

    def _shadow(self, scene: Scene, chain: int) -> Shadow | None:
        """Share of the light by a chain of mirrors that is left on what stands still."""
        dark: list[tuple[Region, Plane]] = []
        for bundle in self._chains[chain]:
            for index in self._movers:
                shape = scene.surfaces[index].shape
                region = bundle.meeting(shape)
                if region is None:
                    continue
                way, near, far = bundle.within(region)
                cross = crossing(shape, bundle.apex, way)
                share = self._share(cross)[0] * cross.between(near, far)
                if share.any():
                    dark.append((region, share))
        if not dark:
            return None
        whole = union([region for region, _share in dark])
        left = np.ones(extent(whole), dtype=np.float32)
        for region, share in dark:
            at = inside(region, whole)
            left[at] = overlapped(left[at], 1 - share)
        return Shadow(chain, whole, left)

    def _light_segments(self, chain: int, light: ImageLight) -> list[Bundle]:
        """Ways of light to what stands still, where it arrives, one bundle a segment."""
        shape = self.still.height, self.still.width
        on, point = self.still.lit_by(chain)
        if not on.any():
            return []
        return [
            Bundle.of(
                apex,
                (start - apex).reshape(*shape, 3),
                on.reshape(shape),
                near=near.reshape(shape) if np.ndim(near) else near,
                far=1.0,
            )
            for apex, start, near in _segments(light, point)
        ]


def still_scene(scene: Scene) -> Scene:
    """Return the scene without what moves; surfaces keep their indices."""
    surfaces = tuple(
        replace(each, shape=each.shape.moved(_AWAY), motions=()) if each.motions else each
        for each in scene.surfaces
    )
    return replace(scene, surfaces=surfaces)


def _segments(
    light: ImageLight, point: Points
) -> list[tuple[Points, Points, NDArray[np.float32] | np.float32]]:
    """Ways of light to points: of each segment its apex, its end, and the t where it begins.

    A segment's line goes on to the light's image in the mirrors that are left.
    """
    segments: list[tuple[Points, Points, NDArray[np.float32] | np.float32]] = []
    start = point
    for mirror, image_m in zip(light.mirrors, light.positions_m, strict=False):
        fraction = mirror.shape.hit(start, np.broadcast_to(image_m, start.shape))
        fraction = np.where(fraction < 1, fraction, 0.0)
        segments.append((image_m, start, (1 - fraction).astype(np.float32)))
        start = start + fraction[:, None] * (image_m - start)
    segments.append((light.positions_m[-1], start, np.float32(0)))
    return segments


def _around(
    rows: NDArray[np.intp], columns: NDArray[np.intp], shape: tuple[int, int]
) -> NDArray[np.intp]:
    """Return the points (4, P) above, below, left and right of points; P is none."""
    place = np.full((shape[0] + 2, shape[1] + 2), len(rows))
    place[rows + 1, columns + 1] = np.arange(len(rows))
    steps = ((-1, 0), (1, 0), (0, -1), (0, 1))
    return np.array([place[rows + 1 + down, columns + 1 + right] for down, right in steps])


def _among(on: NDArray[np.intp], around: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return what is around some of the points, by their own indices."""
    place = np.full(around.shape[1] + 1, len(on))
    place[on] = np.arange(len(on))
    return place[around[:, on]]


def _product(planes: list[Plane]) -> Plane:
    product = planes[0]
    for plane in planes[1:]:
        product = product * plane
    return product
