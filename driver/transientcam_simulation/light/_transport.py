"""What is in front of the camera as light, still or moving, with the effects called for."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import SurfaceSeen
from transientcam_simulation.base import PINHOLE, Lens, Moments, Responses
from transientcam_simulation.effects import (
    CALLED_ABOVE,
    DiffuseInterreflection,
    Distortion,
    Facts,
    GlassPanes,
    Glimpse,
    Gloss,
    MirrorPaths,
    MixedPixels,
    Noise,
    Scattering,
)
from transientcam_simulation.light._bundle import Region
from transientcam_simulation.light._compiler import load_compiled
from transientcam_simulation.light._facts import SceneFacts, cosine_to_axis
from transientcam_simulation.light._followed import FollowedRays, Within
from transientcam_simulation.light._further_light import FurtherLight
from transientcam_simulation.light._paths import Lit, camera_of, first_hit, light_rays
from transientcam_simulation.light._radiosity import Interreflection, WithInterreflection
from transientcam_simulation.light._rays import camera_rays
from transientcam_simulation.light._recent import Recent
from transientcam_simulation.light._still import StillLight
from transientcam_simulation.light._variants import (
    still_scene,
    without_glass,
    without_gloss,
    without_mirrors,
    without_scattering,
)
from transientcam_simulation.scene import Points, Scene, patches_of

Values = NDArray[np.float64]
KEPT_PIXELS: Final = 40_000
"""Of sensors for which more is kept of a scene than what is shown: 1 KiB a pixel and view."""
_STILL_VIEWS: Final = 3  # for sequences that alternate
_FOLLOWED: Final = 2  # for effects that do


@dataclass(frozen=True, slots=True)
class LightRequirements:
    """What a sequence asks of the light: effects by name, and how exactly.

    ``noise`` is that of a moment, ``highest_hz`` the highest frequency that is measured, ``lens``
    the one before the sensor, and ``image_period_s`` the time from image to image.
    """

    effects: frozenset[str] = frozenset()
    noise: Noise = field(default_factory=lambda: Noise(1e6, 0.0, 900.0, 1))
    highest_hz: float = 0.0
    lens: Lens = PINHOLE
    image_period_s: float = 0.0


@dataclass(frozen=True, slots=True)
class View:
    """What the camera sees: moments by frequency, and reflectance of the pixels' surfaces (H, W).

    ``region``: rows and columns of the pixels that differ from the ``background``, and
    ``moments_in`` their moments, or those of a larger region; None: all may differ.
    """

    everywhere: Callable[[float], NDArray[np.complexfloating] | Moments]
    reflectance: Callable[[], NDArray[np.float32] | np.float32]
    region: Region | None = None
    moments_in: Callable[[Region, float], Moments] | None = None
    background: "View | None" = None

    def moments(
        self, frequency_hz: float, region: Region | None
    ) -> NDArray[np.complexfloating] | Moments:
        """Moments of all pixels, or of a region that holds all that differs."""
        if region is not None and self.moments_in is not None:
            return self.moments_in(region, frequency_hz)
        return self.everywhere(frequency_hz)[... if region is None else region]


@dataclass(frozen=True, slots=True)
class Views:
    """The view at a time of the device; the same object as long as nothing changes.

    ``exact`` are the responses then, which take no account of the time it takes. ``surface`` is
    what the pixels see at a time; None without geometry.
    """

    at: Callable[[float], View]
    exact: Callable[[float], Responses]
    surface: Callable[[float], SurfaceSeen] | None = None


class Scenery(Protocol):
    """Something in front of the camera."""

    @property
    def moves(self) -> bool:
        """Whether it changes with time."""
        ...

    @property
    def glimpses(self) -> tuple[Glimpse, ...]:
        """What effects are judged by."""
        ...

    @property
    def facts(self) -> Facts | None:
        """How effects of light change it; None if there is no geometry."""
        ...

    @property
    def lens(self) -> Lens:
        """What the light comes through."""
        ...

    @property
    def cosine(self) -> Values:
        """(H, W): of the angle between the pixels' rays and the lens's axis."""
        ...

    def view(self, wanted: LightRequirements) -> Views:
        """Prepare its views."""
        ...


class GivenScenery:
    """Given impulse responses that do not change."""

    moves = False
    facts = None
    lens = PINHOLE

    def __init__(self, responses: Responses) -> None:
        self._responses = responses
        self._view = View(responses.moments, lambda: np.float32(1))

    @property
    def glimpses(self) -> tuple[Glimpse, ...]:
        """All pixels, once."""
        return self._glimpses

    @cached_property
    def _glimpses(self) -> tuple[Glimpse, ...]:
        brightness = self._responses.moments(0.0).real
        ones = np.ones(brightness.size)
        shape = brightness.shape[0], brightness.shape[1]
        return (Glimpse(brightness.ravel(), ones, ones, shape),)

    @property
    def cosine(self) -> Values:
        """One, as nothing is known of angles."""
        return np.ones(self.glimpses[0].shape)

    def view(self, wanted: LightRequirements) -> Views:
        """Return the given view."""
        return Views(lambda _time_s: self._view, lambda _time_s: self._responses)


class SurfaceScenery:
    """Surfaces, a light source and a camera."""

    def __init__(self, scene: Scene, *, width: int, height: int) -> None:
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        self._scene = scene
        self._camera = scene.camera
        self._size = {"width": width, "height": height}
        small = width * height <= KEPT_PIXELS
        self._still_views: Recent[LightRequirements, Views] = Recent(_STILL_VIEWS if small else 1)
        self._followed: Recent[tuple[frozenset[str], Lens], FollowedRays]
        self._followed = Recent(_FOLLOWED if small else 0)

    @property
    def moves(self) -> bool:
        """Whether anything moves."""
        return self._scene.moves

    @property
    def lens(self) -> Lens:
        """The camera's."""
        return self._camera.lens

    @property
    def glimpses(self) -> tuple[Glimpse, ...]:
        """Pixels, over the scene's life."""
        return self.facts.glimpses

    @property
    def facts(self) -> SceneFacts:
        """How effects change the scene, over its life."""
        return self._facts

    @cached_property
    def _facts(self) -> SceneFacts:
        return SceneFacts(self._scene, **self._size)

    @property
    def cosine(self) -> Values:
        """Of the pixels' rays to the lens's axis."""
        return self._cosine

    @cached_property
    def _cosine(self) -> Values:
        shape = self._size["height"], self._size["width"]
        return cosine_to_axis(self._camera, camera_rays(self._camera, **self._size)).reshape(shape)

    def view(self, wanted: LightRequirements) -> Views:
        """Trace a still scene once; of a moving one what moves, for each time.

        Raises CompilerMissing where it moves, and there is no compiler.
        """
        # what moves is remembered by its views, which belong to one camera
        if self.moves:
            return self._traced(wanted)
        return self._still_views.get(wanted, lambda: self._traced(wanted))

    def _traced(self, wanted: LightRequirements) -> Views:
        scene = self._with(wanted)
        effects = wanted.effects
        # effects within a pixel change which rays are followed, and not what they see
        followed = self._followed.get(
            (effects - {MixedPixels.name}, wanted.lens),
            lambda: FollowedRays(still_scene(scene), **self._size),
        )
        noise = wanted.noise if MixedPixels.name in effects else None
        still = StillLight(
            followed.scene,
            **self._size,
            noise=noise,
            highest_hz=wanted.highest_hz,
            followed=followed,
        )
        tolerance = CALLED_ABOVE * float(wanted.noise.deviation(0.0, 0.0))
        further = DiffuseInterreflection.name in effects and bool(patches_of(scene, 1))
        reflectance = still.reflectance.reshape(still.height, still.width)
        if not self.moves:
            responses: Responses = still.responses()
            if further:
                light = Interreflection(
                    still.scene,
                    still.lit,
                    width=still.width,
                    height=still.height,
                    fine=still.fine,
                    tolerance=tolerance,
                    exchange=followed.exchange,
                    rays=still.rays,
                )
                responses = WithInterreflection(responses, light)
            view = View(responses.moments, lambda: reflectance)

            def seen(_time_s: float) -> SurfaceSeen:
                brightness = responses.moments(0.0).real
                return surface_seen(still.scene, still.rays, still.lit, still.fine, brightness)

            return Views(lambda _time_s: view, lambda _time_s: responses, seen)
        load_compiled()
        from transientcam_simulation.light._held_light import HeldLight, held_light
        from transientcam_simulation.light._moving import MovingLight
        from transientcam_simulation.light._roaming import RoamingLight
        from transientcam_simulation.light._time_interpolation import Steps

        roaming = RoamingLight(scene, self._size, noise, wanted.highest_hz)
        moving = MovingLight(scene, still, soft=noise is not None)

        def nothing(_time_s: float) -> None:
            return None

        held: Callable[[float], HeldLight | None] = nothing
        if further:
            per_side, reach = self.facts.resolution(wanted.noise)
            coarse, fine = (
                FurtherLight(scene, per_side=each, reach=reach, tolerance=tolerance)
                for each in (per_side, scene.transport.patches)
            )
            held = held_light(coarse, fine, still)

        far = {"pixel_rad": still.pixel_rad, "every_s": wanted.image_period_s}
        steps = Steps(scene, lambda time_s: moving.at(time_s, held(time_s)), **far)

        @lru_cache(maxsize=1)
        def background(held: HeldLight | None) -> View:
            return View((held or still).moments, lambda: reflectance)

        @lru_cache(maxsize=1)
        def at(time_s: float) -> View:
            if scene.carriers:
                return View(*roaming.at(time_s, held(time_s)))
            now = steps.at(time_s)
            planes = now.moments, lambda: now.reflectance
            return View(*planes, now.region, now.moments_in, background(now.held))

        @lru_cache(maxsize=1)
        def exact(time_s: float) -> Responses:
            now = (roaming.centres if scene.carriers else moving.at)(time_s)
            if not further:
                return now
            width, height = still.width, still.height
            light = Interreflection(
                now.scene, now.lit, width=width, height=height, tolerance=tolerance
            )
            return WithInterreflection(now, light)

        def seen_then(time_s: float) -> SurfaceSeen:
            now, brightness = scene.at(time_s), exact(time_s).moments(0.0).real
            rays = camera_rays(camera_of(now), **self._size)
            return surface_seen(now, rays, light_rays(now, rays), (), brightness)

        return Views(at, exact, seen_then)

    def _with(self, wanted: LightRequirements) -> Scene:
        """Return the scene with the effects of light that are wanted, and no others."""
        effects, scene = wanted.effects, self._scene
        lens = wanted.lens if Distortion.name in effects else PINHOLE
        scene = replace(scene, camera=replace(self._camera, lens=lens))
        if MirrorPaths.name not in effects:
            scene = without_mirrors(scene)
        if GlassPanes.name not in effects:
            scene = without_glass(scene)
        if Gloss.name not in effects:
            scene = without_gloss(scene)
        if Scattering.name not in effects:
            scene = without_scattering(scene)
        if DiffuseInterreflection.name in effects and scene.transport.diffuse_bounces == 0:
            # on, although the scene has none
            scene = replace(scene, transport=replace(scene.transport, diffuse_bounces=1))
        return scene


