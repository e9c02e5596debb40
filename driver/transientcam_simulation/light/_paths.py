"""Light transport: from surfaces, mirrors and stencils to the light that each pixel sees.

A planar mirror is handled by image points: light that reaches a wall by mirrors M1, ..., Mk comes
straight from the source reflected in M1, then in M2, and so on, as far as each mirror is hit
within its rectangle and nothing stands in between.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from transientcam_compiled import cores
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.base import Scatter, SparseResponses, ask
from transientcam_simulation.scene import (
    Light,
    Mesh,
    Points,
    Rectangle,
    Scene,
    Surface,
    Viewpoint,
    blocked_by_mask,
)

_BLOCK = 16384  # rays at a time, so that what is computed for them stays in the cache
_NOWHERE_M = 1e-12
FAR_M = 1e3  # longer than any path in a scene
_MOST_ENDS = 8  # of a ray that panes part, the brightest; one pane makes three at most
_BESIDE = 1.5  # sizes of a mirror, up to which pixels at its edge may see beside it


@dataclass(frozen=True, slots=True)
class RayEnds:
    """The scattering points on which rays of the camera end, flat; several of one that panes part.

    ``ray`` is its index, ``direction`` the way it comes along, ``throughput`` the share of light
    left by mirrors and panes on the way; ``normal`` and ``albedo`` are those at the points.
    """

    ray: NDArray[np.intp]
    point: Points
    surface: NDArray[np.intp]
    distance_m: NDArray[np.float64]
    throughput: NDArray[np.float64]
    direction: Points
    normal: Points
    albedo: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ImageLight:
    """The light source as it appears in a chain of mirrors, the last one first."""

    mirrors: tuple[Surface, ...]
    positions_m: tuple[Points, ...]
    axis: Points


@dataclass(frozen=True, slots=True)
class Lit:
    """The light that rays of the camera see, one entry a ray, flat.

    ``surface``: (P) index of the surface a ray ends on, -1 for none.
    ``point``: (P, 3) where it ends.
    ``distance_m``: (P) its length.
    ``reflectance``: (P) share of the light on its end that it takes to the camera: albedo times
    mirrors.
    ``delay_s``, ``weight``: (K, P) whole time of flight and brightness by each chain of mirrors,
    for one end of the rays after the other where panes part them; ``more`` are the further ends.
    """

    surface: NDArray[np.intp]
    point: Points
    distance_m: NDArray[np.float64]
    reflectance: NDArray[np.float64]
    delay_s: NDArray[np.float64]
    weight: NDArray[np.float64]
    more: "tuple[Lit, ...]" = ()

    @property
    def surfaces(self) -> NDArray[np.intp]:
        """Index of the surface that light comes from, (P), or (K, P) where rays have more ends."""
        if not self.more:
            return self.surface
        ends = np.stack([self.surface, *(each.surface for each in self.more)])
        return np.repeat(ends, len(self.weight) // len(ends), axis=0)

    @property
    def shown(self) -> NDArray[np.float64]:
        """Reflectance (P) of all ends of each ray together."""
        return sum((each.reflectance for each in self.more), start=self.reflectance)

    def moments(self, frequency_hz: float, scatter: Scatter | None) -> NDArray[np.complex128]:
        """``int g(tau) exp(2 pi i f tau) dtau`` of each ray (P), over all chains of mirrors."""
        moments: NDArray[np.complex128] = self.phasors(frequency_hz, scatter).sum(axis=0)
        return moments

    def phasors(self, frequency_hz: float, scatter: Scatter | None) -> NDArray[np.complex128]:
        """Terms of ``moments``, (K, P) by chain of mirrors."""
        phasors = self.weight.astype(np.complex128)
        if frequency_hz:
            for phasor, delay_s in zip(phasors, self.delay_s, strict=True):
                if phasor.any():
                    phasor *= np.exp(2j * np.pi * frequency_hz * delay_s)
            if scatter is not None:
                phasors *= scatter.transfer(frequency_hz)
        return phasors

    def part(self, of: slice | NDArray[np.intp]) -> "Lit":
        """Return the light of some of the rays."""
        return Lit(
            self.surface[of],
            self.point[of],
            self.distance_m[of],
            self.reflectance[of],
            self.delay_s[:, of],
            self.weight[:, of],
            tuple(each.part(of) for each in self.more),
        )

    def scatter(self, scene: Scene) -> Scatter | None:
        """Spread of each ray's light inside the surface it ends on; None if no surface has any."""
        return scatter_of(scene, self.surfaces)


