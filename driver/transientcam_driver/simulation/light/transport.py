"""What is in front of the camera as light, still or moving, with the effects called for."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.effects import Facts
from transientcam_driver.simulation.effects.interreflection import DiffuseInterreflection
from transientcam_driver.simulation.effects.mirror_paths import MirrorPaths
from transientcam_driver.simulation.effects.mixed_pixels import MixedPixels
from transientcam_driver.simulation.effects.scattering import Scattering
from transientcam_driver.simulation.light.facts import facts_of, facts_over_time
from transientcam_driver.simulation.light.mixed_pixels import with_mixed_pixels
from transientcam_driver.simulation.light.moving import MovingLight, MovingResponses
from transientcam_driver.simulation.light.paths import (
    Lit,
    camera_rays,
    light_rays,
    sparse,
)
from transientcam_driver.simulation.light.radiosity import Interreflection, WithInterreflection
from transientcam_driver.simulation.responses import Responses
from transientcam_driver.simulation.scene.scene import Scene

_SUB_PIXELS = tuple((x / 3, y / 3) for x in (-1, 0, 1) for y in (-1, 0, 1))
"""Rays of a pixel at an edge, right and down by these shares of a pixel."""
_SUB_PIXELS_MOVING = ((-0.25, -0.25), (0.25, 0.25))
"""The same where they are traced for every image, because the scene moves."""

ViewAt = Callable[[float], "View"]
"""The view at a time of the device; the same object as long as nothing changes."""


@dataclass(frozen=True, slots=True)
class View:
    """What the camera sees: impulse responses, and the reflectance of the pixels' surfaces."""

    responses: Responses
    reflectance: NDArray[np.float32] | np.float32


class Scenery(Protocol):
    """Something in front of the camera."""

    @property
    def moves(self) -> bool:
        """Whether it changes with time."""
        ...

    @property
    def preview(self) -> "View":
        """The view at the start, without effects that take long to compute."""
        ...

    @property
    def facts(self) -> Facts | None:
        """What effects are judged by; None if there is no geometry."""
        ...

    def view(self, effects: frozenset[str]) -> ViewAt:
        """Prepare its views with these effects of light."""
        ...


class GivenScenery:
    """Given impulse responses that do not change."""

    moves = False
    facts = None

    def __init__(self, responses: Responses) -> None:
        self.preview = View(responses, np.float32(1))

    def view(self, effects: frozenset[str]) -> ViewAt:
        """Return the given view; no effect changes it."""
        return lambda _time_s: self.preview


class SurfaceScenery:
    """Surfaces, a light source and a camera."""

    def __init__(self, scene: Scene, *, width: int, height: int) -> None:
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        self._scene = scene
        self._width, self._height = width, height
        self._rays = camera_rays(scene.camera, width=width, height=height)
        self._start: Lit | None = None

    @property
    def moves(self) -> bool:
        """Whether anything moves."""
        return self._scene.moves

    @property
    def preview(self) -> View:
        """Direct light and mirrors."""
        return self._preview

    @property
    def facts(self) -> Facts:
        """Figures of the scene, over several times if it moves."""
        return self._facts

    @cached_property
    def _preview(self) -> View:
        return self._view(self._scene.at(0.0), frozenset())

    @cached_property
    def _facts(self) -> Facts:
        if self.moves:
            return facts_over_time(self._scene, width=self._width, height=self._height)
        return facts_of(self._scene, self._lit(self._scene), width=self._width, height=self._height)

    def view(self, effects: frozenset[str]) -> ViewAt:
        """Trace a still scene once, and a moving one for each time."""
        scene = self._with(effects)
        if not self.moves:
            still = self._view(scene, effects)
            return lambda _time_s: still
        moving = MovingLight(scene, self._rays, width=self._width, height=self._height)
        last: list[tuple[float, View]] = []

        def view_at(time_s: float) -> View:
            tick_s = moving.tick_s(time_s)
            if not last or last[0][0] != tick_s:
                last[:] = [(tick_s, self._moving_view(moving.at(tick_s), effects))]
            return last[0][1]

        return view_at

    def _moving_view(self, now: MovingResponses, effects: frozenset[str]) -> View:
        size = {"width": self._width, "height": self._height}
        responses: Responses = now
        if MixedPixels.name in effects:
            responses = with_mixed_pixels(now.scene, now.distance_m, now, rays=_SUB_PIXELS_MOVING)
        if DiffuseInterreflection.name in effects:
            further = Interreflection(now.scene, now.lit, **size)
            responses = WithInterreflection(responses, further)
        return View(responses, now.reflectance.astype(np.float32))

    def _with(self, effects: frozenset[str]) -> Scene:
        scene = self._scene
        mirrors = any(each.kind == "mirror" for each in scene.surfaces)
        if mirrors and MirrorPaths.name not in effects:
            transport = replace(scene.transport, mirror_bounces=0)
            scene = replace(scene, transport=transport)
        if Scattering.name not in effects and any(each.scatter for each in scene.surfaces):
            surfaces = tuple(replace(each, scatter=None) for each in scene.surfaces)
            scene = replace(scene, surfaces=surfaces)
        forced = DiffuseInterreflection.name in effects and not scene.transport.diffuse_bounces
        if forced:  # on, although the scene has none
            scene = replace(scene, transport=replace(scene.transport, diffuse_bounces=1))
        return scene

    def _lit(self, scene: Scene) -> Lit:
        """Trace, but the scene of the file only once."""
        if scene is not self._scene:
            return light_rays(scene, self._rays)
        if self._start is None:
            self._start = light_rays(scene, self._rays)
        return self._start

    def _view(self, scene: Scene, effects: frozenset[str]) -> View:
        lit = self._lit(scene)
        width, height = self._width, self._height
        responses: Responses = sparse(scene, lit, width=width, height=height)
        if MixedPixels.name in effects:
            distance_m = lit.distance_m.reshape(height, width)
            responses = with_mixed_pixels(scene, distance_m, responses, rays=_SUB_PIXELS)
        if DiffuseInterreflection.name in effects:
            further = Interreflection(scene, lit, width=width, height=height)
            responses = WithInterreflection(responses, further)
        reflectance = lit.reflectance.astype(np.float32).reshape(height, width)
        return View(responses, reflectance)
