"""Light that glossy surfaces send on: to the camera, and between patches of surfaces.

Directions are drawn evenly from the lobe around that of a mirror, which has Blinn's form. The
lamp's own glow on what stands before a glossy plane is an integral over the plane, around the place
where a mirror would show the lamp.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.base import Scatter, ask
from transientcam_simulation.light._over_mirrors import OverMirrors
from transientcam_simulation.light._patches import Patches
from transientcam_simulation.light._paths import (
    Lit,
    RayEnds,
    blocked,
    first_scattering,
    image_lights,
    joined,
    light_on,
    light_on_ends,
    scatter_of,
    some,
)
from transientcam_simulation.scene import Points, Rectangle, Scene

LOBE_RAYS: Final = 128
"""Into the lobe of a glossy surface behind a pixel."""
_MOST_RAYS: Final = 1 << 20  # into all of them: some 150 MiB
_BLOCK: Final = 1 << 16  # rays at a time
_GLOSSIES: Final = 2  # one behind the other, before the camera
_PATCH_RAYS: Final = 256  # from each patch, for glossy surfaces around it
_PLASTIC: Final = np.array([0.7548776662466927, 0.5698402909980532])  # even places in a square
_STEPS, _DEVIATIONS = 24, 4.0  # a side of the integral over a highlight
_OFF_M: Final = 1e-9

Values = NDArray[np.float64]


def around(normal: Points, cosine: Values, turn: Values) -> Points:
    """Return directions (P, 3) at angles to normals, turned about them by shares of a circle."""
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin(axis=1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    turn, sine = 2 * np.pi * turn[:, None], np.sqrt(1 - cosine**2)[:, None]
    aside = np.cos(turn) * across + np.sin(turn) * np.cross(normal, across)
    directions: Points = cosine[:, None] * normal + sine * aside
    return directions


def sent_by_gloss(scene: Scene, ends: RayEnds, places: Values) -> tuple[Points, Values]:
    """Draw directions from the lobes at the ends of rays, and return what share of light goes so.

    ``places`` (P, 2) are from 0 to 1.
    """
    gloss, power = (of_surfaces(scene, name)[ends.surface] for name in ("gloss", "gloss_exponent"))
    axis = around(ends.normal, places[:, 0] ** (1 / (power + 1)), places[:, 1])
    facing = -np.einsum("pc,pc->p", axis, ends.direction)
    way = ends.direction + 2 * facing[:, None] * axis
    rising = np.einsum("pc,pc->p", way, ends.normal).clip(0)
    return way, gloss * (power + 8) / (power + 1) * facing.clip(0) * rising


def of_surfaces(scene: Scene, name: str) -> Values:
    """Return a figure of each surface."""
    return np.array([getattr(surface, name) for surface in scene.surfaces], dtype=float)


@dataclass(frozen=True)
class ShownByGloss:
    """What glossy surfaces show rays of the camera of other surfaces.

    ``ray`` (M) is the index of the camera's ray, ``lit`` the light on what its lobe meets,
    ``spread`` that within the glossy surface.
    """

    ray: NDArray[np.intp]
    lit: Lit
    spread: Scatter | None

    @classmethod
    def of(cls, scene: Scene, rays: Points, lobe_rays: int) -> "ShownByGloss | None":
        """Follow rays (P, 3) of the camera, and so many of each lobe; None if there are none."""
        glossy = of_surfaces(scene, "gloss") > 0
        if not glossy.any():
            return None
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        ends = first_scattering(scene, scene.camera.position_m, rays)
        ends = some(ends, np.flatnonzero(glossy[ends.surface]))
        if not len(ends.ray):
            return None
        count = max(1, min(lobe_rays, _MOST_RAYS // len(ends.ray)))
        shifts = np.random.default_rng(0).random((len(ends.ray), 1, 2))
        lights, at_once = tuple(image_lights(scene)), max(1, _BLOCK // count)
        found: list[tuple[NDArray[np.intp], NDArray[np.intp], Lit]] = []
        for first in range(0, len(ends.ray), at_once):
            ask()
            block = np.arange(first, min(first + at_once, len(ends.ray)))
            places = (shifts[block] + np.arange(count)[:, None] * _PLASTIC) % 1.0
            before = some(ends, np.repeat(block, count))
            before.throughput[:] /= count
            ray, by = before.ray, before.surface
            places = places.reshape(-1, 2)
            for _further in range(_GLOSSIES):
                after = _followed(scene, before, places)
                ray, by = ray[after.ray], by[after.ray]
                places = (places[after.ray] + _PLASTIC[::-1]) % 1.0
                after.ray[:] = np.arange(len(ray))
                found.append((ray, by, light_on_ends(scene, lights, after, rays=len(ray))))
                on = np.flatnonzero(glossy[after.surface])
                before, ray, by, places = some(after, on), ray[on], by[on], places[on]
        ray = np.concatenate([each for each, _, _ in found])
        by = np.concatenate([each for _, each, _ in found])
        return cls(ray, joined([each for *_, each in found]), scatter_of(scene, by))

    def of_rays(self, moments: NDArray[np.complex128], frequency_hz: float, rays: int) -> Any:
        """Add up moments (M) of what lobes meet to those of so many rays of the camera."""
        if self.spread is not None:
            moments = moments * self.spread.transfer(frequency_hz)
        real, imag = (np.bincount(self.ray, part, rays) for part in (moments.real, moments.imag))
        return real + 1j * imag


def _followed(scene: Scene, ends: RayEnds, places: Values) -> RayEnds:
    """Send rays on by gloss; ``ray`` is the index among those before."""
    way, share = sent_by_gloss(scene, ends, places)
    goes = np.flatnonzero(share * ends.throughput > 0)
    start = ends.point[goes] + _OFF_M * ends.normal[goes]
    met = first_scattering(scene, start, way[goes])
    on = goes[met.ray]
    return RayEnds(
        on,
        met.point,
        met.surface,
        met.distance_m + ends.distance_m[on],
        met.throughput * (share * ends.throughput)[on],
        met.direction,
        met.normal,
        met.albedo,
    )


def between_patches(scene: Scene, patches: Patches) -> OverMirrors:
    """Form factors and distances of pairs of patches by way of a glossy surface."""
    glossy, count = of_surfaces(scene, "gloss") > 0, _PATCH_RAYS
    shifts = np.random.default_rng(0).random((len(patches), 1, 2))
    found: list[tuple[NDArray[Any], ...]] = []
    at_once = max(1, _BLOCK // count)
    for first in range(0, len(patches), at_once):
        ask()
        to = np.repeat(np.arange(first, min(first + at_once, len(patches))), count)
        places = (shifts[to[::count]] + np.arange(count)[:, None] * _PLASTIC) % 1.0
        places, normal = places.reshape(-1, 2), patches.normal[to]
        way = around(normal, np.sqrt(places[:, 0]), places[:, 1])
        ends = first_scattering(scene, patches.centre[to] + _OFF_M * normal, way)
        ends = some(ends, np.flatnonzero(glossy[ends.surface]))
        met = _followed(scene, ends, (places[ends.ray] + _PLASTIC[::-1]) % 1.0)
        met = some(met, np.flatnonzero(np.isin(met.surface, list(patches.cells))))
        to = to[ends.ray[met.ray]]
        found.append(
            (to, patches.at(scene, met.point, met.surface), met.throughput / count, met.distance_m)
        )
    to, by, factors, far_m = (np.concatenate(each) for each in zip(*found, strict=True))
    return OverMirrors(to.astype("i4"), by.astype("i4"), factors.astype("f4"), far_m.astype("f4"))


@dataclass(frozen=True)
class Glow:
    """The lamp's light on patches by way of glossy planes: patch, time, and irradiance."""

    patch: NDArray[np.intp]
    delay_s: Values
    weight: Values

    @classmethod
    def of(cls, scene: Scene, patches: Patches) -> "Glow":
        """Integrate over each glossy plane."""
        parts = list(_highlights(scene, patches))
        return cls(*map(np.concatenate, zip(*parts, strict=True))) if parts else NO_GLOW

    def irradiance(self, frequency_hz: float, count: int) -> NDArray[np.complex128]:
        """Moments (N) on so many patches."""
        light = self.weight * np.exp(2j * np.pi * frequency_hz * self.delay_s)
        real, imag = (np.bincount(self.patch, part, count) for part in (light.real, light.imag))
        glow: NDArray[np.complex128] = real + 1j * imag
        return glow