def scatter_of(scene: Scene, surface: NDArray[np.integer]) -> Scatter | None:
    """Return the spread of light by the surfaces given by their index; -1 means none."""
    spreads = [surface.scatter or Scatter(0.0, 0.0) for surface in scene.surfaces]
    if not any(spread.width_s or spread.decay_s for spread in spreads):
        return None
    return Scatter(
        np.array([spread.width_s for spread in spreads] + [0.0])[surface],
        np.array([spread.decay_s for spread in spreads] + [0.0])[surface],
    )


def sparse_image(
    delay_s: NDArray[np.float64],
    weight: NDArray[np.float64],
    scatter: Scatter | None,
    shape: tuple[int, int],
) -> SparseResponses:
    """Arrange returns (K, H W) as an image, without those that are nowhere."""
    there = np.any(weight > 0, axis=1)
    there[0] |= not there.any()  # a dark scene has one return, of weight 0
    planes = (-1, *shape)
    if scatter is not None:
        scatter = Scatter(scatter.width_s[there], scatter.decay_s[there]).reshaped(planes)
    return SparseResponses(delay_s[there].reshape(planes), weight[there].reshape(planes), scatter)


def light_rays(scene: Scene, directions: Points) -> Lit:
    """Follow rays from the camera to their ends, and light to there, on all cores."""
    ask()
    lights = tuple(image_lights(scene))
    parted = (3 if len(scene.mirrors) == 2 else _MOST_ENDS) if scene.panes else 1

    def follow(rays: Points) -> Lit:
        ends = first_scattering(scene, camera_of(scene).position_m, rays)
        return light_on_ends(scene, lights, ends, rays=len(rays), parted=parted)

    blocks = [directions[k : k + _BLOCK] for k in range(0, len(directions), _BLOCK)]
    if len(blocks) < 2:
        return follow(directions)
    with ThreadPoolExecutor(cores()) as threads:
        return joined(list(threads.map(follow, blocks)))


def joined(parts: list[Lit]) -> Lit:
    """Concatenate along the rays."""
    return Lit(
        np.concatenate([part.surface for part in parts]),
        np.concatenate([part.point for part in parts]),
        np.concatenate([part.distance_m for part in parts]),
        np.concatenate([part.reflectance for part in parts]),
        np.concatenate([part.delay_s for part in parts], axis=1),
        np.concatenate([part.weight for part in parts], axis=1),
        tuple(joined(list(each)) for each in zip(*(part.more for part in parts), strict=True)),
    )


def some(ends: RayEnds, index: NDArray[Any]) -> RayEnds:
    """Return the ends of some rays, as they are."""
    return RayEnds(*(getattr(ends, each.name)[index] for each in fields(ends)))


