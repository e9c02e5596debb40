"""The light on points of surfaces that move, component by component in single precision.

The same as ``paths.light_on_ends``, for the many points that are lit anew for every image.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.light import (
    _compiled_chunks as compiled_chunks,
    _compiled_light as compiled_light,
    _compiled_mirrors as compiled_mirrors,
    _compiled_point_shadows as compiled_point_shadows,
)
from transientcam_simulation.light._coverage import Plane, plate_of
from transientcam_simulation.light._paths import ImageLight, Lit, RayEnds, beam, highlight
from transientcam_simulation.light._shares import Around, alone, axes_of
from transientcam_simulation.scene import (
    Ellipsoid,
    Mesh,
    Points,
    Rectangle,
    Scene,
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
        boxes = _boxes_from(self.apex, compiled_chunks.boxes(x, y, z))
        return Segment(self.apex, (x, y, z), self.near[kept], self.mirror, boxes)

    @property
    def ends(self) -> tuple[Points, Points]:
        """Points (P, 3) where the light arrives, and where it comes from."""
        ways = [p - np.float32(a) for p, a in zip(self.point, self.apex, strict=True)]
        way = np.stack(ways, axis=-1).astype(np.float64)
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

    ``surfaces``, ``index``: all surfaces, and which one each point lies on; points of one follow
    each other.
    ``point``: components of the points.
    ``distance_m``: from the camera.
    ``direction``: components of the unit vectors along which rays of the camera arrive.
    ``throughput``: share of light that mirrors leave on its way to the camera.
    ``boxes``: (S, 2, 3) lowest and highest coordinates of all surfaces.
    """

    scene: Scene
    surfaces: tuple[Surface, ...]
    index: NDArray[np.int32]
    point: tuple[Plane, Plane, Plane]
    distance_m: Plane
    direction: tuple[Plane, Plane, Plane]
    throughput: NDArray[np.float64]
    boxes: NDArray[np.float64]

    def lit(
        self, lights: tuple[ImageLight, ...], *, movers: tuple[int, ...], around: Around
    ) -> "LitEnds":
        """Return the light by each chain of mirrors; on the back of a rectangle there is none.

        ``movers`` are the surfaces that move. They, and mirrors, cover shares of the pixels around
        points, by what is ``around`` these.
        """
        normal = self._normals()
        facing, reflectance = self._returned(normal)
        glossy = any(surface.gloss for surface in self.surfaces)
        every, boxes = np.arange(len(self.index)), compiled_chunks.boxes(*self.point)
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
        seen = *normal, *self.direction, self.throughput
        return compiled_light.returned(*seen, albedos, self.index)

    def _way(
        self, on: NDArray[np.intp], length_m: Plane, irradiance: Plane, sent: NDArray[np.float64]
    ) -> Way:
        """Return light on some points that all ``sent`` on to the camera."""
        light = length_m, self.distance_m, irradiance
        return Way(on, *compiled_light.arrived(*light, on, sent, SPEED_OF_LIGHT_M_S))

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
        albedo = np.array([surface.reflectivity for surface in self.surfaces])[index]
        ends = RayEnds(every, point, index, distance_m, facing, direction, up, albedo)
        return highlight(self.scene, light, ends)

    def _irradiance(
        self, light: ImageLight, normal: tuple[Plane, Plane, Plane], on: NDArray[np.intp]
    ) -> tuple[Plane, Plane]:
        """Length of the ways and irradiance of some points, if nothing is in between."""
        lamp = light.positions_m[0].astype(np.float32)
        axis = light.axis.astype(np.float32)
        ways = lamp, axis, *self.point, *normal, on
        length_m, irradiance, cosine = compiled_light.received(*ways)
        if self.scene.light.beam_exponent:
            irradiance *= beam(self.scene.light, cosine).astype(np.float32, copy=False)
        return length_m, irradiance

    def _clear(
        self, segment: Segment, mine: NDArray[np.int32], movers: tuple[int, ...], around: Around
    ) -> Plane:
        """Share of the light that all surfaces let through on a segment of its way.

        To points on ``mine``, surfaces by index.
        """
        clear = np.ones(len(mine), dtype=np.float32)
        low, high = segment.box
        near = ((self.boxes[:, 0] <= high) & (self.boxes[:, 1] >= low)).all(axis=1)
        of = segment, mine, clear
        left = [k for k in np.flatnonzero(near).tolist() if self.surfaces[k] is not segment.mirror]
        balls = [k for k in left if isinstance(self.surfaces[k].shape, Ellipsoid)]
        self._dim_behind_ellipsoids([k for k in balls if k in movers], *of, around)
        if still := [k for k in balls if k not in movers]:
            self._dim_behind_ellipsoids(still, *of, alone(len(mine)))
        for index in left:
            surface = self.surfaces[index]
            if surface.opaque is not None:
                clear[blocked_by_mask(surface.mirror, surface.opaque, *segment.ends)] = 0
            elif isinstance(surface.shape, Mesh):
                clear[surface.shape.hit(*segment.ends) < 1] = 0
            elif isinstance(surface.shape, Rectangle):
                soft = around if index in movers else None
                _dim_behind_rectangle(surface.shape, index, *of, soft)
        return clear

    def _dim_behind_ellipsoids(
        self,
        indices: list[int],
        segment: Segment,
        mine: NDArray[np.int32],
        clear: Plane,
        around: Around,
    ) -> None:
        """Take what surfaces cover of the pixels around points on others from their light."""
        if indices:
            axes = axes_of(self.surfaces[k].primitive for k in indices)
            points = *segment.point, segment.near, mine, around.beside, around.reach[0]
            compiled_point_shadows.dim_behind_ellipsoids(
                axes, segment.apex, np.array(indices, np.int32), *points, segment.boxes, clear
            )

    def _normals(self) -> tuple[Plane, Plane, Plane]:
        starts = np.append(0, np.flatnonzero(self.index[1:] != self.index[:-1]) + 1)
        spans = np.stack([starts, np.append(starts[1:], len(self.index))], axis=1)
        shapes = [self.surfaces[self.index[start]].shape for start in starts]
        balls = [(*each.centre, *each.radii**2) for each in shapes if isinstance(each, Ellipsoid)]
        is_round = [isinstance(each, Ellipsoid) for each in shapes]
        normals = compiled_light.upright(
            *self.point, np.array(balls, dtype=np.float32).reshape(-1, 6), spans[is_round]
        )
        for (start, stop), shape in zip(spans, shapes, strict=True):
            if isinstance(shape, Rectangle):
                x, y, z = normal = shape.normal.astype(np.float32)
                normals[:, start:stop] = (normal / np.sqrt(x * x + y * y + z * z))[:, None]
        return normals[0], normals[1], normals[2]


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


