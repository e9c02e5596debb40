"""How far each effect moves the light of a scene, still or over its life: by leaving it out."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.base import PINHOLE
from transientcam_simulation.effects import Glimpse, Noise, Values
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._further_light import FurtherLight
from transientcam_simulation.light._missing import SampledWays, sampled_glimpses
from transientcam_simulation.light._paths import Lit, camera_of, light_rays
from transientcam_simulation.light._radiosity import Gathering, Interreflection
from transientcam_simulation.light._rays import places_within, rays_through
from transientcam_simulation.light._recent import Recent
from transientcam_simulation.light._subpixel import PIXELS, may_be_thin
from transientcam_simulation.light._variants import without_glass, without_gloss, without_mirrors
from transientcam_simulation.scene import (
    Points,
    Rectangle,
    Scene,
    Surface,
    Viewpoint,
    patch_edges_m,
)

_PIXELS = 20_000  # judged of a still scene, about; of larger images every second pixel a side, ...
_PIXELS_MOVING = 1_500  # the same at each time
_TIMES = 8  # of the longest period, at which a moving scene is judged
_WITHIN = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))  # of a pixel
_WITHIN_AT_THIN = 16  # places, where something may be so thin that these four miss it
_FREQUENCIES = 8  # judged at most; the highest one always
_ROUNDING = 1e-9
_KEPT = 32  # changes by effects, for the last few sequences
_RESOLUTIONS = tuple((per_side, reach) for per_side in (6, 9, 13, 18) for reach in (1.0, 0.5))
"""Patches a side, and their edges that anything moves in a step, where these are fine enough."""
_BEYOND, _OFF = 0.01, 0.4  # of the pixels, which coarser patches may put off by this much noise
PAIR_S, TURNED_S = 3e-7, 3e-8  # processor time: of two patches, and of a moment between them, ...
STILL_S, MOVING_S = 2e-8, 3e-8  # and of a moment on a pixel of what stands still, and moves
_ROUGH_PATCHES = 6  # a side, to estimate interreflection
_ROUGH_LOBE_RAYS = 8
_ROUGH_ERROR = 1.5  # by which that may be too low


@dataclass(frozen=True)
class _SampledView:
    """Rays into pixels at one time, one or several a pixel, and the light that they see.

    ``sharp``: as if no surface let light in.
    """

    scene: Scene
    lits: tuple[Lit, ...]
    sharp: bool = False

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Means over the rays of each pixel."""
        total = np.zeros(len(self.lits[0].surface), dtype=np.complex128)
        for lit in self.lits:
            total += lit.moments(frequency_hz, None if self.sharp else lit.scatter(self.scene))
        mean: NDArray[np.complex128] = total / len(self.lits)
        return mean