def light_on_ends(
    scene: Scene, lights: tuple[ImageLight, ...], ends: RayEnds, *, rays: int, parted: int = 1
) -> Lit:
    """Follow light to the ends of rays, of each of which the ``parted`` brightest count."""
    if parted > 1:
        ends = some(ends, np.lexsort((-ends.throughput * ends.albedo, ends.ray)))
        place = np.arange(len(ends.ray)) - np.searchsorted(ends.ray, ends.ray)
        first, *rest = (
            light_on_ends(scene, lights, some(ends, place == k), rays=rays) for k in range(parted)
        )
        return replace(
            first,
            delay_s=np.concatenate([each.delay_s for each in (first, *rest)]),
            weight=np.concatenate([each.weight for each in (first, *rest)]),
            more=tuple(replace(k, delay_s=k.delay_s[:0], weight=k.weight[:0]) for k in rest),
        )
    lit = Lit(
        np.full(rays, -1),
        np.zeros((rays, 3)),
        np.zeros(rays),
        np.zeros(rays),
        np.zeros((len(lights), rays)),
        np.zeros((len(lights), rays)),
    )
    reflectance = ends.throughput * ends.albedo
    lit.surface[ends.ray] = ends.surface
    lit.point[ends.ray] = ends.point
    lit.distance_m[ends.ray] = ends.distance_m
    lit.reflectance[ends.ray] = reflectance
    glossy = any(surface.gloss for surface in scene.surfaces)
    for k, light in enumerate(lights):
        length_m, irradiance = light_on(scene, light, ends.point, ends.normal)
        lit.delay_s[k, ends.ray] = (length_m + ends.distance_m) / SPEED_OF_LIGHT_M_S
        sent = reflectance + highlight(scene, light, ends) if glossy else reflectance
        lit.weight[k, ends.ray] = irradiance * sent
    return lit


def highlight(scene: Scene, light: ImageLight, ends: RayEnds) -> NDArray[np.float64]:
    """Reflectance of gloss towards the camera: Blinn's lobe around the half vector.

    Its factor (n + 8) / 8, beside a diffuse surface's albedo, keeps the energy of the lobe.
    """
    gloss = np.array([surface.gloss for surface in scene.surfaces])[ends.surface]
    exponent = np.array([surface.gloss_exponent for surface in scene.surfaces])[ends.surface]
    way = light.positions_m[0] - ends.point
    half = way / np.linalg.norm(way, axis=-1, keepdims=True) - ends.direction
    half /= np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-12)
    cosine = np.clip(np.einsum("pc,pc->p", half, ends.normal), 0, 1)
    lobe: NDArray[np.float64] = gloss * (exponent + 8) / 8 * cosine**exponent * ends.throughput
    return lobe


def camera_of(scene: Scene) -> Viewpoint:
    """Return the camera that a scene of surfaces has."""
    assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
    return scene.camera


def first_scattering(scene: Scene, eye: Points, direction: Points) -> RayEnds:
    """Follow the camera's rays, over mirrors and parted by panes, to surfaces that scatter."""
    count = len(direction)
    start = np.broadcast_to(eye, direction.shape)
    ray, turns = np.arange(count), np.zeros(count, dtype=np.intp)
    distance_m, throughput = np.zeros(count), np.ones(count)
    ended: list[tuple[NDArray[Any], ...]] = []
    scatters = np.array([surface.scatters for surface in scene.surfaces] + [False])
    kinds = np.array([*(surface.kind for surface in scene.surfaces), ""])
    clear, reflects = kinds == "glass", (kinds == "glass") | (kinds == "mirror")
    dusty = clear & np.roll(kinds == "dust", -1)
    for _leg in range((scene.mirror_bounces + 1) * (clear.sum() + 1)):
        met = first_hit(scene, start, direction)
        point, which, normal = met.point, met.surface, met.normal
        distance_m = distance_m + met.length_m
        facing = np.einsum("pc,pc->p", normal, direction) < 0
        through = clear[which]
        end_on = which + dusty[which] * (2 - facing)  # a pane's dust follows it, of its front first
        normal[through & ~facing] *= -1
        facing |= through
        end = scatters[end_on] & facing
        of_rays = ray, point, end_on, distance_m, throughput, direction, normal, met.albedo
        ended.append(tuple(each[end] for each in of_rays))
        on = reflects[which] & facing & (turns < scene.mirror_bounces)
        next_ones = np.concatenate([np.flatnonzero(on), np.flatnonzero(through)])
        if not next_ones.size:
            break
        turned = np.arange(next_ones.size) < np.count_nonzero(on)
        ray, which, direction = ray[next_ones], which[next_ones], direction[next_ones]
        start, distance_m = point[next_ones], distance_m[next_ones]
        throughput, turns = throughput[next_ones], turns[next_ones] + turned
        for index in np.unique(which):
            mine, surface = which == index, scene.surfaces[index]
            if surface.glass is None:
                throughput[mine] *= surface.reflectivity
            else:
                cosine = np.abs(direction[mine] @ surface.mirror.normal)
                mirrored, passed, later_m = surface.glass.shares(cosine)
                throughput[mine] *= np.where(turned[mine], mirrored, passed)
                distance_m[mine] += np.where(turned[mine], 0.0, later_m)
            mine &= turned
            direction[mine] = surface.mirror.mirrored_direction(direction[mine])
    return RayEnds(*(np.concatenate(parts) for parts in zip(*ended, strict=True)))