def _dim_behind_rectangle(
    shape: Rectangle,
    index: int,
    segment: Segment,
    mine: NDArray[np.int32],
    clear: Plane,
    around: Around | None,
) -> None:
    """Take what a surface covers on a segment from the light of points on ``mine``, others.

    Of the pixels around them, where it is known what is ``around``.
    """
    plate, apex = plate_of(shape, segment.apex), segment.apex.astype(np.float32)
    line = plate, apex, *segment.point, segment.near, mine, index
    if around is None:
        compiled_point_shadows.dim_behind_rectangle(*line, clear)
    else:
        compiled_point_shadows.dim_softly_behind_rectangle(*line, around.beside, clear)


def _ways(
    light: ImageLight,
    every: tuple[NDArray[np.intp], NDArray[np.float32]],
    point: tuple[Plane, Plane, Plane],
    around: Around,
) -> tuple[NDArray[np.intp], Plane | None, Around, list[Segment]]:
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
            around = around.among(kept)
            segments = [each.of(kept) for each in segments]
            start = ends
            boxes = compiled_chunks.boxes(*start)
        share = part if share is None else share * part
        segments.append(Segment(image_m, start, at, last, _boxes_from(image_m, boxes)))
        start, boxes = met, compiled_chunks.boxes(*met)
        last = mirror
    lamp = light.positions_m[-1]
    none = np.zeros(len(on), dtype=np.float32)
    straight = Segment(lamp, start, none, last, _boxes_from(lamp, boxes))
    return on, share, around, [*segments, straight]


def _shown(
    mirror: Rectangle, image_m: Points, point: tuple[Plane, Plane, Plane], around: Around
) -> tuple[NDArray[np.intp], Plane, _Lines]:
    """Return the points that a mirror shows the light to, its shares of their pixels, and lines."""
    plate, apex = plate_of(mirror, image_m), image_m.astype(np.float32)
    kept, share, lines = compiled_mirrors.shown(plate, apex, *point, around.beside, *around.reach)
    ends = (lines[4], lines[5], lines[6]) if len(lines) > 4 else point
    return kept, share, (lines[0], (lines[1], lines[2], lines[3]), ends)


def _boxes_from(apex: Points, boxes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the boxes of the ways from an apex to points, given those of the points."""
    corners = boxes.reshape(2, 3, -1) - apex.astype(np.float32)[:, None]
    return corners.reshape(6, -1)
