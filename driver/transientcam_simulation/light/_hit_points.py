"""The light on points of surfaces that move, component by component in single precision.

The same as ``paths.light_on_ends``, for the many points that are lit anew for every image.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.compiled import LANES
from transientcam_simulation.light._coverage import (
    TOUCHING,
    Plane,
    axes_of,
    crossing,
    plate_of,
    single,
)
from transientcam_simulation.light._paths import ImageLight, Lit, RayEnds, beam, highlight
from transientcam_simulation.light._shares import Around, among, share_around
from transientcam_simulation.scene import (
    Ellipsoid,
    Points,
    Rectangle,
    Scene,
    Shape,
    Surface,
    blocked_by_mask,
)


@dataclass(frozen=True)
class Segment:
    """Lines from ``apex`` that light comes along to points, at t = 1, from ``near`` on.

    ``mirror`` is the one that the points lie on, if they do; ``boxes`` are the lowest and highest
    coordinates (6, C) of ways from the apex to successive chunks of points, or to all.
    """

    apex: Points
    point: tuple[Plane, Plane, Plane]
    near: Plane
    mirror: Surface | None
    boxes: NDArray[np.float32]

    def of(self, kept: NDArray[np.intp]) -> "Segment":
        """Return the lines of some of the points."""
        x, y, z = (p[kept] for p in self.point)
        boxes = _boxes_from(self.apex, _boxes((x, y, z)))
        return Segment(self.apex, (x, y, z), self.near[kept], self.mirror, boxes)

    @cached_property
    def way(self) -> tuple[Plane, Plane, Plane]:
        """From the apex to the points."""
        return _from(self.apex, self.point)

    @property
    def ends(self) -> tuple[Points, Points]:
        """Points (P, 3) where the light arrives, and where it comes from."""
        way = np.stack(self.way, axis=-1).astype(np.float64)
        return self.apex + way, self.apex + self.near[:, None] * way

    @property
    def box(self) -> tuple[Points, Points]:
        """Lowest and highest coordinates, up to the apex."""
        low, high = self.boxes[:3].min(axis=1), self.boxes[3:].max(axis=1)
        return self.apex + np.minimum(low, 0.0), self.apex + np.maximum(high, 0.0)


_Lines = tuple[Plane, tuple[Plane, Plane, Plane], tuple[Plane, Plane, Plane]]
"""The t where ways to points meet a mirror, the points there, and the points."""


@dataclass(frozen=True, slots=True)
class Way:
    """Light by one chain of mirrors on some points, by index: times of flight, and weights."""

    on: NDArray[np.intp]
    delay_s: NDArray[np.float64]
    weight: NDArray[np.float64]


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
    boxes
        (S, 2, 3) lowest and highest coordinates of all surfaces.
    """

    still: Scene
    surfaces: tuple[Surface, ...]
    index: NDArray[np.int32]
    point: tuple[Plane, Plane, Plane]
    distance_m: Plane
    direction: tuple[Plane, Plane, Plane]
    throughput: NDArray[np.float64]
    boxes: NDArray[np.float64]

    def lit(
        self, lights: tuple[ImageLight, ...], *, movers: tuple[int, ...], around: Around | None
    ) -> "LitEnds":
        """Return the light by each chain of mirrors; on the back of a rectangle there is none.

        ``movers`` are the surfaces that move. They, and mirrors, cover shares of the pixels around
        points, unless it is not known what is ``around`` these.
        """
        normal = self._normals()
        facing, reflectance = self._returned(normal)
        glossy = any(surface.gloss for surface in self.surfaces)
        every, boxes = np.arange(len(self.index)), _boxes(self.point)
        ways: list[tuple[int, Way]] = []
        for k, light in enumerate(lights):
            on, shown, beside, segments = _ways(light, (every, boxes), self.point, around)
            if not on.size:
                continue
            sent = reflectance
            if glossy:
                sent = sent + self._highlight(light, normal, facing)
            length_m, irradiance = self._irradiance(light, normal, on)
            if shown is not None:
                irradiance *= shown
            for mirror in light.mirrors:
                irradiance *= np.float32(mirror.reflectivity)
            index = self.index if len(on) == len(self.index) else self.index[on]
            for segment in segments:
                irradiance *= self._clear(segment, index, movers, beside)
            if len(on) < len(sent) or irradiance.any():
                ways.append((k, self._way(on, length_m, irradiance, sent)))
        return LitEnds(self, reflectance, len(lights), tuple(ways))

    def _returned(
        self, normal: tuple[Plane, Plane, Plane]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Share of light that takes the way to the camera, by mirrors, and by points and mirrors.

        None does from the back of a rectangle.
        """
        albedos = np.array([surface.reflectivity for surface in self.surfaces])
        lane = LANES.find("returned")
        if lane is not None:
            seen = *normal, *self.direction, self.throughput
            facing, reflectance = lane(*seen, albedos, self.index)
            return facing, reflectance
        along = sum(n * d for n, d in zip(normal, self.direction, strict=True))
        facing = np.where(along < 0, self.throughput, 0.0)
        return facing, albedos[self.index] * facing

    def _way(
        self, on: NDArray[np.intp], length_m: Plane, irradiance: Plane, sent: NDArray[np.float64]
    ) -> Way:
        """Return light on some points that all ``sent`` on to the camera."""
        lane = LANES.find("arrived")
        if lane is not None:
            light = length_m, self.distance_m, irradiance
            return Way(on, *lane(*light, on, sent, SPEED_OF_LIGHT_M_S))
        whole_m = length_m.astype(np.float64) + self.distance_m[on]
        return Way(
            on, whole_m / SPEED_OF_LIGHT_M_S, np.multiply(sent[on], irradiance, dtype=np.float64)
        )

    def _highlight(
        self, light: ImageLight, normal: tuple[Plane, ...], facing: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Reflectance of gloss towards the camera."""
        point, direction, up = (
            np.stack(each, axis=-1).astype(np.float64)
            for each in (self.point, self.direction, normal)
        )
        distance_m, index = self.distance_m.astype(np.float64), self.index.astype(np.intp)
        every = np.arange(len(facing))
        ends = RayEnds(every, point, index, distance_m, facing, direction)
        return highlight(self.still, light, ends, up)

    def _irradiance(
        self, light: ImageLight, normal: tuple[Plane, ...], on: NDArray[np.intp]
    ) -> tuple[Plane, Plane]:
        """Length of the ways and irradiance of some points, if nothing is in between."""
        lamp = light.positions_m[0].astype(np.float32)
        axis = light.axis.astype(np.float32)
        lane = LANES.find("received")
        if lane is not None:
            length_m, irradiance, cosine = lane(lamp, axis, *self.point, *normal, on)
        else:
            way = [s - p[on] for s, p in zip(lamp, self.point, strict=True)]
            length_m = np.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
            facing = way[0] * normal[0][on] + way[1] * normal[1][on] + way[2] * normal[2][on]
            irradiance = np.maximum(facing, 0) / (length_m * length_m * length_m)
            cosine = -(way[0] * axis[0] + way[1] * axis[1] + way[2] * axis[2]) / length_m
        if self.still.light.beam_exponent:
            irradiance *= beam(self.still.light, cosine).astype(np.float32, copy=False)
        return single(length_m), single(irradiance)

    def _clear(
        self,
        segment: Segment,
        mine: NDArray[np.int32],
        movers: tuple[int, ...],
        around: Around | None,
    ) -> Plane:
        """Share of the light that all surfaces let through on a segment of its way.

        To points on ``mine``, surfaces by index.
        """
        clear = np.ones(len(mine), dtype=np.float32)
        low, high = segment.box
        near = ((self.boxes[:, 0] <= high) & (self.boxes[:, 1] >= low)).all(axis=1)
        left = np.flatnonzero(near).tolist()
        if around is not None:
            left = self._not_dimmed(segment, left, movers, (mine, around), clear)
        for index in left:
            surface = self.surfaces[index]
            if surface is segment.mirror:
                continue
            if surface.opaque is not None:
                assert isinstance(surface.shape, Rectangle)  # noqa: S101  (stencils are)
                start, end = segment.ends
                clear[blocked_by_mask(surface.shape, surface.opaque, start, end)] = 0
                continue
            soft = around if index in movers else None
            if soft is not None or not _dimmed(surface.shape, segment, (mine, index), clear):
                _dim(surface.shape, segment, mine != index, soft, clear)
        return clear

    def _not_dimmed(
        self,
        segment: Segment,
        near: list[int],
        movers: tuple[int, ...],
        of: tuple[NDArray[np.int32], Around],
        clear: Plane,
    ) -> list[int]:
        """Have a lane do it for all surfaces with soft edges, if it can; return those left.

        The others leave all or nothing, so that their order does not matter.
        """
        index, around = of
        soft = [k for k in near if k in movers and self.surfaces[k] is not segment.mirror]
        axes, lane = axes_of(self.surfaces[k].shape for k in soft), LANES.find("dim_softly")
        if lane is None or len(axes) != len(soft):
            return near
        if soft:
            line = *segment.point, segment.near, TOUCHING, index, around.beside, around.reach[0]
            lane(axes, segment.apex, np.array(soft, np.int32), *line, segment.boxes, clear)
        return [k for k in near if k not in movers]

    def _normals(self) -> tuple[Plane, Plane, Plane]:
        starts = np.append(0, np.flatnonzero(self.index[1:] != self.index[:-1]) + 1)
        shapes = [self.surfaces[self.index[start]].shape for start in starts]
        lane = LANES.find("upright")
        balls = [(*each.centre, *each.radii**2) for each in shapes if isinstance(each, Ellipsoid)]
        if lane is not None and len(balls) == len(shapes):
            ends = np.append(starts, len(self.index))
            across, along, up = lane(*self.point, np.array(balls, dtype=np.float32), ends)
            return across, along, up
        normals = tuple(np.empty_like(self.distance_m) for _ in range(3))
        for start, stop in zip(starts, [*starts[1:], len(self.index)], strict=True):
            shape, mine = self.surfaces[self.index[start]].shape, slice(int(start), int(stop))
            for k, plane in enumerate(normals):
                if isinstance(shape, Ellipsoid):
                    centre, squared = np.float32(shape.centre[k]), np.float32(shape.radii[k] ** 2)
                    plane[mine] = (self.point[k][mine] - centre) / squared
                else:
                    plane[mine] = shape.normal[k]
        x, y, z = normals
        length = np.sqrt(x * x + y * y + z * z)
        return single(x / length), single(y / length), single(z / length)


@dataclass(frozen=True, slots=True)
class LitEnds:
    """Points in light by some of so many chains of mirrors, each with its index."""

    ends: Ends
    reflectance: NDArray[np.float64]
    chains: int
    ways: tuple[tuple[int, Way], ...]

    def all(self) -> Lit:
        """Return the light by all chains."""
        delay_s, weight = np.zeros((2, self.chains, len(self.reflectance)))
        for k, way in self.ways:
            delay_s[k, way.on], weight[k, way.on] = way.delay_s, way.weight
        ends = self.ends
        return Lit(
            ends.index.astype(np.intp),
            np.stack(ends.point, axis=-1).astype(np.float64),
            ends.distance_m.astype(np.float64),
            self.reflectance,
            delay_s,
            weight,
        )


def _dim(
    shape: Shape,
    segment: Segment,
    others: NDArray[np.bool_],
    around: Around | None,
    clear: Plane,
) -> None:
    """Take what a shape blocks on a segment from the light of points on other surfaces."""
    cross = crossing(shape, segment.apex, segment.way)
    between = cross.between(segment.near, np.float32(1)) & others
    met = between & (np.minimum.reduce(cross.inside) > 0)
    if not met.any():
        return
    # a point inside a surface stands for those beside it that are seen in its pixel
    clear *= 1 - share_around(cross, between & ~cross.holds(1.0), around)


def _dimmed(
    shape: Shape, segment: Segment, of: tuple[NDArray[np.int32], int], clear: Plane
) -> bool:
    """Do the same at hard edges by a lane; ``of`` are the points' surfaces and the shape's."""
    lane = LANES.find("dim_behind")
    if lane is None or not isinstance(shape, Rectangle):
        return False
    line = *segment.point, segment.near, TOUCHING, *of
    lane(plate_of(shape, segment.apex), segment.apex.astype(np.float32), *line, clear)
    return True


def _ways(
    light: ImageLight,
    every: tuple[NDArray[np.intp], NDArray[np.float32]],
    point: tuple[Plane, Plane, Plane],
    around: Around | None,
) -> tuple[NDArray[np.intp], Plane | None, Around | None, list[Segment]]:
    """Return the points that a chain of mirrors shows the light to, and its ways to them.

    Between the two, the share of the pixel around each point to which it does (None: all), and
    what is around. ``every``: all points, and boxes around chunks of them.
    """
    on, boxes = every
    share: Plane | None = None
    segments: list[Segment] = []
    start, last = point, None
    for mirror, image_m in zip(light.mirrors, light.positions_m, strict=False):
        kept, part, (at, met, ends) = _shown(mirror.mirror, image_m, start, around)
        if not kept.size:
            return kept, part, around, []
        if len(kept) < len(on):  # mostly few points, or all
            on = on[kept] if segments else kept
            share = None if share is None else share[kept]
            around = around if around is None else among(kept, around)
            segments = [each.of(kept) for each in segments]
            start = ends
            boxes = _boxes(start)
        share = part if share is None else share * part
        segments.append(Segment(image_m, start, at, last, _boxes_from(image_m, boxes)))
        start, boxes = met, _boxes(met)
        last = mirror
    lamp = light.positions_m[-1]
    none = np.zeros(len(on), dtype=np.float32)
    straight = Segment(lamp, start, none, last, _boxes_from(lamp, boxes))
    return on, share, around, [*segments, straight]


def _shown(
    mirror: Rectangle,
    image_m: Points,
    point: tuple[Plane, Plane, Plane],
    around: Around | None,
) -> tuple[NDArray[np.intp], Plane, _Lines]:
    """Return the points that a mirror shows the light to, its shares of their pixels, and lines."""
    lane = LANES.find("shown")
    if lane is not None and around is not None:
        apex = image_m.astype(np.float32)
        beside = around.beside, *around.reach
        kept, share, lines = lane(plate_of(mirror, image_m), apex, *point, TOUCHING, *beside)
        ends = (lines[4], lines[5], lines[6]) if len(lines) > 4 else point
        return kept, share, (lines[0], (lines[1], lines[2], lines[3]), ends)
    way = _from(image_m, point)
    cross = crossing(mirror, image_m, way)
    shows = cross.between(np.float32(0), np.float32(1))
    shows &= sum(w * np.float32(n) for w, n in zip(way, mirror.normal, strict=True)) > 0
    if not (shows & (np.minimum.reduce(cross.inside) > 0)).any():
        shows[:] = False
    share = share_around(cross, shows, around)
    kept = np.flatnonzero(share)
    x, y, z, at = (each[kept] for each in (*way, cross.at))
    ends = point[0][kept], point[1][kept], point[2][kept]
    return kept, share[kept], (at, _moved(image_m, (x * at, y * at, z * at)), ends)


def _from(apex: Points, point: tuple[Plane, ...]) -> tuple[Plane, Plane, Plane]:
    x, y, z = (p - np.float32(a) for p, a in zip(point, apex, strict=True))
    return x, y, z


def _boxes(points: tuple[Plane, Plane, Plane]) -> NDArray[np.float32]:
    """Lowest and highest coordinates (6, C) of successive chunks of points, or of all."""
    lane = LANES.find("boxes")
    if lane is None:
        ends = *(each.min() for each in points), *(each.max() for each in points)
        return np.array(ends, dtype=np.float32)[:, None]
    boxes: NDArray[np.float32] = lane(*points)
    return boxes


def _boxes_from(apex: Points, boxes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the boxes of the ways from an apex to points, given those of the points."""
    corners = boxes.reshape(2, 3, -1) - apex.astype(np.float32)[:, None]
    return corners.reshape(6, -1)


def _moved(apex: Points, way: tuple[Plane, ...]) -> tuple[Plane, Plane, Plane]:
    x, y, z = (w + np.float32(a) for w, a in zip(way, apex, strict=True))
    return x, y, z
