"""The light of what stands still: a ray a pixel, and more where light differs within it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.base import Moments, Scatter, SparseResponses
from transientcam_simulation.effects import Noise
from transientcam_simulation.light._bundle import Bundle, plane_of
from transientcam_simulation.light._coverage import Plane, covered, crossing
from transientcam_simulation.light._followed import FollowedRays, Within
from transientcam_simulation.light._paths import (
    FAR_M,
    ImageLight,
    hit,
    image_lights,
    scatter_of,
    sparse_image,
)
from transientcam_simulation.light._rays import MOST_RAYS, RAYS, RAYS_AT_EDGES, RAYS_AT_THIN
from transientcam_simulation.light._subpixel import PIXELS, crossed, may_be_thin
from transientcam_simulation.scene import Points, Scene

_DIFFERS_ABOVE = 0.25  # of the noise
_COUNTS_ABOVE = 0.5  # of the noise, what one ray more or less changes


@dataclass(frozen=True, slots=True)
class Sight:
    """Rays of the camera behind so many mirrors.

    ``fills``: (H, W) share of each pixel that the last mirror fills; (1, W) where all are the same.
    ``throughput``: share of the light that the mirrors leave.
    """

    bundle: Bundle
    fills: Plane
    throughput: float


class StillLight:
    """What the pixels of a camera see of a scene that stands still.

    ``scene``: with a camera.
    ``noise``, ``highest_hz``: which differences of light between pixels matter: None if none do,
    and at which frequency.
    ``followed``: rays into the same scene; its own where it shares none.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        width: int,
        height: int,
        noise: Noise | None = None,
        highest_hz: float = 0.0,
        followed: FollowedRays | None = None,
    ) -> None:
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        self.scene = scene
        self.width, self.height = width, height
        self._camera = scene.camera
        self._followed = followed or FollowedRays(scene, width=width, height=height)
        self.rays, self.lit = self._followed.centres, self._followed.lit
        self.mixed, self._rays_a_pixel = np.zeros(0, dtype=np.intp), RAYS
        """Pixels, by index, that are the mean over several rays."""
        if noise is not None:
            thin = self._thinly_crossed()
            scatter, shape = self.lit.scatter(scene), (height, width)
            planes = [self.lit.moments(f, scatter).reshape(shape) for f in (0.0, highest_hz)]
            deviation = noise.deviation(self.lit.weight.sum(axis=0), self.lit.shown).reshape(shape)
            differs = differing(planes, self.lit.surface.reshape(shape), deviation)
            self.mixed = np.flatnonzero(differs | thin)
            if thin.any() and self._holds_thin():
                self._rays_a_pixel = RAYS_AT_THIN
        self._noise, self._highest_hz = noise, highest_hz
        self._phasors: dict[float, tuple[Moments, Moments]] = {}

    @property
    def pixel_rad(self) -> float:
        """Angle of a pixel in the middle of the image."""
        middle = self.height // 2 * self.width + self.width // 2
        return float(np.arccos(np.clip(self.rays[middle] @ self.rays[middle - 1], -1, 1)))

    @cached_property
    def reflectance(self) -> NDArray[np.float32]:
        """(H W) of what the pixels see."""
        reflectance = self.lit.shown.astype(np.float32)
        for each in self.fine:
            reflectance[each.pixel] = each.of_pixels(each.rays.shown).mean(axis=0)
        return reflectance

    @cached_property
    def fine(self) -> tuple[Within, ...]:
        """Light of several rays in each of the pixels ``mixed``; of most where an edge is sharp."""
        found: list[Within] = []
        pixel = self.mixed
        for count in (self._rays_a_pixel, *RAYS_AT_EDGES):
            if not pixel.size:
                break
            planes = len(self.lit.weight) // 2 if self.lit.more else 1
            rays = self._followed.within(pixel, _affordable(count, planes * pixel.size))
            unresolved = np.zeros(pixel.size, dtype=bool)
            if count != RAYS_AT_EDGES[-1]:
                unresolved = self._unresolved(rays)
            if not unresolved.all():
                found.append(rays.part(np.flatnonzero(~unresolved)) if unresolved.any() else rays)
            pixel = pixel[unresolved]
        return tuple(found)

    def _unresolved(self, few: Within) -> NDArray[np.bool_]:
        """Pixels of which an edge cuts off so much light that one ray more or less counts.

        The mean over rays of a lattice is wrong by some half a ray at a straight edge.
        """
        rays, counts = few.rays, len(few.rays.surface) // few.pixel.size
        assert self._noise is not None  # noqa: S101  (or no pixel was mixed)
        surface, ways = few.of_pixels(rays.surface), few.of_pixels(rays.weight > 0)
        edge = (surface != surface[0]).any(axis=0) | (ways != ways[:, :1]).any(axis=(0, 1))
        edge |= bool(self.scene.panes)  # whose edges take some of the light of a way
        brightness = few.of_pixels(rays.weight.sum(axis=0)).mean(axis=0)
        reflectance = few.of_pixels(rays.shown).mean(axis=0)
        limit = _COUNTS_ABOVE * counts * self._noise.deviation(brightness, reflectance)
        scatter, counting = rays.scatter(self.scene), np.zeros(len(edge), dtype=bool)
        for frequency_hz in {0.0, self._highest_hz}:
            moments = few.of_pixels(rays.moments(frequency_hz, scatter))
            counting |= np.abs(moments - moments.mean(axis=0)).max(axis=0) > limit
        unresolved: NDArray[np.bool_] = edge & counting
        return unresolved

    def lit_by(self, chain: int) -> tuple[NDArray[np.bool_], Points]:
        """Return which pixels (H W) a chain of mirrors lights, and a point (H W, 3) that it does.

        Of pixels that it lights in part, one where one of several rays ends.
        """
        on, point = self.lit.weight[chain] > 0, self.lit.point
        if self.fine:
            on, point = on.copy(), point.copy()
        for each in self.fine:
            lit = each.of_pixels(each.rays.weight[chain]) > 0
            more = np.flatnonzero(lit.any(axis=0) & ~on[each.pixel])
            of_ray = lit[:, more].argmax(axis=0) * each.pixel.size + more
            on[each.pixel[more]] = True
            point[each.pixel[more]] = each.rays.point[of_ray]
        return on, point

    def phasors(self, frequency_hz: float) -> tuple[Moments, Moments]:
        """Moments (K, H, W) by chain of mirrors, and (H, W) in all."""
        if frequency_hz not in self._phasors:
            each = self.lit.phasors(frequency_hz, self.lit.scatter(self.scene))
            for fine in self.fine:
                of_rays = fine.rays.phasors(frequency_hz, fine.rays.scatter(self.scene))
                each[:, fine.pixel] = fine.of_pixels(of_rays).mean(axis=1)
            each = each.reshape(-1, self.height, self.width)
            total = each.sum(axis=0)
            self._phasors[frequency_hz] = (
                (each.astype(np.complex64), total.astype(np.complex64))
                if frequency_hz
                else (each.real.astype(np.float32), total.real.astype(np.float32))
            )
        return self._phasors[frequency_hz]

    def moments(self, frequency_hz: float) -> Moments:
        """Moments (H, W) in all."""
        return self.phasors(frequency_hz)[1]

    @cached_property
    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64], Scatter | None]:
        """Delays and weights (K, H W) by chain, and the spread of each.

        Of a pixel that is the mean over several rays, each surface in it has planes of its own.
        """
        lit, scene = self.lit, self.scene
        delay_s, weight = [lit.delay_s], [lit.weight.copy()]
        surfaces = [np.broadcast_to(lit.surfaces, lit.weight.shape)]
        if self.mixed.size:
            weight[0][:, self.mixed] = 0
            present = {int(k) for each in self.fine for k in np.unique(each.rays.surfaces)}
            for surface in sorted(present - {-1}):
                delay_s.append(np.zeros_like(lit.delay_s))
                weight.append(np.zeros_like(lit.weight))
                surfaces.append(np.full(lit.weight.shape, surface))
                for each in self.fine:
                    fine = each.of_pixels(each.rays.weight)
                    mine = np.where(each.of_pixels(each.rays.surfaces) == surface, fine, 0)
                    total = mine.sum(axis=1)
                    late_s = (mine * each.of_pixels(each.rays.delay_s)).sum(axis=1)
                    delay_s[-1][:, each.pixel] = late_s / np.where(total > 0, total, 1)
                    weight[-1][:, each.pixel] = total / fine.shape[1]
        spread = scatter_of(scene, np.concatenate(surfaces))
        return np.concatenate(delay_s), np.concatenate(weight), spread

    def responses(self) -> SparseResponses:
        """Return all returns as an image."""
        delay_s, weight, scatter = self.returns
        return sparse_image(delay_s, weight, scatter, (self.height, self.width))

    def lines_of_sight(self, *, soft: bool) -> list[Sight]:
        """Rays of the camera up to what stands still: before any mirror, then behind mirrors.

        If soft, of a pixel that a mirror fills in part, the ray through its centre counts behind
        the mirror wherever it would meet the mirror's plane.
        """
        shape = self.height, self.width
        surfaces = [each for each in self.scene.surfaces if not each.passes] or self.scene.surfaces
        sights: list[Sight] = []
        eye = self._camera.position_m
        start = np.broadcast_to(eye, self.rays.shape)
        everywhere = np.ones(shape, dtype=np.float32)
        follow = [(0, np.arange(len(self.rays)), eye, start, self.rays, everywhere, 1.0)]
        while follow:
            bounces, index, apex, start, direction, fills, throughput = follow.pop(0)
            ends = start + FAR_M * direction
            hits = np.array([hit(each, start, ends) for each in surfaces] or [ends[:, 0] + np.inf])
            nearest, which = hits.min(axis=0), hits.argmin(axis=0)
            reach_m = np.minimum(nearest, 1.0) * FAR_M
            way, near, far = np.zeros((len(self.rays), 3)), *np.zeros((2, len(self.rays)))
            way[index], near[index] = direction, np.linalg.norm(start - apex, axis=-1)
            far[index] = near[index] + reach_m
            counts = np.zeros(len(self.rays), dtype=bool)
            counts[index] = True
            bundle = Bundle.of(
                apex,
                way.reshape(*shape, 3),
                counts.reshape(shape),
                near=near.reshape(shape),
                far=far.reshape(shape),
            )
            sights.append(Sight(bundle, plane_of(fills, shape), throughput))
            if bounces == self.scene.mirror_bounces:
                continue
            for k in np.unique(which[np.isfinite(nearest)]):
                if surfaces[k].kind != "mirror":
                    continue
                mirror = surfaces[k].mirror
                cross = crossing(mirror, apex, bundle.way)
                shares = [covered(each) for each in cross.inside]
                share = fills * np.minimum.reduce(
                    shares if soft else [each > 0 for each in cross.inside]
                )
                reach = cross.at.ravel()[index]
                on = (share.ravel()[index] > 0) & (direction @ mirror.normal < 0)
                on &= (reach > near[index]) & ((which == k) | (reach < far[index]))
                end = apex + reach[on, None] * direction[on]
                turned = mirror.mirrored_direction(direction[on])
                image_m = mirror.mirrored(apex)
                left = throughput * surfaces[k].reflectivity
                follow.append((bounces + 1, index[on], image_m, end, turned, share, left))
        return sights

    def _holds_thin(self) -> bool:
        """Whether anything is thin in itself, and not only where it shows its side."""
        eye = self._camera.position_m
        return any(
            may_be_thin(each.shape, eye, self.pixel_rad, pixels=PIXELS, aslant=False)
            for each in self.scene.surfaces
            if each.opaque is None
        )

    def _thinly_crossed(self) -> NDArray[np.bool_]:
        """Pixels (H W) that something thin crosses, or its shadow; centres may have missed it."""
        marked = np.zeros((self.height, self.width), dtype=bool)
        scene, eye = self.scene, self._camera.position_m
        lights = tuple(image_lights(scene))
        apexes = [eye, *(apex for light in lights for apex in light.positions_m)]
        thin = [
            each.primitive
            for each in scene.surfaces
            if each.opaque is None  # a stencil's own edge is that of nothing
            and any(may_be_thin(each.shape, apex, self.pixel_rad) for apex in apexes)
        ]
        if not thin:
            return marked.ravel()
        bundles = [(each.bundle, each.bundle.far > 0) for each in self.lines_of_sight(soft=True)]
        on = (self.lit.surface >= 0).reshape(marked.shape)
        for light in lights:
            bundles += [(each, on) for each in segments(light, self.lit.point, on)]
        for bundle, counts in bundles:
            for shape in thin:
                marked |= crossed(shape, bundle, counts)
        return marked.ravel()


