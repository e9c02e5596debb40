"""Impulse responses of a moving scene at one time: layers over what stands still."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.light.bundle import Region, extent, inside
from transientcam_driver.simulation.light.coverage import Plane, overlapped, single
from transientcam_driver.simulation.light.lanes import LANES
from transientcam_driver.simulation.light.paths import Lit, scatter_of, sparse_image
from transientcam_driver.simulation.light.still import StillLight
from transientcam_driver.simulation.responses import Scatter, SparseResponses
from transientcam_driver.simulation.scene.scene import Scene

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Layers:
    """Pixels, by index, that show something that moves, and by which share.

    Each of the ``parts`` is one surface from one point, with each pixel once.
    """

    pixel: NDArray[np.intp]
    share: NDArray[np.float32]
    lit: Lit
    parts: tuple[slice, ...]


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
        layers: Layers | None,
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
        if layers is not None:
            for part in layers.parts:
                self._uncovered[layers.pixel[part]] -= layers.share[part]
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
        differ = self.differing(frequency_hz)
        if region == self.region:
            return differ
        moments = self.unchanged(frequency_hz)[region].copy()
        moments[inside(self.region, region)] = differ
        return moments

    def unchanged(self, frequency_hz: float) -> NDArray[np.complex64]:
        """Moments (H, W) of what stands still."""
        return self._still.phasors(frequency_hz)[1]

    def differing(self, frequency_hz: float) -> NDArray[np.complex64]:
        """Moments of the region that differs."""
        if frequency_hz not in self._found:
            self._found[frequency_hz] = self._moments(frequency_hz)
        return self._found[frequency_hz]

    def _moments(self, frequency_hz: float) -> NDArray[np.complex64]:
        each, total = self._still.phasors(frequency_hz)
        region = self.region
        moments = total[region].copy()
        for shadow in self._shadows:
            _darken(moments, region, shadow, each[shadow.chain])
        moments *= self._uncovered.reshape(self._shape)[region]
        if self._layers is not None:
            flat, of_rays = moments.reshape(-1), self._of_layers(self._layers, frequency_hz)
            for part in self._layers.parts:
                flat[self._places[part]] += of_rays[part]
        return moments

    @cached_property
    def _places(self) -> NDArray[np.intp]:
        """Where the pixels of layers are in the region that differs."""
        assert self._layers is not None  # noqa: S101  (who asks has some)
        rows, columns = np.divmod(self._layers.pixel, self._shape[1])
        top, left = self.region[0].start, self.region[1].start
        places: NDArray[np.intp] = (rows - top) * extent(self.region)[1] + columns - left
        return places

    @cached_property
    def _ways(self) -> list[tuple[slice | NDArray[np.intp], Values, Values]]:
        """Points of layers, delays and weights, of each chain of mirrors where it lights any."""
        assert self._layers is not None  # noqa: S101  (who asks has some)
        ways: list[tuple[slice | NDArray[np.intp], Values, Values]] = []
        for delay_s, weight in zip(self._layers.lit.delay_s, self._layers.lit.weight, strict=True):
            on = np.flatnonzero(weight)
            if len(on) == len(weight):
                ways.append((slice(None), delay_s, weight))
            elif on.size:
                ways.append((on, delay_s[on], weight[on]))
        return ways

    def _of_layers(self, layers: Layers, frequency_hz: float) -> NDArray[np.complex64]:
        """Moments of the points of layers by their shares, in single precision."""
        of_rays = np.zeros(len(layers.pixel), dtype=np.complex64)
        for on, delay_s, weight in self._ways:
            if not frequency_hz:
                of_rays.real[on] += weight
                continue
            phase_rad = (2 * np.pi * frequency_hz * delay_s).astype(np.float32)
            of_rays.real[on] += weight * np.cos(phase_rad)
            of_rays.imag[on] += weight * np.sin(phase_rad)
        scatter = layers.lit.scatter(self.scene)
        if scatter is not None:
            of_rays *= scatter.transfer(frequency_hz)
        of_rays *= layers.share
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
        if self._layers is not None:
            most = np.flatnonzero(self._layers.share > 0.5)  # of a pixel, one at most
            pixel, of = self._layers.pixel[most], self._layers.lit
            lit.surface[pixel] = of.surface[most]
            lit.point[pixel] = of.point[most]
            lit.distance_m[pixel] = of.distance_m[most]
        return lit

    @cached_property
    def reflectance(self) -> NDArray[np.float32]:
        """(H, W) of what the pixels see, by its shares."""
        reflectance = self._still.reflectance * self._uncovered
        if self._layers is not None:
            more = (self._layers.share * self._layers.lit.reflectance).astype(np.float32)
            for part in self._layers.parts:
                reflectance[self._layers.pixel[part]] += more[part]
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
        if self._layers is not None:
            for part in self._layers.parts:
                more_s, more, spread = self._planes_of(self._layers, part)
                delays, weights, spreads = [*delays, more_s], [*weights, more], [*spreads, spread]
        whole = None
        if scatter is not None:
            whole = Scatter(
                np.concatenate([each.width_s for each in spreads if each is not None]),
                np.concatenate([each.decay_s for each in spreads if each is not None]),
            )
        return sparse_image(np.concatenate(delays), np.concatenate(weights), whole, self._shape)

    def _planes_of(self, layers: Layers, part: slice) -> tuple[Values, Values, Scatter | None]:
        """Delays, weights and spread of a layer, (K, H W)."""
        lit, pixel = layers.lit.part(part), layers.pixel[part]
        shape = (len(lit.weight), len(self._uncovered))
        delay_s, weight = np.zeros(shape), np.zeros(shape)
        delay_s[:, pixel] = lit.delay_s
        weight[:, pixel] = layers.share[part] * lit.weight
        return delay_s, weight, scatter_of(self.scene, np.full(shape, lit.surface[0]))


def _darken(
    moments: NDArray[np.complex64], region: Region, shadow: Shadow, each: NDArray[np.complex64]
) -> None:
    """Take what a shadow leaves out of light by one chain (H, W) from the moments of a region."""
    at = inside(shadow.region, region)
    lane = LANES.find("darkened")
    if lane is None:
        moments[at] -= (1 - shadow.left) * each[shadow.region]
        return
    starts = (of.start for of in (*shadow.region, *at))
    lane(moments.view(np.float32), each.view(np.float32), shadow.left, *starts)
