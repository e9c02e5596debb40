"""Diffuse interreflection: light that goes from surface to surface before the camera sees it.

Radiosity with times of flight. Surfaces are cut into patches; at each frequency a patch's
irradiance is a complex moment, and light on its way from patch to patch turns it by its time of
flight. Moments are therefore sums over all paths between patches, at exactly the frequencies
requested; nothing is binned.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.base import BIN_S, Responses
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._followed import Within
from transientcam_simulation.light._over_gloss import LOBE_RAYS, ShownByGloss
from transientcam_simulation.light._patches import Patches
from transientcam_simulation.light._paths import Lit, scatter_of
from transientcam_simulation.light._rays import rays_within
from transientcam_simulation.scene import Bilinear, Points, Scene

_CENTROID_HZ = 1e5  # low enough that a phase is proportional to the mean delay
InGloss = Callable[[NDArray[np.complexfloating], float], Any]
_LOBES = 32  # rays in a pixel whose gloss is followed
_HISTOGRAM_PATCHES = 12  # a side, for the impulse response of a pixel


class Gathering:
    """Light of patches, at any places, where rays end on the same surfaces, between their centres.

    ``places``: patches around the end of each ray, and weights of the interpolation.
    """

    def __init__(self, scene: Scene, patches: Patches, lit: Lit) -> None:
        self._lit, self._scatter = lit, scatter_of(scene, lit.surface)
        count = len(lit.surface)
        index, weights = np.zeros((count, 4), dtype=np.intp), np.zeros((count, 4))
        for surface, cells in patches.cells.items():
            mine = lit.surface == surface
            if mine.any():
                index[mine], weights[mine] = scene.surfaces[surface].primitive.between_cells(
                    lit.point[mine], cells
                )
                index[mine] += patches.first[surface]
        self.places: Bilinear = index, weights
        self._more = [Gathering(scene, patches, each) for each in lit.more]

    def moments(
        self, irradiance: NDArray[np.complexfloating], frequency_hz: float
    ) -> NDArray[np.complex128]:
        """Return the moments that the camera sees, given those on the patches."""
        on_pixel = np.einsum("pk,pk->p", self.places[1], irradiance[self.places[0]])
        seen = np.asarray(on_pixel * self.way(frequency_hz), dtype=np.complex128)
        return sum((each.moments(irradiance, frequency_hz) for each in self._more), start=seen)

    def way(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Return what the way to the camera makes of moments at the rays' ends."""
        turn = np.exp(2j * np.pi * frequency_hz / SPEED_OF_LIGHT_M_S * self._lit.distance_m)
        way = np.asarray(self._lit.reflectance * turn, dtype=np.complex128)
        if self._scatter is not None:
            way *= self._scatter.transfer(frequency_hz)
        return way