def differing(
    planes: list[NDArray[np.complex128]], surface: NDArray[np.intp], noise: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Pixels in which light may differ, (H W): where planes of it do between neighbours.

    By the second difference over three pixels, which even a steep but smooth change hardly has; or
    where the surface changes, since light over further surfaces changes there too.
    """
    limit, differs = _DIFFERS_ABOVE * noise, np.zeros(surface.shape, dtype=bool)
    for axis in (0, 1):
        of, other = np.moveaxis(differs, axis, 0), np.moveaxis(surface, axis, 0)
        step = other[1:] != other[:-1]
        of[1:] |= step
        of[:-1] |= step
        for plane in planes:
            bend = np.abs(np.diff(np.moveaxis(plane, axis, 0), 2, axis=0))
            of[1:-1] |= bend > np.moveaxis(limit, axis, 0)[1:-1]
    return grown(differs).ravel()


def _affordable(count: int, pixels: int) -> int:
    """Return how many rays are followed into each of so many pixels, of so many that would be."""
    while count > RAYS and count * pixels > MOST_RAYS:
        count //= 2
    return count


def grown(marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark the neighbours too, whose corners an edge may cut."""
    more = marked.copy()
    more[1:] |= marked[:-1]
    more[:-1] |= marked[1:]
    more[:, 1:] |= marked[:, :-1]
    more[:, :-1] |= marked[:, 1:]
    return more


def segments(light: ImageLight, point: Points, on: NDArray[np.bool_]) -> list[Bundle]:
    """Return the ways of light by a chain of mirrors to points (H W, 3), one bundle a segment.

    ``on`` (H, W) are the points that count. A segment's line goes on to the light's image in the
    mirrors that are left, and counts from where it begins.
    """
    found: list[Bundle] = []
    start = point

    def add(apex: Points, near: NDArray[np.float32] | np.float32) -> None:
        near = near.reshape(on.shape) if np.ndim(near) else near
        found.append(Bundle.of(apex, (start - apex).reshape(*on.shape, 3), on, near=near, far=1.0))

    for mirror, image_m in zip(light.mirrors, light.positions_m, strict=False):
        fraction = mirror.shape.hit(start, np.broadcast_to(image_m, start.shape))
        fraction = np.where(fraction < 1, fraction, 0.0)
        add(image_m, (1 - fraction).astype(np.float32))
        start = start + fraction[:, None] * (image_m - start)
    add(light.positions_m[-1], np.float32(0))
    return found