NO_GLOW = Glow(np.zeros(0, np.intp), np.zeros(0), np.zeros(0))


def _highlights(scene: Scene, patches: Patches) -> Iterator[tuple[NDArray[Any], ...]]:
    steps = ((np.arange(_STEPS) + 0.5) / _STEPS * 2 - 1) * _DEVIATIONS
    along, across = (grid.ravel() for grid in np.meshgrid(steps, steps))
    for light in image_lights(scene):
        lamp = light.positions_m[0]
        for surface in scene.surfaces:
            plane = surface.shape
            if not surface.gloss or not isinstance(plane, Rectangle):
                continue
            ask()
            high_m = float((lamp - plane.centre) @ plane.normal)
            away_m = (patches.centre - plane.centre) @ plane.normal
            to = np.flatnonzero((away_m > _OFF_M) & (high_m > 0))
            at, away = patches.centre[to], away_m[to, None]
            foot = at - away * plane.normal
            over = lamp - high_m * plane.normal - foot
            far_m = np.sqrt((over**2).sum(1, keepdims=True) + (high_m + away) ** 2)
            cosine, share = (high_m + away) / far_m, away / (high_m + away)
            # where half vectors are off the normal by one deviation of the lobe
            width = 2 * share * (1 - share) * far_m / np.sqrt(surface.gloss_exponent)
            size = np.linalg.norm(over, axis=1, keepdims=True)
            ahead = np.where(size > _OFF_M, over / np.maximum(size, _OFF_M), plane.right)
            first, second = width / cosine * ahead, width * cosine * np.cross(plane.normal, ahead)
            place = foot + share * over
            point = place[:, None] + along[:, None] * first[:, None]
            point = (point + across[:, None] * second[:, None]).reshape(-1, 3)
            cell = np.repeat(width[:, 0] ** 2 * (2 * _DEVIATIONS / _STEPS) ** 2, len(along))
            of = np.repeat(to, len(along))
            there = (np.abs((point - plane.centre) @ plane.right) < plane.width / 2) & (
                np.abs((point - plane.centre) @ plane.up) < plane.height / 2
            )
            of, point, cell = of[there], point[there], cell[there]
            way = patches.centre[of] - point
            length_m = np.linalg.norm(way, axis=1)
            way /= length_m[:, None]
            half = way + (lamp - point) / np.linalg.norm(lamp - point, axis=1, keepdims=True)
            half /= np.linalg.norm(half, axis=1, keepdims=True)
            power = surface.gloss_exponent
            lobe = surface.gloss * (power + 8) / 8 * (half @ plane.normal).clip(0) ** power
            falls = -np.einsum("pc,pc->p", way, patches.normal[of]).clip(None, 0)
            sent = lobe * cell * falls * (way @ plane.normal) / (np.pi * length_m**2)
            on = np.flatnonzero(sent > 0)
            normal = np.broadcast_to(plane.normal, (len(on), 3))
            lit_m, irradiance = light_on(scene, light, point[on], normal)
            lit = irradiance > 0
            on, lit_m, irradiance = on[lit], lit_m[lit], irradiance[lit]
            clear = ~blocked(scene, point[on], patches.centre[of[on]])
            on, lit_m, irradiance = on[clear], lit_m[clear], irradiance[clear]
            delay_s = (lit_m + length_m[on]) / SPEED_OF_LIGHT_M_S
            yield of[on], delay_s, irradiance * sent[on]