class SceneFacts:
    """Of a scene of surfaces before a camera of so many pixels."""

    def __init__(self, scene: Scene, *, width: int, height: int) -> None:
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        self._camera = scene.camera
        self._scene = scene
        self._size = width, height
        pixels = _PIXELS_MOVING if scene.moves else _PIXELS
        self._stride = stride = max(1, math.floor(math.sqrt(width * height / pixels)))
        columns, rows = np.meshgrid(
            np.arange(stride // 2, width, stride), np.arange(stride // 2, height, stride)
        )
        self._shape = rows.shape
        self._rows, self._columns = rows.ravel(), columns.ravel()
        self._times_s: tuple[float, ...] = (0.0,)
        motions = [*scene.carriers, *(each for of in scene.surfaces for each in of.motions)]
        self._period_s = max((each.period_s for each in motions), default=0.0)
        if scene.moves:
            self._times_s = tuple((k + 0.5) / _TIMES * self._period_s for k in range(_TIMES))
        self._found: Recent[tuple[str, tuple[float, ...], float], tuple[Values, ...]]
        self._found = Recent(_KEPT)
        self._left_out: dict[str, list[list[_SampledView]]] = {}
        self._rough = min(_ROUGH_PATCHES, scene.transport.patches)
        self._errors: dict[tuple[int, float], Values] = {}
        self._in_full: dict[int, Values] = {}  # what moves changes of it, by time

    @property
    def glimpses(self) -> tuple[Glimpse, ...]:
        """Direct light and mirrors on the pixels judged."""
        return self._glimpses

    @cached_property
    def _glimpses(self) -> tuple[Glimpse, ...]:
        cosine = cosine_to_axis(self._camera, self._rays(self._camera))
        return tuple(
            Glimpse(each.lits[0].weight.sum(axis=0), each.lits[0].shown, cosine, self._shape)
            for each in self._seen
        )

    def changes(
        self, effect: str, frequencies_hz: tuple[float, ...], *, during_s: float = 0.0
    ) -> tuple[Values, ...]:
        """Return how far leaving out an effect moves each pixel's moments, at most, by time."""
        if effect == "interreflection":
            return self._further_light
        if effect == "blur":
            return self._blurred(frequencies_hz, during_s)
        key = effect, _some(frequencies_hz), during_s if effect == "motion" else 0.0
        return self._found.get(key, lambda: self._changes(*key))

    def missing(
        self, kind: str, frequencies_hz: tuple[float, ...]
    ) -> tuple[tuple[Glimpse, ...], tuple[Values, ...]]:
        """Return some pixels, and how far their moments lack light of a kind, at most, by time."""
        if kind == "coarse-patches" and self._scene.moves:
            return (), ()
        ways, glimpses = self._sampled
        some = _some(frequencies_hz)
        return glimpses, self._found.get(
            (kind, some, 0.0), lambda: tuple(each.change(kind, some) for each in ways)
        )

    @cached_property
    def _sampled(self) -> tuple[tuple[SampledWays, ...], tuple[Glimpse, ...]]:
        scenes = tuple(each.scene for each in self._seen)
        rays = [self._rays(camera_of(scene)) for scene in scenes]
        return sampled_glimpses(scenes, rays, self.glimpses, moves=self._scene.moves)

    def further_bounces(self, tolerance: float) -> int:
        """Return how often light goes from surface to surface until less than this is left."""
        return self._rough_exchange.bounces(tolerance)

    @cached_property
    def _rough_exchange(self) -> Exchange:
        return self._exchange(self._scene.at(self._times_s[0]), self._rough)

    def _exchange(self, scene: Scene, per_side: int) -> Exchange:
        """Find light between surfaces, over mirrors only where nothing moves."""
        return Exchange.of(scene, per_side, mirrors=not self._scene.moves)

    def _changes(
        self, effect: str, frequencies_hz: tuple[float, ...], during_s: float
    ) -> tuple[Values, ...]:
        scene, look = self._scene, self._look
        glossy = any(each.gloss for each in scene.surfaces)
        scatters = any(each.scatter for each in scene.surfaces)
        variants: dict[str, tuple[bool, Callable[[_SampledView], _SampledView]]] = {
            "mirror-paths": (bool(scene.mirrors), lambda at: look(without_mirrors(at.scene))),
            "glass": (bool(scene.panes), lambda at: look(without_glass(at.scene))),
            "gloss": (glossy, lambda at: look(without_gloss(at.scene))),
            "scattering": (scatters, lambda at: replace(at, sharp=True)),
            "mixed-pixels": (True, lambda at: look(at.scene, self._within)),
            "distortion": (self._camera.lens.bends, lambda at: look(_straight(at.scene))),
        }
        if effect == "motion":  # which depends on the sequence
            return self._moved(frequencies_hz, during_s) if self._scene.moves else ()
        happens, other = variants[effect]
        if not happens:
            return ()
        if effect not in self._left_out:
            self._left_out[effect] = [[other(each) for each in self._seen]]
        apart = self._apart(self._left_out[effect], frequencies_hz)
        if effect == "gloss" and not self._scene.moves and self._further_light:
            seen, (direct,) = self._seen[0], apart
            matt = replace(seen, scene=without_gloss(seen.scene))
            shown = self._further_light[0] - _ROUGH_ERROR * self._further(matt, self._rough)
            return (np.maximum(direct, np.abs(shown)),)
        return apart

    def _moved(self, frequencies_hz: tuple[float, ...], during_s: float) -> tuple[Values, ...]:
        """Return how far moments of each pixel change within a time, at most.

        An edge that moves by less than judged pixels are apart may pass none of their centres. Its
        contrast is then found over a longer time, and counts by the part of a pixel that it moves.
        """
        apart = self._apart([self._later(part * during_s) for part in (0.5, 1.0)], frequencies_hz)
        moved = self.pixels_per_s * during_s
        if not 0 < moved < self._stride:
            return apart
        longer_s = min(during_s * self._stride / moved, self._period_s / _TIMES)
        swept = self._apart([self._later(longer_s)], frequencies_hz)
        return tuple(
            np.maximum(one, min(1.0, moved) * other)
            for one, other in zip(apart, swept, strict=True)
        )

    def _blurred(self, frequencies_hz: tuple[float, ...], during_s: float) -> tuple[Values, ...]:
        """Return how far the mean over an exposure is from the light at its middle.

        An edge that moves evenly within a pixel has its mean share there in the middle; one that
        only then comes into it differs by an eighth of the pixels that it moves, up to half. This
        is the root mean square over the places where an edge may be.
        """
        moved = self.pixels_per_s * during_s
        if not moved:
            return ()
        over_s = max(during_s, min(during_s / moved, self._period_s / _TIMES))  # the whole contrast
        part = (1 - 1 / moved) / 2 if moved > 2 else max(moved, 1.0) / 8 * during_s / over_s
        part *= math.sqrt(min(moved, 1.0) / 5)
        changes = self.changes("motion", frequencies_hz, during_s=over_s)
        return tuple(part * each for each in changes)

    def _later(self, by_s: float) -> list[_SampledView]:
        return [self._look(self._scene.at(t + by_s)) for t in self._times_s]

    @property
    def too_thin(self) -> tuple[str, ...]:
        """Names of surfaces that move and may be thinner than a pixel."""
        return tuple(each.name for each in self._thin(1.0) if each.motions)

    @cached_property
    def _within(self) -> tuple[tuple[float, float], ...]:
        """Places in a pixel at which light is looked for that differs."""
        if not self._thin(PIXELS):
            return _WITHIN
        right, down = places_within(_WITHIN_AT_THIN)
        return tuple(zip(right.tolist(), down.tolist(), strict=True))

    def _thin(self, pixels: float) -> list[Surface]:
        """Surfaces that may be thinner than so many pixels, seen by camera or light."""
        return [
            each
            for k, each in enumerate(self._scene.surfaces)
            if each.opaque is None
            and any(
                may_be_thin(
                    there.surfaces[k].shape, apex, self._pixel_rad, pixels=pixels, aslant=False
                )
                for there in map(self._scene.at, self._times_s)
                for apex in (camera_of(there).position_m, there.light.position_m)
            )
        ]

    @property
    def _pixel_rad(self) -> float:
        return math.radians(self._camera.field_of_view_deg) / self._size[0]

    @property
    def carried_past(self) -> int:
        """How many surfaces a camera or a lamp that moves is carried past; 0 where none does."""
        return len(self._scene.surfaces) if self._scene.carriers else 0

    @property
    def pixels_per_s(self) -> float:
        """Highest speed of any surface, at the place where it stands, in pixels; or of the view."""
        speeds, carriers = [0.0], self._scene.carriers
        for each in self._scene.surfaces:
            away_m = np.linalg.norm(each.shape.extent() - self._camera.position_m, axis=-1).min()
            speed_m_s = each.speed_m_s + sum(motion.speed_m_s for motion in carriers)
            speeds.append(speed_m_s / (self._pixel_rad * max(float(away_m), 1e-3)))
        return max(speeds) + sum(motion.turn_rad_s for motion in carriers) / self._pixel_rad

    @cached_property
    def _seen(self) -> list[_SampledView]:
        return [self._look(self._scene.at(time_s)) for time_s in self._times_s]

    def _look(
        self, scene: Scene, places: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    ) -> _SampledView:
        """Follow rays through places in the pixels judged, from their centres."""
        rays = np.concatenate([self._rays(camera_of(scene), at) for at in places])
        lit, count = light_rays(scene, rays), len(self._rows)
        return _SampledView(
            scene, tuple(lit.part(slice(k, k + count)) for k in range(0, len(rays), count))
        )

    def _rays(self, camera: Viewpoint, at: tuple[float, float] = (0.0, 0.0)) -> Points:
        width, height = self._size
        return rays_through(
            camera, self._columns + at[0], self._rows + at[1], width=width, height=height
        )

    def _apart(
        self, others: list[list[_SampledView]], frequencies_hz: tuple[float, ...]
    ) -> tuple[Values, ...]:
        """Return the largest difference of moments from those of several variants."""
        apart = tuple(np.zeros(len(self._rows)) for _ in self._seen)
        for frequency_hz in frequencies_hz:
            for k, one in enumerate(self._seen):
                moments = one.moments(frequency_hz)
                for other in others:
                    change = np.abs(moments - other[k].moments(frequency_hz))
                    # what rounding alone makes is no change
                    change[change < _ROUNDING * np.abs(moments)] = 0
                    np.maximum(apart[k], change, out=apart[k])
        return apart

    def further_cost_s(self, noise: Noise, *, moments: int, image_period_s: float) -> float:
        """Return what light over several surfaces costs in each image where they move."""
        if not self._scene.moves:
            return 0.0
        per_side, reach = self.resolution(noise)
        light = FurtherLight(self._scene, per_side=per_side, reach=reach)
        solved = min(2.0, image_period_s / light.step_s)
        moves = np.array([bool(each.motions) for each in self._scene.surfaces] + [False])
        shown = np.mean([moves[each.lits[0].surface].mean() for each in self._seen])
        gathered = moments * min(1.0, image_period_s / light.held_s)
        of_pixel_s = gathered * STILL_S + 2 * shown * MOVING_S
        of_pair_s = solved * (PAIR_S + moments * TURNED_S)
        width, height = self._size
        return len(light.patches) ** 2 * of_pair_s + width * height * float(of_pixel_s)

    def resolution(self, noise: Noise) -> tuple[int, float]:
        """Return how finely surfaces must be cut for few pixels to be off where some move.

        Patches a side, and how many of their edges anything may move from one solution to the next.
        """
        light, most = self._further_light, self._scene.transport.patches
        if not light:
            return most, _RESOLUTIONS[-1][1]
        when = int(np.argmax([each.sum() for each in light]))
        glimpse = self.glimpses[when]
        limit = _OFF * noise.deviation(glimpse.brightness, glimpse.reflectance)
        if np.mean(light[when] > limit) < _BEYOND:  # whatever its error
            return min(_RESOLUTIONS[0][0], most), _RESOLUTIONS[0][1]
        for per_side, reach in (each for each in _RESOLUTIONS if each[0] < most):
            if np.mean(self._error(per_side, reach, when) > limit) < _BEYOND:
                return per_side, reach
        return most, _RESOLUTIONS[-1][1]

    def _error(self, per_side: int, reach: float, when: int) -> Values:
        """Return how far coarser patches put off the brightness, in the middle of a step."""
        key = per_side, reach
        if key not in self._errors:
            seen = self._seen[when]
            light = FurtherLight(self._scene, per_side=per_side, reach=reach)
            around_s = (self._times_s[when] + by * light.step_s for by in (-0.5, 0.5))
            one, other = (light.solution(time_s, 0.0) for time_s in around_s)
            # of a step, that light which stands is off, on average
            late = light.held_s / light.step_s / 4
            ends = Gathering(seen.scene, light.patches, seen.lits[0])
            change = (0.5 - late) * one + (0.5 + late) * other - light.without_movers(0.0)
            if when not in self._in_full:
                self._in_full[when] = self._further(seen, self._scene.transport.patches)
                fine = Gathering(seen.scene, self._finest.patches, seen.lits[0])
                self._in_full[when] -= fine.moments(self._finest.without_movers(0.0), 0.0).real
            self._errors[key] = np.abs(ends.moments(change, 0.0) - self._in_full[when])
        return self._errors[key]

    @cached_property
    def _finest(self) -> FurtherLight:
        return FurtherLight(self._scene, per_side=self._scene.transport.patches)

    def _further(self, seen: _SampledView, per_side: int) -> Values:
        """Return the brightness of light over several surfaces."""
        exchange, (height, width) = self._exchange(seen.scene, per_side), self._shape
        light = Interreflection(
            seen.scene,
            seen.lits[0],
            width=width,
            height=height,
            exchange=exchange,
            rays=None if self._scene.moves else self._rays(self._camera),
            lobe_rays=_ROUGH_LOBE_RAYS,
        )
        brightness: Values = light.moments(0.0).real.ravel()
        return brightness

    @cached_property
    def _further_light(self) -> tuple[Values, ...]:
        """Estimate the brightness of light over several surfaces, which bounds its moments."""
        transport = self._scene.transport
        scattering = [self._scene.surfaces[k].shape for k in patch_edges_m(self._scene, 1)]
        flat = len(scattering) == 1 and isinstance(scattering[0], Rectangle)
        flat = flat and not self._scene.mirrors
        if flat or not scattering or transport.diffuse_bounces == 0:
            return ()
        return tuple(_ROUGH_ERROR * self._further(each, self._rough) for each in self._seen)


def _some(frequencies_hz: tuple[float, ...]) -> tuple[float, ...]:
    """Choose a few of many frequencies, evenly, up to the highest."""
    step = math.ceil(len(frequencies_hz) / _FREQUENCIES)
    return tuple(sorted(frequencies_hz)[::-1][::step])


def cosine_to_axis(camera: Viewpoint, rays: Points) -> Values:
    """Return the cosine of each ray's angle to the axis of the lens."""
    half_width = math.tan(math.radians(camera.field_of_view_deg) / 2)
    (x, y), (right, down, forward) = camera.lens.centre, camera.axes
    axis = forward + 2 * half_width * (x * right + y * down)
    cosine: Values = rays @ (axis / np.linalg.norm(axis))
    return cosine


def _straight(scene: Scene) -> Scene:
    return replace(scene, camera=replace(camera_of(scene), lens=PINHOLE))
