"""Light in a scene some of whose surfaces move.

What stands still is traced once. At each time only what the moving surfaces change is computed: the
pixels that show one of them, by the share of the pixel that it covers, and the ways of light that
it blocks. Everything follows the device's time without steps.
"""

from dataclasses import dataclass, replace

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
    crossing,
    overlapped,
)
from transientcam_driver.simulation.light.ends import Ends
from transientcam_driver.simulation.light.layers import Layer, MovingResponses, Shadow
from transientcam_driver.simulation.light.paths import ImageLight, image_lights, light_rays
from transientcam_driver.simulation.light.still import StillLight, grown
from transientcam_driver.simulation.scene.geometry import Points
from transientcam_driver.simulation.scene.scene import Scene

_RAYS_IN_MIRRORS = 16  # into pixels that show something that moves in a mirror
_TINY = np.float32(1e-9)
_AWAY = np.array([0.0, 0.0, -1e6])  # where surfaces that move are put while the rest is traced


@dataclass(frozen=True, slots=True)
class _Seen:
    """A surface that moves, where the camera sees it: shares (h, w) of the pixels of a region."""

    index: int
    region: Region
    share: Plane
    at_m: Plane


@dataclass(frozen=True, slots=True)
class _Grid:
    """Where points lie in a region of the image of so many rows and columns."""

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    shape: tuple[int, int]

    def plane(self, on: NDArray[np.intp], values: Plane, there: NDArray[np.bool_]) -> Plane:
        """Return values of some points as a plane; NaN is where there are none."""
        plane = np.full(self.shape, np.nan, dtype=np.float32)
        plane[self.rows[on], self.columns[on]] = np.where(there, values, np.nan)
        return plane


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
        self._sight, *self._mirrored = still.lines_of_sight()
        self._chains = tuple(
            tuple(self._light_segments(k, light)) for k, light in enumerate(self._lights)
        )

    def at(self, time_s: float) -> MovingResponses:
        """Impulse responses at a time."""
        scene = self.scene.at(time_s)
        seen = self._visible([each for k in self._movers if (each := self._cover(scene, k))])
        layers = self._lit(scene, seen) if seen else []
        if mirrored := self._seen_in_mirrors(scene):
            layers.append(mirrored)
        shadows = [shadow for k in range(len(self._chains)) if (shadow := self._shadow(scene, k))]
        region = union([*(each.region for each in layers), *(each.region for each in shadows)])
        return MovingResponses(self.still, scene, tuple(layers), tuple(shadows), region)

    def _cover(self, scene: Scene, index: int) -> _Seen | None:
        """Shares of pixels that a surface covers, where nothing that stands still is before it."""
        shape = scene.surfaces[index].shape
        region = self._sight.meeting(shape)
        if region is None:
            return None
        way, _near, far = self._sight.within(region)
        cross = crossing(shape, self._sight.apex, way)
        share, root = self._share(cross, rooted=True)
        at_m = cross.entered(root)
        share[~((at_m > 0) & (at_m < far))] = 0
        return _Seen(index, region, share, at_m) if share.any() else None

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
        """Take from each share what nearer surfaces that move cover of it."""
        left = [each.share.copy() for each in seen]
        for k, one in enumerate(seen):
            for other, share in zip(seen[k + 1 :], left[k + 1 :], strict=True):
                both = overlap(one.region, other.region)
                if both is None:
                    continue
                mine, its = inside(both, one.region), inside(both, other.region)
                hidden = overlapped(one.share[mine], other.share[its])
                nearer = self._above(other.at_m[its] - one.at_m[mine])
                share[its] *= 1 - nearer * hidden / np.maximum(other.share[its], _TINY)
                left[k][mine] *= 1 - (1 - nearer) * hidden / np.maximum(one.share[mine], _TINY)
        return [replace(each, share=share) for each, share in zip(seen, left, strict=True)]

    def _lit(self, scene: Scene, seen: list[_Seen]) -> list[Layer]:
        """Light the parts of surfaces that are seen, all at once."""
        region = union([each.region for each in seen])
        places = [np.nonzero(each.share) for each in seen]
        rows, columns = (
            np.concatenate(
                [
                    place[axis] + each.region[axis].start
                    for each, place in zip(seen, places, strict=True)
                ]
            )
            for axis in (0, 1)
        )
        owner = np.repeat([each.index for each in seen], [len(place[0]) for place in places])
        found = list(zip(seen, places, strict=True))
        at_m = np.concatenate([each.at_m[place] for each, place in found])
        share = np.concatenate([each.share[place] for each, place in found])
        x, y, z = (
            way[rows, columns] * at_m + np.float32(start)
            for way, start in zip(self._sight.way, self._sight.apex, strict=True)
        )
        grid = _Grid(rows - region[0].start, columns - region[1].start, extent(region))

        def cover(cross: Crossing, on: NDArray[np.intp], counts: NDArray[np.bool_]) -> Plane:
            planes = tuple(grid.plane(on, each, counts) for each in cross.inside)
            share = self._share(replace(cross, inside=planes))[0]
            of_points: Plane = share[grid.rows[on], grid.columns[on]] * counts
            return of_points

        lit = Ends(self.still.scene, scene.surfaces, owner, (x, y, z), at_m).lit(
            self._lights, eye=self._sight.apex, movers=self._movers, cover=cover
        )
        pixel = rows * self.still.width + columns
        ends = np.cumsum([len(place[0]) for place in places])
        parts = [
            slice(int(start), int(end)) for start, end in zip([0, *ends[:-1]], ends, strict=True)
        ]
        return [
            Layer(each.region, pixel[of], share[of], lit.part(of))
            for each, of in zip(seen, parts, strict=True)
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
            left[inside(region, whole)] *= 1 - share
        return Shadow(chain, whole, left)

    def _seen_in_mirrors(self, scene: Scene) -> Layer | None:
        """Follow several rays a pixel that meet something that moves behind a mirror."""
        over = np.zeros((self.still.height, self.still.width), dtype=bool)
        for bundle in self._mirrored:
            for index in self._movers:
                shape = scene.surfaces[index].shape
                region = bundle.meeting(shape)
                if region is not None:
                    way, near, far = bundle.within(region)
                    cross = crossing(shape, bundle.apex, way)
                    over[region] |= (self._share(cross)[0] > 0) & cross.between(near, far)
        mixed = np.zeros_like(over)
        mixed.ravel()[self.still.mixed] = True
        over |= grown(over) & mixed  # pixels that a mirror fills in part
        pixel = np.flatnonzero(over)
        if not pixel.size:
            return None
        rays = self.still.rays_in(pixel, _RAYS_IN_MIRRORS) if self._soft else self.still.rays[pixel]
        rows, columns = np.nonzero(over)
        region = (
            slice(int(rows.min()), int(rows.max()) + 1),
            slice(int(columns.min()), int(columns.max()) + 1),
        )
        share = np.ones(len(pixel), dtype=np.float32)
        return Layer(region, pixel, share, light_rays(scene, rays), last=True)

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


def _product(planes: list[Plane]) -> Plane:
    product = planes[0]
    for plane in planes[1:]:
        product = product * plane
    return product