class FirstHits(NamedTuple):
    """What rays meet first: how far away, the surface by index (0 and -1: none), and what is there.

    The normals (P, 3) of a mesh point to where a ray comes from, others out of the front.
    """

    length_m: NDArray[np.float64]
    surface: NDArray[np.intp]
    point: Points
    normal: Points
    albedo: NDArray[np.float64]


def first_hit(scene: Scene, start: Points, direction: Points) -> FirstHits:
    """Follow rays along unit vectors to the first surface."""
    nearest, which = np.full(len(direction), np.inf), np.full(len(direction), -1)
    end, triangle = start + FAR_M * direction, np.zeros(len(direction), dtype=np.intp)
    for index, surface in enumerate(scene.surfaces):
        if surface.kind == "dust":
            continue  # its pane is there
        if isinstance(surface.shape, Mesh):
            at, of_mesh = surface.shape.first_met(start, end)
            closer = at < nearest
            triangle[closer] = of_mesh[closer]
        else:
            at = hit(surface, start, end)
            closer = at < nearest
        nearest[closer], which[closer] = at[closer], index
    length_m = np.where(which < 0, 0.0, nearest) * FAR_M
    point = start + length_m[:, None] * direction
    normal = np.zeros_like(point)
    albedo = np.array([*(each.reflectivity for each in scene.surfaces), 0.0])[which]
    for index, surface in enumerate(scene.surfaces):
        mine = np.flatnonzero(which == index)
        if isinstance(surface.shape, Mesh):
            there = point[mine], direction[mine], triangle[mine]
            normal[mine], share = surface.shape.seen(*there)
            albedo[mine] *= share
        elif mine.size:
            normal[mine] = surface.shape.normals(point[mine])
    return FirstHits(length_m, which, point, normal, albedo)


def image_lights(scene: Scene) -> Iterator[ImageLight]:
    """Yield the light itself and its images in every chain of mirrors that it can enter."""
    mirrors = scene.mirrors
    axis = scene.light.aim_at_m - scene.light.position_m
    lights = [ImageLight((), (scene.light.position_m,), axis / np.linalg.norm(axis))]
    yield lights[0]
    for _bounce in range(scene.mirror_bounces):
        lights = [
            ImageLight(
                (mirror, *light.mirrors),
                (mirror.mirror.mirrored(light.positions_m[0]), *light.positions_m),
                mirror.mirror.mirrored_direction(light.axis),
            )
            for light in lights
            for mirror in mirrors
            if not any(mirror.mirror.centre is last.mirror.centre for last in light.mirrors[:1])
            and mirror.mirror.in_front(light.positions_m[0])
            and _may_reach(light, mirror.mirror)
        ]
        yield from lights