class Interreflection:
    """The light that reaches pixels over more than one scattering surface.

    ``scene``, ``lit``: a scene, and the light that the camera's rays see of it.
    ``fine``: the light of several rays in each of the pixels that are the mean over these.
    ``tolerance``: brightness that light may lack, where the scene does not say how far it is
    followed.
    ``exchange``: light between the scene's patches, where that is known.
    ``rays``: (P, 3) of the camera where gloss is to show them what stands before it, each in up to
    ``lobe_rays`` directions.
    """

    def __init__(
        self,
        scene: Scene,
        lit: Lit,
        *,
        width: int,
        height: int,
        fine: tuple[Within, ...] = (),
        tolerance: float = 1e-4,
        exchange: Exchange | None = None,
        rays: Points | None = None,
        lobe_rays: int = LOBE_RAYS,
    ) -> None:
        self._scene = scene
        self._lit = lit
        self._shape = (height, width)
        self._fine = fine
        self._exchange = exchange or Exchange.of(scene, scene.transport.patches)
        self._bounces = self._exchange.bounces(tolerance)
        patches = self._exchange.patches
        self._ends = Gathering(scene, patches, lit)
        self._ends_of_fine = [Gathering(scene, patches, each.rays) for each in fine]
        self._shown = None if rays is None else self._seen_in_gloss(rays, lobe_rays)
        self._shown_of_fine = [
            None if self._shown is None else self._seen_in_gloss(*self._few_rays(each))
            for each in fine
        ]

    def _few_rays(self, within: Within) -> tuple[Points, int]:
        """Return some of the rays in pixels, and into how many directions their lobes go."""
        camera, (height, width) = self._scene.camera, self._shape
        assert camera is not None  # noqa: S101  (a scene of surfaces has one)
        count = len(within.rays.surface) // within.pixel.size
        rays = rays_within(camera, within.pixel, count, width=width, height=height)
        step = max(1, count // _LOBES)
        few = rays.reshape(count, -1, 3)[::step].reshape(-1, 3)
        return few, max(1, LOBE_RAYS * within.pixel.size // len(few))

    def _seen_in_gloss(self, rays: Points, lobe_rays: int) -> InGloss | None:
        shown = ShownByGloss.of(self._scene, rays, lobe_rays)
        if shown is None:
            return None
        ends = Gathering(self._scene, self._exchange.patches, shown.lit)
        scatter, lit = shown.lit.scatter(self._scene), shown.lit

        def moments(irradiance: NDArray[np.complexfloating], frequency_hz: float) -> Any:
            seen = lit.moments(frequency_hz, scatter) + ends.moments(irradiance, frequency_hz)
            return shown.of_rays(seen, frequency_hz, len(rays))

        return moments

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """``int g(tau) exp(2 pi i f tau) dtau`` of this light, (H, W)."""
        return self._moments(frequency_hz) if frequency_hz else self._zeroth

    @cached_property
    def _zeroth(self) -> NDArray[np.complex128]:
        """Moments at the frequency 0, which those at any other are asked for with."""
        return self._moments(0.0)

    def _moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        irradiance = self._exchange.irradiance(frequency_hz, self._bounces)
        moments = self._ends.moments(irradiance, frequency_hz)
        earlier = irradiance
        if self._shown is not None:
            if self._scene.transport.diffuse_bounces is not None:  # gloss is one more
                earlier = self._exchange.irradiance(frequency_hz, self._bounces - 1)
            moments += self._shown(earlier, frequency_hz)
        for each, ends, shown in zip(
            self._fine, self._ends_of_fine, self._shown_of_fine, strict=True
        ):
            of_rays = ends.moments(irradiance, frequency_hz)
            moments[each.pixel] = each.of_pixels(of_rays).mean(axis=0)
            if shown is not None:
                moments[each.pixel] += each.of_pixels(shown(earlier, frequency_hz)).mean(axis=0)
        return moments.reshape(self._shape)

    @cached_property
    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Mean delay and weight of this light, (H, W)."""
        weight = self.moments(0.0).real
        phase_rad = np.angle(self.moments(_CENTROID_HZ))
        return phase_rad / (2 * np.pi * _CENTROID_HZ), weight

    def of_pixel(self, x: int, y: int, *, weight: float) -> tuple[float, NDArray[np.float64]]:
        """Time of the first bin's start, and mass in bins of ``BIN_S`` that sum up to a weight."""
        ray = y * self._shape[1] + x
        start_s, history = self._histogram.history
        cells, weights = self._between_few
        mass = np.maximum(weights[ray] @ history[cells[ray]], 0)
        if weight <= 0 or not mass.any():
            return start_s, np.zeros(0)
        start_s += float(self._lit.distance_m[ray]) / SPEED_OF_LIGHT_M_S
        return start_s, mass * (weight / mass.sum())

    @cached_property
    def _histogram(self) -> Exchange:
        few = min(_HISTOGRAM_PATCHES, self._scene.transport.patches)
        mirrors = self._exchange.over_mirrors.to.size > 0
        return Exchange.of(self._scene, few, mirrors=mirrors)

    @cached_property
    def _between_few(self) -> Bilinear:
        return Gathering(self._scene, self._histogram.patches, self._lit).places


class WithInterreflection:
    """Returns by direct light and mirrors, and the light that surfaces give each other."""

    kind: Literal["sparse", "dense"] = "dense"

    def __init__(self, direct: Responses, further: Interreflection) -> None:
        self._direct = direct
        self._further = further

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Sum of both."""
        return self._direct.moments(frequency_hz) + self._further.moments(frequency_hz)

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Direct returns, and one for all the rest at its mean delay."""
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
