"""Light that patches of surfaces give each other, with its times of flight."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.base import BIN_S, Scatter, ask
from transientcam_simulation.light._over_gloss import NO_GLOW, Glow, between_patches
from transientcam_simulation.light._over_mirrors import NOTHING, OverMirrors
from transientcam_simulation.light._patches import Patches, form_factors
from transientcam_simulation.light._paths import image_lights, light_on, normals_at, scatter_of
from transientcam_simulation.scene import Points, Scene

_MOST_BOUNCES = 200  # in a room of white walls light is followed no further
_HISTORY_BOUNCES = 4
_HISTORY_LEFT = 0.02  # of the highest radiosity
_SAMPLES = 3  # a side, of the direct light on a patch: its edge may cross the patch


@dataclass(frozen=True)
class Exchange:
    """Light between the patches of a scene.

    ``factors``, ``distance_m``: (N, N) form factors, receivers first, and distances.
    ``delay_s``, ``radiosity``: (K, N, S) direct light on S samples of each patch by each chain of
    mirrors, and what it gives on.
    ``over_mirrors``, ``over_gloss``: what mirrors and glossy surfaces show patches of each other,
    and ``glow`` what these show them of the lamp.
    """

    scene: Scene
    patches: Patches
    factors: NDArray[np.float32]
    distance_m: NDArray[np.float32]
    delay_s: NDArray[np.float64]
    radiosity: NDArray[np.float64]
    over_mirrors: OverMirrors = NOTHING
    over_gloss: OverMirrors = NOTHING
    glow: Glow = NO_GLOW

    @classmethod
    def of(cls, scene: Scene, per_side: int, *, mirrors: bool = False) -> "Exchange":
        """Cut surfaces into patches, and find the light between them: see `between`."""
        return cls.between(scene, Patches.of(scene, per_side), mirrors=mirrors)

    @classmethod
    def between(
        cls, scene: Scene, patches: Patches, *, mirrors: bool = False, moves: bool = True
    ) -> "Exchange":
        """Compute form factors and distances between patches, and the direct light on each.

        ``mirrors``: also of what patches see of each other in mirrors and by gloss. ``moves``:
        patches count as seen or hidden by their middles, which takes less time.
        """
        factors = form_factors(scene, patches, patches.centre, patches.normal, shares=not moves)
        squared = np.maximum(
            np.sum(patches.centre**2, 1)[:, None]
            + np.sum(patches.centre**2, 1)
            - 2 * patches.centre @ patches.centre.T,
            0,
        )
        delay_s, radiosity = _direct(scene, patches)
        exchange = cls(
            scene,
            patches,
            factors.astype(np.float32),
            np.sqrt(squared).astype(np.float32),
            delay_s,
            radiosity,
        )
        return exchange.with_reflections() if mirrors else exchange

    def with_reflections(self) -> "Exchange":
        """Add light over mirrors and by gloss, which what moves has none of."""
        scene, patches = self.scene, self.patches
        over_mirrors = OverMirrors.of(scene, patches)
        if not any(each.gloss for each in scene.surfaces):
            return replace(self, over_mirrors=over_mirrors)
        return replace(
            self,
            over_mirrors=over_mirrors,
            over_gloss=between_patches(scene, patches),
            glow=Glow.of(scene, patches),
        )

    def bounces(self, tolerance: float) -> int:
        """Return how often light is followed from patch to patch.

        As the scene says; or until all that is left, at the rate at which it falls from bounce to
        bounce, gives no patch more than ``tolerance`` of radiosity. The bound holds at every
        frequency, as no moment exceeds the zeroth.
        """
        if self.scene.transport.diffuse_bounces is not None:
            return self.scene.transport.diffuse_bounces
        light = self.radiosity.sum(axis=(0, 2))
        highest = [float(light.max(initial=0.0))]
        for bounce in range(_MOST_BOUNCES):
            ask()
            got = self.factors @ light.astype(np.float32)
            got = got + self.over_mirrors.irradiance(light, 0.0).real
            got = got + self.over_gloss.irradiance(light, 0.0).real
            if bounce == 0:
                got = got + self.glow.irradiance(0.0, len(self.patches)).real
            light = self.patches.albedo * got
            highest.append(float(light.max(initial=0.0)))
            share = min(highest[-1] / highest[-2], 0.999) if highest[-2] else 0.0
            if highest[-1] / (1 - share) <= tolerance:
                return bounce
        return _MOST_BOUNCES

    def irradiance(self, frequency_hz: float, bounces: int) -> NDArray[np.complex128]:
        """Moments (N) of the light that patches get from each other, over some bounces."""
        omega = 2 * np.pi * frequency_hz
        scatter = scatter_of(self.scene, self.patches.surface)
        transfer = 1.0 if scatter is None else scatter.transfer(frequency_hz)
        light = np.einsum("kns,kns->n", self.radiosity, np.exp(1j * omega * self.delay_s))
        ask()
        phase = np.float32(omega / SPEED_OF_LIGHT_M_S) * self.distance_m
        in_phase, quadrature = self.factors * np.cos(phase), self.factors * np.sin(phase)
        self.over_mirrors.add(in_phase, quadrature, frequency_hz)
        total = np.zeros(len(self.patches), dtype=np.complex128)
        before = np.zeros(len(self.patches), dtype=np.complex64)
        for bounce in range(bounces):
            ask()
            given = (light * transfer).astype(np.complex64)
            of_real, of_imag = given.real.copy(), given.imag.copy()
            got = (in_phase @ of_real - quadrature @ of_imag) + 1j * (
                in_phase @ of_imag + quadrature @ of_real
            )
            # light over a glossy surface has met one surface more
            got = got + self.over_gloss.irradiance(before, frequency_hz)
            if bounce == 0:
                got = got + self.glow.irradiance(frequency_hz, len(self.patches))
            total += got
            light, before = self.patches.albedo * got, given
        return total

    @cached_property
    def history(self) -> tuple[float, NDArray[np.float64]]:
        """Irradiance (N, T) over time in bins of ``BIN_S``, and the time of the first bin's start.

        Of the first bounces only; the caller scales it to the light of all. Light is moved by
        whole bins, so that each bounce is off by half a bin at most.
        """
        straight, over = np.nonzero(self.factors), self.over_mirrors
        to, by = np.append(straight[0], over.to), np.append(straight[1], over.by)
        factors = np.append(self.factors[straight], over.factors)
        far_m = np.append(self.distance_m[straight], over.distance_m)
        shift = np.rint(far_m / (SPEED_OF_LIGHT_M_S * BIN_S)).astype(np.intp)
        scatter = scatter_of(self.scene, self.patches.surface)
        first_s = float(self.delay_s[self.radiosity > 0].min(initial=1.0))
        placed = np.rint((self.delay_s - first_s) / BIN_S).astype(np.intp)
        placed[self.radiosity <= 0] = 0
        bounces = min(
            _HISTORY_BOUNCES,
            self.bounces(_HISTORY_LEFT * float(self.radiosity.sum(axis=2).max(initial=0.0))),
        )
        tail = 0
        if scatter is not None:
            tail = int((8 * scatter.width_s.max() + 12 * scatter.decay_s.max()) / BIN_S) + 1
        count = int(placed.max()) + bounces * (int(shift.max(initial=0)) + tail) + 1
        patches = len(self.patches)
        light = np.zeros((patches, count))
        index = np.broadcast_to(np.arange(patches)[None, :, None], placed.shape)
        np.add.at(light, (index.ravel(), placed.ravel()), self.radiosity.ravel())
        total = np.zeros_like(light)
        for _bounce in range(bounces):
            got = np.zeros_like(light)
            last = np.flatnonzero(light.any(axis=0)).max(initial=0) + 1
            for q in range(patches):
                given = light[q, :last]
                if not given.any():
                    continue
                if scatter is not None:
                    given = _spread(given, scatter.width_s[q], scatter.decay_s[q], tail)
                for k in np.flatnonzero(by == q):
                    at = shift[k]
                    got[to[k], at : at + len(given)] += (factors[k] * given)[: count - at]
            total += got
            light = self.patches.albedo[:, None] * got
        return first_s - BIN_S / 2, total


def _spread(
    given: NDArray[np.float64], width_s: float, decay_s: float, tail: int
) -> NDArray[np.float64]:
    if not width_s and not decay_s:
        return given
    edges_s = BIN_S * (np.arange(tail + 1) - 0.5)
    return np.convolve(given, np.diff(Scatter(width_s, decay_s).cumulated(edges_s)))


def _direct(scene: Scene, patches: Patches) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Direct light on samples of each patch, as the share of the patch's radiosity it makes."""
    points = patches.places(_SAMPLES).reshape(-1, 3)
    surface = np.repeat(patches.surface, _SAMPLES**2)
    points = _onto(scene, points, surface)
    normal = normals_at(scene, points, surface)
    lights = tuple(image_lights(scene))
    shape = (len(lights), len(patches), _SAMPLES**2)
    delay_s, radiosity = np.zeros(shape), np.zeros(shape)
    for k, light in enumerate(lights):
        ask()
        length_m, irradiance = light_on(scene, light, points, normal)
        delay_s[k] = length_m.reshape(shape[1:]) / SPEED_OF_LIGHT_M_S
        radiosity[k] = irradiance.reshape(shape[1:]) * patches.albedo[:, None] / _SAMPLES**2
    return delay_s, radiosity


def _onto(scene: Scene, points: Points, surface: NDArray[np.intp]) -> Points:
    """Move points of flat patches out to the curved surface they stand for."""
    points = points.copy()
    for index in np.unique(surface):
        shape = scene.surfaces[index].shape
        if hasattr(shape, "radii"):
            mine = surface == index
            on_unit = (points[mine] - shape.centre) / shape.radii
            on_unit /= np.linalg.norm(on_unit, axis=-1, keepdims=True)
            points[mine] = shape.centre + on_unit * shape.radii
    return points
