"""The light on points of surfaces that move, component by component in single precision.

The same as ``paths.light_on_ends``, for the many points that are lit anew for every image.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_driver.simulation.light.coverage import Crossing, Plane, crossing, single
from transientcam_driver.simulation.light.paths import ImageLight, Lit, RayEnds, beam, highlight
from transientcam_driver.simulation.scene.geometry import (
    Ellipsoid,
    Points,
    Rectangle,
    blocked_by_mask,
)
from transientcam_driver.simulation.scene.scene import Scene, Surface

Cover = Callable[[Crossing, NDArray[np.intp], NDArray[np.bool_]], Plane]
"""Share of the pixels around some points that a crossing covers, where it counts."""


@dataclass(frozen=True, slots=True)
class Segment:
    """Lines ``apex + t way`` that light comes along to points at t = 1, from ``near`` on.

    ``mirror`` is the one that the points lie on, if they do.
    """

    apex: Points
    way: tuple[Plane, Plane, Plane]
    near: Plane | np.float32
    mirror: Surface | None

    def of(self, kept: NDArray[np.intp]) -> "Segment":
        """Return the lines of some of the points."""
        x, y, z = (w[kept] for w in self.way)
        near = self.near[kept] if isinstance(self.near, np.ndarray) else self.near
        return Segment(self.apex, (x, y, z), near, self.mirror)

    @property
    def ends(self) -> tuple[Points, Points]:
        """Points (P, 3) where the light arrives, and where it comes from."""
        way = np.stack(self.way, axis=-1).astype(np.float64)
        near = np.broadcast_to(np.asarray(self.near, dtype=np.float64), len(way))[:, None]
        return self.apex + way, self.apex + near * way

    @property
    def box(self) -> tuple[Points, Points]:
        """Lowest and highest coordinates, up to the apex."""
        low = np.array([min(float(w.min()), 0.0) for w in self.way])
        high = np.array([max(float(w.max()), 0.0) for w in self.way])
        return self.apex + low, self.apex + high


@dataclass(frozen=True, slots=True)
class Ends:
    """Points on surfaces that rays of the camera end on.

    Attributes
    ----------
    still
        What stands still, for its light.
    surfaces, index
        All surfaces, and which one each point lies on; points of one follow each other.
    point
        Components of the points.
    distance_m
        From the camera.
    direction
        Components of the unit vectors along which rays of the camera arrive.
    throughput
        Share of light that mirrors leave on its way to the camera.
    """

    still: Scene
    surfaces: tuple[Surface, ...]
    index: NDArray[np.intp]
    point: tuple[Plane, Plane, Plane]
    distance_m: Plane
    direction: tuple[Plane, Plane, Plane]
    throughput: NDArray[np.float64]

    def lit(self, lights: tuple[ImageLight, ...], *, movers: tuple[int, ...], cover: Cover) -> Lit:
        """Return the light by each chain of mirrors; on the back of a rectangle there is none.

        ``movers`` are the surfaces that move, and ``cover`` says which share of the pixels around
        some points they cover.
        """
        count = len(self.distance_m)
        normal = self._normals()
        along = sum(n * d for n, d in zip(normal, self.direction, strict=True))
        facing = np.where(along < 0, self.throughput, 0.0)
        albedo = np.array([surface.reflectivity for surface in self.surfaces])
        lit = Lit(
            self.index,
            np.stack(self.point, axis=-1).astype(np.float64),
            self.distance_m.astype(np.float64),
            albedo[self.index] * facing,
            np.zeros((len(lights), count)),
            np.zeros((len(lights), count)),
        )
        glossy = any(surface.gloss for surface in self.surfaces)
        for k, light in enumerate(lights):
            sent = lit.reflectance
            if glossy:
                direction = np.stack(self.direction, axis=-1).astype(np.float64)
                ends = RayEnds(
                    np.arange(count), lit.point, self.index, lit.distance_m, facing, direction
                )
                sent = sent + highlight(
                    self.still, light, ends, np.stack(normal, axis=-1).astype(np.float64)
                )
            on, shown, segments = _ways(light, self.point, cover)
            if not on.size:
                continue
            length_m, irradiance = self._irradiance(light, normal, on)
            irradiance *= shown
            for mirror in light.mirrors:
                irradiance *= np.float32(mirror.reflectivity)
            for segment in segments:
                irradiance *= self._clear(segment, on, movers, cover)
            lit.delay_s[k, on] = (length_m + lit.distance_m[on]) / SPEED_OF_LIGHT_M_S
            lit.weight[k, on] = irradiance * sent[on]
        return lit

    def _irradiance(
        self, light: ImageLight, normal: tuple[Plane, ...], on: NDArray[np.intp]
    ) -> tuple[Plane, Plane]:
        """Length of the ways and irradiance of some points, if nothing is in between."""
        lamp = light.positions_m[0]
        way = [np.float32(s) - p[on] for s, p in zip(lamp, self.point, strict=True)]
        length_m = np.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
        cosine = way[0] * normal[0][on] + way[1] * normal[1][on] + way[2] * normal[2][on]
        irradiance = np.maximum(cosine, 0) / (length_m * length_m * length_m)
        if self.still.light.beam_exponent:
            along = -sum(w * np.float32(a) for w, a in zip(way, light.axis, strict=True))
            irradiance *= beam(self.still.light, along / length_m).astype(np.float32)
        return single(length_m), single(irradiance)

    def _clear(
        self, segment: Segment, on: NDArray[np.intp], movers: tuple[int, ...], cover: Cover
    ) -> Plane:
        """Share of the light that all surfaces let through on a segment of its way."""
        clear = np.ones(len(on), dtype=np.float32)
        low, high = segment.box
        for index, surface in enumerate(self.surfaces):
            shape = surface.shape
            least, most = shape.box
            if (most < low).any() or (least > high).any() or surface is segment.mirror:
                continue
            if surface.opaque is not None:
                assert isinstance(shape, Rectangle)  # noqa: S101  (stencils are)
                start, end = segment.ends
                clear[blocked_by_mask(shape, surface.opaque, start, end)] = 0
                continue
            cross = crossing(shape, segment.apex, segment.way)
            between = cross.between(segment.near, np.float32(1)) & (self.index[on] != index)
            met = between & (np.minimum.reduce(cross.inside) > 0)
            if not met.any():
                continue
            # a point inside a surface stands for those beside it that are seen in its pixel
            outside = ~cross.holds(1.0)
            between, met = between & outside, met & outside
            clear *= 1 - (cover(cross, on, between) if index in movers else met)
        return clear

    def _normals(self) -> tuple[Plane, Plane, Plane]:
        normals = tuple(np.empty_like(self.distance_m) for _ in range(3))
        starts = np.flatnonzero(np.diff(self.index, prepend=-1))
        for start, stop in zip(starts, [*starts[1:], len(self.index)], strict=True):
            shape = self.surfaces[self.index[start]].shape
            mine = slice(int(start), int(stop))
            for k, plane in enumerate(normals):
                if isinstance(shape, Ellipsoid):
                    centre, squared = np.float32(shape.centre[k]), np.float32(shape.radii[k] ** 2)
                    plane[mine] = (self.point[k][mine] - centre) / squared
                else:
                    plane[mine] = shape.normal[k]
        x, y, z = normals
        length = np.sqrt(x * x + y * y + z * z)
        return single(x / length), single(y / length), single(z / length)


def _ways(
    light: ImageLight, point: tuple[Plane, Plane, Plane], cover: Cover
) -> tuple[NDArray[np.intp], Plane, list[Segment]]:
    """Return the points that a chain of mirrors shows the light to, and its ways to them.

    The second is the share of the pixel around each point to which it does.
    """
    on = np.arange(len(point[0]))
    shown = np.ones(len(on), dtype=np.float32)
    segments: list[Segment] = []
    start, last = point, None
    for mirror, image_m in zip(light.mirrors, light.positions_m, strict=False):
        way = _from(image_m, start)
        cross = crossing(mirror.shape, image_m, way)
        shows = cross.between(np.float32(0), np.float32(1))
        shows &= sum(w * np.float32(n) for w, n in zip(way, mirror.mirror.normal, strict=True)) > 0
        if not (shows & (np.minimum.reduce(cross.inside) > 0)).any():
            return on[:0], shown[:0], []
        shown = shown * cover(cross, on, shows)
        kept = np.flatnonzero(shown)
        on, shown = on[kept], shown[kept]
        segments = [each.of(kept) for each in segments]
        x, y, z = (w[kept] for w in way)
        at = cross.at[kept]
        segments.append(Segment(image_m, (x, y, z), at, last))
        start = _moved(image_m, (x * at, y * at, z * at))
        last = mirror
    lamp = light.positions_m[-1]
    return on, shown, [*segments, Segment(lamp, _from(lamp, start), np.float32(0), last)]


def _from(apex: Points, point: tuple[Plane, ...]) -> tuple[Plane, Plane, Plane]:
    x, y, z = (p - np.float32(a) for p, a in zip(point, apex, strict=True))
    return x, y, z


def _moved(apex: Points, way: tuple[Plane, ...]) -> tuple[Plane, Plane, Plane]:
    x, y, z = (w + np.float32(a) for w, a in zip(way, apex, strict=True))
    return x, y, z
