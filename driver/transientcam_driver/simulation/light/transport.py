"""What is in front of the camera, as light: still or moving, as far as it is called for."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.effects import (
    DiffuseInterreflection,
    Facts,
    MirrorPaths,
    MixedPixels,
    Scattering,
)
from transientcam_driver.simulation.light.moving import MovingLight, MovingResponses
from transientcam_driver.simulation.light.paths import (
    Lit,
    camera_rays,
    light_rays,
    rays_through,
    sparse,
)
from transientcam_driver.simulation.light.radiosity import Interreflection
from transientcam_driver.simulation.responses import BIN_S, Responses, Scatter, SparseResponses
from transientcam_driver.simulation.scene.geometry import Rectangle
from transientcam_driver.simulation.scene.scene import Scene

_ROUGH_PATCHES = 6  # a side, to judge how much light interreflection is about
_JUMP = 0.03  # of the range, from one pixel to the next: an edge
_WITHIN = tuple((x / 3, y / 3) for x in (-1, 0, 1) for y in (-1, 0, 1))
"""Rays of a pixel at an edge, right and down by these shares of a pixel."""
_WITHIN_MOVING = ((-0.25, -0.25), (0.25, 0.25))
"""The same where they are followed again and again, because the scene moves."""
_GLANCES = 5  # moments in time at which a moving scene is looked at to judge it

View = Callable[[float], "Seen"]
"""What there is to see at a time of the device; the same object as long as nothing changes."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What the camera sees: impulse responses, and how white the pixels' surfaces are."""

    responses: Responses
    reflectance: NDArray[np.float32] | np.float32


class Scenery(Protocol):
    """Something in front of the camera."""

    @property
    def moves(self) -> bool:
        """Whether it changes with time."""
        ...

    @property
    def glimpse(self) -> "Seen":
        """What there is to see at the start, without effects that take long."""
        ...

    @property
    def facts(self) -> Facts | None:
        """What effects judge it by; None if there is no geometry to judge."""
        ...

    def view(self, effects: frozenset[str]) -> View:
        """Prepare to look at it with these effects of light."""
        ...


class GivenScenery:
    """Impulse responses that are given, and stay."""

    moves = False
    facts = None

    def __init__(self, responses: Responses) -> None:
        self.glimpse = Seen(responses, np.float32(1))

    def view(self, effects: frozenset[str]) -> View:
        """Return what is given; no effect changes it."""
        return lambda _time_s: self.glimpse


