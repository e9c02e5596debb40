"""Light transport: from surfaces, mirrors and stencils to the impulse response of each pixel.

A planar mirror is handled by image points: light that reaches a wall by mirrors M1, ..., Mk comes
straight from the source reflected in M1, then in M2, and so on, as far as each mirror is hit
within its rectangle and nothing stands in between.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_driver.simulation.geometry import Points, blocked_by_mask
from transientcam_driver.simulation.responses import SparseResponses
from transientcam_driver.simulation.scene import Light, Scene, Surface, Viewpoint

_BLOCK = 8192  # rays at a time, so that what is computed for them stays in the cache
_FAR_M = 1e3  # longer than any way in a scene


@dataclass(frozen=True, slots=True)
class _Seen:
    """The diffuse points behind the pixels, flat over the pixels that see one."""

    pixel: NDArray[np.intp]
    point: Points
    surface: NDArray[np.intp]
    distance_m: NDArray[np.float64]
    throughput: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _ImageLight:
    """The light source as it appears in a chain of mirrors, the last one first."""

    mirrors: tuple[Surface, ...]
    positions_m: tuple[Points, ...]
    axis: Points


def trace(scene: Scene, *, width: int, height: int) -> SparseResponses:
    """Impulse responses of all pixels by direct light and any chain of mirrors up to the limit."""
    assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
    directions = _camera_rays(scene.camera, width=width, height=height)
    lights = tuple(_image_lights(scene))
    delay_s = np.zeros((len(lights), len(directions)))
    weight = np.zeros_like(delay_s)
    for first in range(0, len(directions), _BLOCK):
        pixels = slice(first, first + _BLOCK)
        seen = _first_diffuse(scene, scene.camera.position_m, directions[pixels])
        for k, light in enumerate(lights):
            delay_s[k, pixels][seen.pixel], weight[k, pixels][seen.pixel] = _light_on(
                scene, light, seen
            )
    reaching = np.any(weight > 0, axis=1)
    reaching[0] |= not reaching.any()  # a dark scene has one return, of weight 0
    shape = (-1, height, width)
    return SparseResponses(delay_s[reaching].reshape(shape), weight[reaching].reshape(shape))


def _camera_rays(view: Viewpoint, *, width: int, height: int) -> Points:
    """Return unit vectors through the pixels' centres, row by row from the top."""
    forward = view.look_at_m - view.position_m
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = np.tan(np.radians(view.field_of_view_deg) / 2)
    x = half * (2 * (np.arange(width) + 0.5) / width - 1)
    y = half * (height / width) * (1 - 2 * (np.arange(height) + 0.5) / height)
    rays = forward + x[None, :, None] * right + y[:, None, None] * up
    directions: Points = (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).reshape(-1, 3)
    return directions


def _first_diffuse(scene: Scene, eye: Points, direction: Points) -> _Seen:
    """Follow the camera's rays, over mirrors, to the diffuse surface each one ends on."""
    count = len(direction)
    start = np.broadcast_to(eye, direction.shape)
    pixel = np.arange(count)
    distance_m, throughput = np.zeros(count), np.ones(count)
    ended: list[tuple[NDArray[np.intp], Points, NDArray[np.intp], Points, Points]] = []
    for _bounce in range(scene.mirror_bounces + 1):
        nearest = np.full(len(pixel), np.inf)
        which = np.full(len(pixel), -1)
        for index, surface in enumerate(scene.surfaces):
            at = _hit(surface, start, start + _FAR_M * direction)
            closer = at < nearest
            nearest, which = np.where(closer, at, nearest), np.where(closer, index, which)
        point = start + np.where(np.isfinite(nearest), nearest, 0.0)[:, None] * _FAR_M * direction
        distance_m = distance_m + np.linalg.norm(point - start, axis=-1)
        kinds = np.array([surface.kind for surface in scene.surfaces] + ["nothing"])[which]
        end = (kinds == "diffuse") & _facing(scene, which, start)
        ended.append((pixel[end], point[end], which[end], distance_m[end], throughput[end]))
        on = (kinds == "mirror") & _facing(scene, which, start)
        pixel, which, direction = pixel[on], which[on], direction[on]
        point, distance_m, throughput = point[on], distance_m[on], throughput[on]
        for index, surface in enumerate(scene.surfaces):
            mine = which == index
            direction[mine] = surface.rectangle.mirrored_direction(direction[mine])
            throughput[mine] *= surface.reflectivity
        start = point
    return _Seen(*(np.concatenate(parts) for parts in zip(*ended, strict=True)))