def surface_seen(
    scene: Scene,
    directions: Points,
    lit: Lit,
    fine: tuple[Within, ...],
    brightness: NDArray[np.floating],
) -> SurfaceSeen:
    """Return the first surface of each pixel, and the direct light's share.

    Of a scene at one moment: ``directions`` (H W, 3) go through the pixels' centres, ``lit`` and
    ``fine`` are the light of these and further rays, ``brightness`` (H, W) is all light.
    """
    assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
    eye = scene.camera.position_m
    met = first_hit(scene, np.broadcast_to(eye, directions.shape), directions)
    which, point, length_m = met.surface, met.point, met.length_m
    facing = np.einsum("pc,pc->p", met.normal, directions) < 0
    if scene.panes:  # what most light comes from, if that is straight ahead: their dust or behind
        aside_m = np.linalg.norm(np.cross(lit.point - eye, directions), axis=-1)
        at = np.array([*(bool(each.glass) for each in scene.surfaces), False])[which]
        at &= (lit.surface >= 0) & (aside_m < 1e-6)
        which, point = np.where(at, lit.surface, which), np.where(at[:, None], lit.point, point)
        facing, length_m = facing | at, np.linalg.norm(point - eye, axis=-1)
    seen = facing & np.array([each.opaque is None for each in scene.surfaces] + [False])[which]
    from_lamp_m = np.linalg.norm(point - scene.light.position_m, axis=-1)
    # a ray that a mirror turns ends on another surface than the one it meets first
    direct = np.where(lit.surface == which, lit.weight[0], 0.0)
    for each in fine:
        mine = each.of_pixels(each.rays.surface) == which[each.pixel]
        weight = each.of_pixels(each.rays.weight[0])
        direct[each.pixel] = np.where(mine, weight, 0.0).mean(axis=0)
    light = brightness.ravel()
    share = np.divide(direct, light, out=np.zeros_like(direct), where=(light > 0) & seen)
    range_m = np.where(seen, (length_m + from_lamp_m) / 2, np.nan)
    shape = brightness.shape
    return SurfaceSeen(range_m.reshape(shape), np.minimum(share, 1.0).reshape(shape))