def _may_reach(light: ImageLight, mirror: Rectangle) -> bool:
    """Whether a chain of mirrors may show the light to a further one: if not, no point gets any.

    Both mirrors count half as large again, so that pixels at their edges have their share.
    """
    if not light.mirrors:
        return True
    apex, last = light.positions_m[0], light.mirrors[0].mirror
    away = last.centre - apex
    across, along = (_BESIDE * size / 2 * last.normal for size in (last.width, last.height))
    depth = float(away @ last.normal)
    ways = mirror.centre - apex + _BESIDE * (mirror.extent() - mirror.centre)
    ways = _clipped(ways, last.normal, depth)  # of those that get to the last mirror's front
    for half, side in ((across, last.right), (along, last.up)):
        for sign in (1, -1):
            # |depth (way . side) - (way . normal) (away . side)| < (way . normal) size / 2
            axis = half + sign * ((away @ side) * last.normal - depth * side)
            ways = _clipped(ways, axis, 0.0)
    return len(ways) > 0


def _clipped(corners: Points, axis: Points, least: float) -> Points:
    """Return the corners (N, 3) of the part of a polygon that is at least so far along an axis."""
    over = corners @ axis - least
    kept: list[Points] = []
    for k, (corner, before) in enumerate(zip(corners, np.roll(corners, 1, axis=0), strict=True)):
        if over[k - 1] * over[k] < 0:
            kept.append(corner + over[k] / (over[k] - over[k - 1]) * (before - corner))
        if over[k] >= 0:
            kept.append(corner)
    return np.array(kept).reshape(-1, 3)


def light_on(
    scene: Scene, light: ImageLight, point: Points, normal: Points
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Length of the path in m, and irradiance, by one chain of mirrors at points on surfaces.

    The length is 0 where the mirrors do not show the light.
    """
    length_m, irradiance = np.zeros(len(point)), np.zeros(len(point))
    near = np.arange(len(point))
    if light.mirrors:  # only few points are lit by the last mirror
        image_m = np.broadcast_to(light.positions_m[0], point.shape)
        near = np.flatnonzero(light.mirrors[0].shape.hit(point, image_m) < 1)
        point, normal = point[near], normal[near]
    way = light.positions_m[0] - point
    # of a point in the light itself there is no direction: nothing comes from it
    distance_m = np.maximum(np.sqrt(np.einsum("pc,pc->p", way, way)), _NOWHERE_M)
    towards = way / distance_m[:, None]
    cosine = np.einsum("pc,pc->p", towards, normal)
    received = np.maximum(cosine, 0) / distance_m**2
    received *= beam(scene.light, -towards @ light.axis)
    for mirror in light.mirrors:
        if mirror.glass is None:
            received *= mirror.reflectivity
    shone_at = np.flatnonzero(received)
    reached = shone_at[unobstructed(scene, light.mirrors, light.positions_m, point[shone_at])]
    length_m[near] = distance_m
    irradiance[near[reached]] = received[reached]
    if scene.panes:
        share, later_m = at_panes(scene, light.mirrors, light.positions_m, point[reached])
        irradiance[near[reached]] *= share
        length_m[near[reached]] += later_m
    return length_m, irradiance


def at_panes(
    scene: Scene, mirrors: tuple[Surface, ...], images_m: tuple[Points, ...], point: Points
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what share panes leave of light on free ways (see `unobstructed`), and m they add."""
    share, later_m, start = np.ones(len(point)), np.zeros(len(point)), point
    for image_m, mirror in zip(images_m, (*mirrors, None), strict=True):
        end = np.broadcast_to(image_m, point.shape)
        if mirror is not None:
            end = start + mirror.shape.hit(start, end)[:, None] * (end - start)
        way = end - start
        way = way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), _NOWHERE_M)
        for plane, glass in scene.panes:
            on = np.flatnonzero(plane.hit(start, end) < 1 - 1e-9)
            _, passed, more_m = glass.shares(np.abs(way[on] @ plane.normal))
            share[on] *= passed
            later_m[on] += more_m
        if mirror is not None and mirror.glass is not None:
            share *= mirror.glass.shares(np.abs(way @ mirror.mirror.normal))[0]
        start = end
    return share, later_m