def _facing(scene: Scene, which: NDArray[np.intp], start: Points) -> NDArray[np.bool_]:
    """Whether rays arrive at the front of what they hit."""
    facing = np.zeros(len(which), dtype=bool)
    for index, surface in enumerate(scene.surfaces):
        facing |= (which == index) & surface.rectangle.in_front(start)
    return facing


def _image_lights(scene: Scene) -> Iterator[_ImageLight]:
    """Yield the light itself and its images in every chain of mirrors that it can enter."""
    mirrors = [surface for surface in scene.surfaces if surface.kind == "mirror"]
    axis = scene.light.aim_at_m - scene.light.position_m
    lights = [_ImageLight((), (scene.light.position_m,), axis / np.linalg.norm(axis))]
    yield lights[0]
    for _bounce in range(scene.mirror_bounces):
        lights = [
            _ImageLight(
                (mirror, *light.mirrors),
                (mirror.rectangle.mirrored(light.positions_m[0]), *light.positions_m),
                mirror.rectangle.mirrored_direction(light.axis),
            )
            for light in lights
            for mirror in mirrors
            if not any(mirror is last for last in light.mirrors[:1])
            and mirror.rectangle.in_front(light.positions_m[0])
        ]
        yield from lights


def _light_on(
    scene: Scene, light: _ImageLight, seen: _Seen
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Delay and weight at the points that are seen, by one chain of mirrors."""
    way = light.positions_m[0] - seen.point
    length_m = np.linalg.norm(way, axis=-1)
    towards = way / length_m[:, None]
    normals = np.array([surface.rectangle.normal for surface in scene.surfaces])
    albedos = np.array([surface.reflectivity for surface in scene.surfaces])
    cosine = np.einsum("pc,pc->p", towards, normals[seen.surface])
    weight = np.maximum(cosine, 0) * albedos[seen.surface] * seen.throughput / length_m**2
    weight *= _beam(scene.light, -towards @ light.axis)
    for mirror in light.mirrors:
        weight *= mirror.reflectivity
    weight[~_unobstructed(scene, light, seen.point)] = 0
    return (length_m + seen.distance_m) / SPEED_OF_LIGHT_M_S, weight


def _beam(light: Light, cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Intensity relative to the beam's axis."""
    if light.beam_exponent == 0:
        return np.ones_like(cosine)
    intensity: NDArray[np.float64] = np.maximum(cosine, 0) ** light.beam_exponent
    return intensity


def _unobstructed(scene: Scene, light: _ImageLight, point: Points) -> NDArray[np.bool_]:
    """Walk back from the wall over the chain of mirrors to the light."""
    clear = np.ones(len(point), dtype=bool)
    start = point
    for mirror, image_m in zip(light.mirrors, light.positions_m, strict=False):
        fraction = mirror.rectangle.hit(start, np.broadcast_to(image_m, start.shape))
        clear &= (fraction < 1) & mirror.rectangle.in_front(start)
        way = np.where(np.isfinite(fraction), fraction, 0.0)[:, None] * (image_m - start)
        clear &= ~_blocked(scene, start, start + way)
        start = start + way
    clear &= ~_blocked(scene, start, np.broadcast_to(light.positions_m[-1], start.shape))
    return clear


def _blocked(scene: Scene, start: Points, end: Points) -> NDArray[np.bool_]:
    """Whether anything stands between two points; what they lie on themselves does not count."""
    blocked = np.zeros(len(start), dtype=bool)
    for surface in scene.surfaces:
        if surface.opaque is None:
            blocked |= surface.rectangle.hit(start, end) < 1 - 1e-9
        else:
            blocked |= blocked_by_mask(surface.rectangle, surface.opaque, start, end)
    return blocked


def _hit(surface: Surface, start: Points, end: Points) -> NDArray[np.float64]:
    at = surface.rectangle.hit(start, end)
    if surface.opaque is None:
        return at
    return np.where(blocked_by_mask(surface.rectangle, surface.opaque, start, end), at, np.inf)