class SurfaceScenery:
    """Surfaces, lit and seen."""

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
    def glimpse(self) -> Seen:
        """Direct light and mirrors."""
        return self._glimpse

    @property
    def facts(self) -> Facts:
        """What the scene is like, at several times if it moves."""
        return self._facts

    @cached_property
    def _glimpse(self) -> Seen:
        return self._see(self._scene.at(0.0), frozenset())

    @cached_property
    def _facts(self) -> Facts:
        if not self.moves:
            return _Glance(self._scene, self._lit(self._scene), self._width, self._height)
        period_s = max(motion.period_s for each in self._scene.surfaces for motion in each.motions)
        times_s = (np.arange(_GLANCES) + 0.5) / _GLANCES * period_s
        width, height = max(2, self._width // 3), max(2, self._height // 3)
        assert self._scene.camera is not None  # noqa: S101  (it was there above)
        rays = camera_rays(self._scene.camera, width=width, height=height)
        scenes = [self._scene.at(float(time_s)) for time_s in times_s]
        glances = [_Glance(s, light_rays(s, rays), width, height) for s in scenes]
        return _Glances(self._scene, glances)

    def view(self, effects: frozenset[str]) -> View:
        """Trace a still scene once, and a moving one whenever it is looked at."""
        scene = self._with(effects)
        if not self.moves:
            seen = self._see(scene, effects)
            return lambda _time_s: seen
        moving = MovingLight(scene, self._rays, width=self._width, height=self._height)
        last: list[tuple[float, Seen]] = []

        def view(time_s: float) -> Seen:
            tick_s = moving.tick_s(time_s)
            if not last or last[0][0] != tick_s:
                last[:] = [(tick_s, self._see_moving(moving.at(tick_s), effects))]
            return last[0][1]

        return view

    def _see_moving(self, now: MovingResponses, effects: frozenset[str]) -> Seen:
        size = {"width": self._width, "height": self._height}
        responses: Responses = now
        if MixedPixels.name in effects:
            responses = with_mixed_pixels(now.scene, now.distance_m, now, rays=_WITHIN_MOVING)
        if DiffuseInterreflection.name in effects:
            further = Interreflection(now.scene, now.lit, **size)
            responses = WithInterreflection(responses, further)
        return Seen(responses, now.reflectance.astype(np.float32))

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
        if forced:  # on, though the scene asks for none
            scene = replace(scene, transport=replace(scene.transport, diffuse_bounces=1))
        return scene

    def _lit(self, scene: Scene) -> Lit:
        """Trace; the scene as it is in its file only once."""
        if scene is not self._scene:
            return light_rays(scene, self._rays)
        if self._start is None:
            self._start = light_rays(scene, self._rays)
        return self._start

    def _see(self, scene: Scene, effects: frozenset[str]) -> Seen:
        lit = self._lit(scene)
        width, height = self._width, self._height
        responses: Responses = sparse(scene, lit, width=width, height=height)
        if MixedPixels.name in effects:
            distance_m = lit.distance_m.reshape(height, width)
            responses = with_mixed_pixels(scene, distance_m, responses, rays=_WITHIN)
        if DiffuseInterreflection.name in effects:
            further = Interreflection(scene, lit, width=width, height=height)
            responses = WithInterreflection(responses, further)
        reflectance = lit.reflectance.astype(np.float32).reshape(height, width)
        return Seen(responses, reflectance)


class WithInterreflection:
    """Returns by direct light and mirrors, and what surfaces give each other."""

    kind: Literal["sparse", "dense"] = "dense"

    def __init__(self, direct: Responses, further: Interreflection) -> None:
        self._direct = direct
        self._further = further

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Sum of both."""
        return self._direct.moments(frequency_hz) + self._further.moments(frequency_hz)

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the direct returns, and one for all the rest at its mean delay."""
        delay_s, weight = self._direct.returns()
        mean_s, rest = self._further.returns
        mean_s = np.where(rest > 0, mean_s, np.nan)
        delay_s, weight = (
            np.concatenate([delay_s, mean_s[None]]),
            np.concatenate([weight, rest[None]]),
        )
        order = np.argsort(delay_s, axis=0)  # NaN goes last
        return np.take_along_axis(delay_s, order, 0), np.take_along_axis(weight, order, 0)

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Density per s over equal bins; a sharp return fills one bin."""
        _, rest = self._further.returns
        start_s, mass = self._further.of_pixel(x, y, weight=float(rest[y, x]))
        time_s, value = self._direct.of_pixel(x, y)
        if self._direct.kind == "dense":
            value = value * BIN_S
        if not time_s.size and not mass.any():
            return start_s + BIN_S * np.array([0.5]), np.zeros(1)
        first_s = min([start_s] if mass.any() else [], default=np.inf)
        first_s = min(first_s, float(time_s.min()) - BIN_S / 2 if time_s.size else np.inf)
        into = np.rint((time_s - first_s) / BIN_S - 0.5).astype(int)
        shift = round((start_s - first_s) / BIN_S) if mass.any() else 0
        bins = np.zeros(max(int(into.max(initial=0)) + 1, shift + len(mass)))
        bins[shift : shift + len(mass)] += mass
        np.add.at(bins, into, value)
        time_s = np.float64(first_s) + BIN_S * (np.arange(len(bins), dtype=np.float64) + 0.5)
        return np.asarray(time_s, dtype=np.float64), bins / BIN_S


class WithMixedPixels:
    """Responses some of whose pixels are replaced by the mean over several rays.

    Parameters
    ----------
    base
        The responses of all pixels.
    at
        Rows and columns of those to replace.
    lit, scatter
        What the rays see: for each place in a pixel, all of these pixels.
    """

    def __init__(
        self,
        base: Responses,
        at: tuple[NDArray[np.intp], NDArray[np.intp]],
        lit: Lit,
        scatter: Scatter | None,
    ) -> None:
        self._base = base
        self._at = at
        self._lit = lit
        self._scatter = scatter

    @property
    def kind(self) -> Literal["sparse", "dense"]:
        """As that of the base."""
        return self._base.kind

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Those of the base, but for the pixels replaced."""
        moments = self._base.moments(frequency_hz)
        of_rays = self._lit.moments(frequency_hz, self._scatter).reshape(-1, len(self._at[0]))
        moments[self._at] = of_rays.mean(axis=0)
        return moments

    @cached_property
    def _mixed(self) -> SparseResponses:
        """The pixels replaced, as an image of one row: a plane for each ray and path."""
        count = len(self._at[0])
        paths, rays = len(self._lit.weight), self._lit.weight.shape[1] // count
        scatter = self._scatter
        if scatter is not None:
            scatter = Scatter(
                np.tile(scatter.width_s.reshape(rays, count), (paths, 1))[:, None],
                np.tile(scatter.decay_s.reshape(rays, count), (paths, 1))[:, None],
            )
        planes = (-1, 1, count)
        delay_s, weight = self._lit.delay_s.reshape(planes), self._lit.weight.reshape(planes)
        return SparseResponses(delay_s, weight / rays, scatter)

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """All returns; as many planes as the pixel with the most returns needs."""
        delay_s, weight = self._base.returns()
        more_s, more = self._mixed.returns()
        there = max(len(delay_s), int(np.sum(more > 0, axis=0).max(initial=0)))
        shape = (there, *delay_s.shape[1:])
        all_s, all_weight = np.full(shape, np.nan), np.zeros(shape)
        all_s[: len(delay_s)], all_weight[: len(weight)] = delay_s, weight
        rows, columns = self._at
        all_s[:, rows, columns], all_weight[:, rows, columns] = np.nan, 0.0
        several = min(there, len(more_s))
        all_s[:several, rows, columns] = more_s[:several, 0]
        all_weight[:several, rows, columns] = more[:several, 0]
        return all_s, all_weight

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return that of the base, or of the rays in a pixel that is replaced."""
        mine = np.flatnonzero((self._at[0] == y) & (self._at[1] == x))
        return self._mixed.of_pixel(int(mine[0]), 0) if mine.size else self._base.of_pixel(x, y)


def with_mixed_pixels(
    scene: Scene,
    distance_m: NDArray[np.float64],
    responses: Responses,
    *,
    rays: tuple[tuple[float, float], ...],
) -> Responses:
    """Replace pixels at edges by the mean over several rays in them."""
    height, width = distance_m.shape
    rows, columns = np.nonzero(edges(distance_m)[0])
    if not rows.size:
        return responses
    assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
    # ray by ray over the places in a pixel, then pixel by pixel
    right, down = np.array(rays).T[:, :, None]
    through = rays_through(
        scene.camera, (columns + right).ravel(), (rows + down).ravel(), width=width, height=height
    )
    fine = light_rays(scene, through)
    return WithMixedPixels(responses, (rows, columns), fine, fine.scatter(scene))


def edges(distance_m: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Pixels (H, W) at a jump of range, and the steps in m; 0 m means that a pixel sees nothing."""
    edge = np.zeros(distance_m.shape, dtype=bool)
    steps: list[NDArray[np.float64]] = []
    for axis in (0, 1):
        near = np.take(distance_m, range(distance_m.shape[axis] - 1), axis)
        far = np.take(distance_m, range(1, distance_m.shape[axis]), axis)
        step = np.abs(near - far)
        jump = (step > _JUMP * np.minimum(near, far)) & (near > 0) & (far > 0)
        steps.append(step[jump])
        first = [slice(None)] * 2
        second = [slice(None)] * 2
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        edge[tuple(first)] |= jump
        edge[tuple(second)] |= jump
    return edge, np.concatenate(steps)


class _Glance:
    """What a scene that stands still is like."""

    speed_m_s = 0.0
    moving_share = 0.0

    def __init__(self, scene: Scene, lit: Lit, width: int, height: int) -> None:
        self._scene = scene
        self._lit = lit
        self._width, self._height = width, height

    @cached_property
    def brightness(self) -> float:
        """All light but that of interreflection."""
        return float(self._lit.weight.sum())

    @property
    def mirror_share(self) -> float:
        if not self.brightness:
            return 0.0
        return float(self._lit.weight[1:].sum() / self.brightness)

    @property
    def indirect_share(self) -> float:
        return self._indirect_share

    @cached_property
    def _indirect_share(self) -> float:
        transport = self._scene.transport
        scattering = [each for each in self._scene.surfaces if each.scatters]
        flat = len(scattering) == 1 and isinstance(scattering[0].shape, Rectangle)
        if flat or not scattering or not transport.diffuse_bounces or not self.brightness:
            return 0.0
        rough = replace(transport, patches=min(_ROUGH_PATCHES, transport.patches))
        scene = replace(self._scene, transport=rough)
        further = Interreflection(scene, self._lit, width=self._width, height=self._height)
        indirect = float(further.moments(0.0).real.sum())
        return indirect / (indirect + self.brightness)

    @property
    def _depths(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        scatter = self._lit.scatter(self._scene)
        none = np.zeros(len(self._lit.surface))
        return (none, none) if scatter is None else (scatter.width_s, scatter.decay_s)

    @property
    def scatter(self) -> Scatter | None:
        width_s, decay_s = self._depths
        slowest = int(decay_s.argmax())
        return Scatter(width_s[slowest], decay_s[slowest]) if decay_s[slowest] else None

    @property
    def scatter_share(self) -> float:
        return float(np.mean(self._depths[1] > 0))

    @property
    def edges(self) -> tuple[float, float]:
        return self._edges

    @cached_property
    def _edges(self) -> tuple[float, float]:
        edge, steps = edges(self._lit.distance_m.reshape(self._height, self._width))
        return float(edge.mean()), float(np.sqrt(np.mean(steps**2))) if steps.size else 0.0

    @property
    def surface(self) -> NDArray[np.intp]:
        """What the rays see."""
        return self._lit.surface


class _Glances:
    """What a scene is like over time."""

    def __init__(self, scene: Scene, glances: list[_Glance]) -> None:
        self._scene = scene
        self._glances = glances

    def _mean(self, values: list[float]) -> float:
        return float(np.mean(values))

    @property
    def mirror_share(self) -> float:
        return self._mean([glance.mirror_share for glance in self._glances])

    @property
    def indirect_share(self) -> float:
        return self._indirect_share

    @cached_property
    def _indirect_share(self) -> float:
        return self._mean([glance.indirect_share for glance in self._glances])

    @property
    def scatter(self) -> Scatter | None:
        found = [glance.scatter for glance in self._glances if glance.scatter is not None]
        return max(found, key=lambda scatter: float(scatter.decay_s), default=None)

    @property
    def scatter_share(self) -> float:
        return self._mean([glance.scatter_share for glance in self._glances])

    @property
    def edges(self) -> tuple[float, float]:
        shares, steps = zip(*(glance.edges for glance in self._glances), strict=True)
        # glanced at with a third of the pixels a side: an edge is three times as many then
        return float(np.mean(shares)) / 3, float(max(steps))

    @property
    def speed_m_s(self) -> float:
        return max(
            sum(motion.speed_m_s for motion in each.motions) for each in self._scene.surfaces
        )

    @property
    def moving_share(self) -> float:
        moving = [index for index, each in enumerate(self._scene.surfaces) if each.motions]
        return self._mean([float(np.isin(g.surface, moving).mean()) for g in self._glances])