def normals_at(scene: Scene, point: Points, surface: NDArray[np.intp]) -> Points:
    """Return the normals of the surfaces, by index and no meshes, that points lie on."""
    normals = np.zeros_like(point)
    for index in np.unique(surface):
        mine = surface == index
        normals[mine] = scene.surfaces[index].primitive.normals(point[mine])
    return normals


def beam(light: Light, cosine: NDArray[np.floating]) -> NDArray[np.floating]:
    """Intensity relative to the beam's axis."""
    if light.beam_exponent == 0:
        return np.ones_like(cosine)
    intensity: NDArray[np.floating] = np.maximum(cosine, 0) ** light.beam_exponent
    return intensity


def unobstructed(
    scene: Scene, mirrors: tuple[Surface, ...], images_m: tuple[Points, ...], point: Points
) -> NDArray[np.intp]:
    """Return the points, by index, to which the way of light over a chain of mirrors is free.

    ``images_m``: where it seems to start, in all mirrors, all but the first, ..., and in none;
    the same for all points, or of each.
    """
    left, stops = np.arange(len(point)), [point]

    def start_of(image_m: Points) -> Points:
        of = image_m if image_m.ndim == 1 else image_m[left]
        return np.broadcast_to(of, stops[-1].shape)

    # first whether all mirrors are hit, which few paths do; then what is in between
    for mirror, image_m in zip(mirrors, images_m, strict=False):
        start, end = stops[-1], start_of(image_m)
        fraction = mirror.shape.hit(start, end)
        on = (fraction < 1) & mirror.mirror.in_front(start)
        left, stops = left[on], [stop[on] for stop in stops]
        stops.append(stops[-1] + fraction[on][:, None] * (end[on] - stops[-1]))
    stops.append(start_of(images_m[-1]))
    clear = np.ones(len(left), dtype=bool)
    for start, end in pairwise(stops):
        still = np.flatnonzero(clear)
        end_m = end[:1] if end.strides[0] == 0 else end[still]
        start_m = start[still]
        clear[still] = ~blocked(scene, start_m, np.broadcast_to(end_m, start_m.shape))
    return left[clear]


def blocked(scene: Scene, start: Points, end: Points) -> NDArray[np.bool_]:
    """Whether anything but panes is between two points; surfaces they lie on do not count."""
    blocked = np.zeros(len(start), dtype=bool)
    if not len(start):
        return blocked
    low, high = _box(start, end)
    for surface in (each for each in scene.surfaces if not each.passes):
        least, most = surface.shape.box
        if (most < low).any() or (least > high).any():
            continue  # nowhere near any of the segments
        if surface.opaque is None:
            blocked |= surface.shape.hit(start, end) < 1 - 1e-9
        else:
            blocked |= blocked_by_mask(surface.mirror, surface.opaque, start, end)
    return blocked


def _box(start: Points, end: Points) -> tuple[Points, Points]:
    """Lowest and highest coordinates of segments, all of which may end at one point."""
    ends = end[:1] if end.strides[0] == 0 else end  # a broadcast point
    axes = range(3)
    low = [min(start[:, axis].min(), ends[:, axis].min()) for axis in axes]
    high = [max(start[:, axis].max(), ends[:, axis].max()) for axis in axes]
    return np.array(low), np.array(high)


def hit(surface: Surface, start: Points, end: Points) -> NDArray[np.float64]:
    """Fraction of the way at which segments hit a surface, or an opaque cell of a stencil."""
    at = surface.shape.hit(start, end)
    if surface.opaque is None:
        return at
    return np.where(blocked_by_mask(surface.mirror, surface.opaque, start, end), at, np.inf)
