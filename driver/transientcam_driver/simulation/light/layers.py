"""Impulse responses of a moving scene at one time: layers over what stands still."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.light.bundle import Region, inside
from transientcam_driver.simulation.light.coverage import Plane, overlapped, single
from transientcam_driver.simulation.light.paths import Lit, scatter_of, sparse_image
from transientcam_driver.simulation.light.still import StillLight
from transientcam_driver.simulation.responses import Scatter, SparseResponses
from transientcam_driver.simulation.scene.scene import Scene


@dataclass(frozen=True, slots=True)
class Layer:
    """Pixels, by index, each once, that show something that moves, and by which share."""

    region: Region
    pixel: NDArray[np.intp]
    share: NDArray[np.float32]
    lit: Lit


@dataclass(frozen=True, slots=True)
class Shadow:
    """Share (h, w) of the light by a chain of mirrors that is left on what stands still."""

    chain: int
    region: Region
    left: Plane


class MovingResponses:
    """Impulse responses at one time.

    Attributes
    ----------
    region
        The pixels that differ from those of what stands still.
    """

    def __init__(
        self,
        still: StillLight,
        scene: Scene,
        layers: tuple[Layer, ...],
        shadows: tuple[Shadow, ...],
        region: Region,
    ) -> None:
        self.region = region
        self.scene = scene
        self._still = still
        self._found: dict[float, NDArray[np.complex64]] = {}
        self._shape = still.height, still.width
        self._layers = layers
        self._uncovered = np.ones(still.height * still.width, dtype=np.float32)
        for each in self._layers:
            self._uncovered[each.pixel] -= each.share
        np.maximum(self._uncovered, 0, out=self._uncovered)  # what rounding leaves
        self._shadows = tuple(self._uncovered_part(each) for each in shadows)

    def _uncovered_part(self, shadow: Shadow) -> Shadow:
        """Return a shadow by its share of what of each pixel is not covered."""
        seen = self._uncovered.reshape(self._shape)[shadow.region]
        left = overlapped(seen, shadow.left) / np.maximum(seen, np.float32(1e-9))
        return Shadow(shadow.chain, shadow.region, single(left))

    @property
    def kind(self) -> Literal["sparse", "dense"]:
        """Dense where a surface spreads light."""
        return self._whole.kind

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Moments of all pixels, (H, W)."""
        whole = slice(0, self._shape[0]), slice(0, self._shape[1])
        return self.moments_in(whole, frequency_hz).astype(np.complex128)

    def moments_in(self, region: Region, frequency_hz: float) -> NDArray[np.complex64]:
        """Moments of a region that holds all that differs."""
        if frequency_hz not in self._found:
            self._found[frequency_hz] = self._moments(frequency_hz)
        if region == self.region:
            return self._found[frequency_hz]
        moments = self._still.phasors(frequency_hz)[1][region].copy()
        moments[inside(self.region, region)] = self._found[frequency_hz]
        return moments

    def _moments(self, frequency_hz: float) -> NDArray[np.complex64]:
        """Moments of the region that differs."""
        each, total = self._still.phasors(frequency_hz)
        region = self.region
        moments = total[region].copy()
        for shadow in self._shadows:
            moments[inside(shadow.region, region)] -= (1 - shadow.left) * each[shadow.chain][
                shadow.region
            ]
        moments *= self._uncovered.reshape(self._shape)[region]
        for layer in self._layers:
            rows, columns = np.divmod(layer.pixel, self._shape[1])
            at = rows - region[0].start, columns - region[1].start
            moments[at] += self._of_layer(layer, frequency_hz)
        return moments

    def _of_layer(self, layer: Layer, frequency_hz: float) -> NDArray[np.complex64]:
        """Moments of a layer's pixels by their shares, in single precision."""
        lit = layer.lit
        of_rays = np.zeros(len(lit.surface), dtype=np.complex64)
        for delay_s, weight in zip(lit.delay_s, lit.weight, strict=True):
            if not weight.any():
                continue
            if not frequency_hz:
                of_rays.real += weight
                continue
            phase_rad = (2 * np.pi * frequency_hz * delay_s).astype(np.float32)
            of_rays.real += weight * np.cos(phase_rad)
            of_rays.imag += weight * np.sin(phase_rad)
        scatter = lit.scatter(self.scene)
        if scatter is not None:
            of_rays *= scatter.transfer(frequency_hz)
        of_rays *= layer.share
        return of_rays

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the returns of all pixels."""
        return self._whole.returns()

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Response of one pixel."""
        return self._whole.of_pixel(x, y)

    @cached_property
    def lit(self) -> Lit:
        """Light of one ray a pixel: of the layer that fills most of it."""
        still = self._still.lit
        lit = Lit(
            still.surface.copy(),
            still.point.copy(),
            still.distance_m.copy(),
            self.reflectance.ravel().astype(np.float64),
            still.delay_s,
            still.weight,
        )
        for layer in self._layers:
            most = np.flatnonzero(layer.share > 0.5)
            lit.surface[layer.pixel[most]] = layer.lit.surface[most]
            lit.point[layer.pixel[most]] = layer.lit.point[most]
            lit.distance_m[layer.pixel[most]] = layer.lit.distance_m[most]
        return lit

    @cached_property
    def reflectance(self) -> NDArray[np.float32]:
        """(H, W) of what the pixels see, by its shares."""
        reflectance = self._still.reflectance * self._uncovered
        for layer in self._layers:
            reflectance[layer.pixel] += (layer.share * layer.lit.reflectance).astype(np.float32)
        return reflectance.reshape(self._shape)

    @cached_property
    def _whole(self) -> SparseResponses:
        delay_s, weight, scatter = self._still.returns
        weight = weight * self._uncovered
        chains = len(self._still.lit.weight)
        for shadow in self._shadows:
            planes = weight[shadow.chain :: chains].reshape(-1, *self._shape)
            planes[:, *shadow.region] *= shadow.left  # a view of weight
            weight[shadow.chain :: chains] = planes.reshape(len(planes), -1)
        delays, weights, spreads = [delay_s], [weight], [scatter]
        for layer in self._layers:
            more_s, more, spread = self._planes_of(layer)
            delays, weights, spreads = [*delays, more_s], [*weights, more], [*spreads, spread]
        whole = None
        if scatter is not None:
            whole = Scatter(
                np.concatenate([each.width_s for each in spreads if each is not None]),
                np.concatenate([each.decay_s for each in spreads if each is not None]),
            )
        return sparse_image(np.concatenate(delays), np.concatenate(weights), whole, self._shape)

    def _planes_of(
        self, layer: Layer
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], Scatter | None]:
        """Delays, weights and spread of a layer, (K, H W)."""
        delays, surfaces = layer.lit.delay_s, layer.lit.surface
        weights = layer.share * layer.lit.weight
        delay_s, weight, surface = [], [], []
        for index in np.unique(surfaces):
            mine = surfaces == index
            shape = (len(weights), len(self._uncovered))
            delay_s.append(np.zeros(shape))
            weight.append(np.zeros(shape))
            delay_s[-1][:, layer.pixel[mine]] = delays[:, mine]
            weight[-1][:, layer.pixel[mine]] = weights[:, mine]
            surface.append(np.full(shape, index))
        spread = scatter_of(self.scene, np.concatenate(surface))
        return np.concatenate(delay_s), np.concatenate(weight), spread
