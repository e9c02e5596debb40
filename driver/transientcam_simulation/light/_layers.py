"""Impulse responses of a moving scene at one time: layers over what stands still."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.base import Moments, Scatter, SparseResponses
from transientcam_simulation.compiled import CHUNK
from transientcam_simulation.light import (
    _compiled_light as compiled_light,
    _compiled_shadows as compiled_shadows,
)
from transientcam_simulation.light._bundle import Region, inside, numbers
from transientcam_simulation.light._coverage import Plane
from transientcam_simulation.light._held_light import HeldLight
from transientcam_simulation.light._hit_points import LitEnds
from transientcam_simulation.light._paths import Lit, scatter_of, sparse_image
from transientcam_simulation.light._still import StillLight
from transientcam_simulation.scene import Scene

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Layers:
    """Pixels that show something that moves, by row and column (2, P), and by which share.

    Each of the ``parts`` is one surface from one point, with each pixel once.
    """

    places: NDArray[np.int32]
    share: NDArray[np.float32]
    lit: LitEnds
    parts: tuple[slice, ...]


@dataclass(frozen=True, slots=True)
class Shadow:
    """Shares (H, W) of the light by a chain of mirrors that are left on what stands still.

    Outside of a region all is left.
    """

    chain: int
    region: Region
    left: Plane


@dataclass(frozen=True, slots=True)
class _Dimmed:
    """What shadows (N) leave of light."""

    chains: NDArray[np.int64]
    regions: NDArray[np.int64]
    """``chains``, ``regions``: (N) chains of mirrors, and (N, 4) regions, as numbers."""
    light: NDArray[np.float32]
    """(N, H, W) shares that are left, in the regions."""
    marks: NDArray[np.bool_]
    """(N, H, C) whether any pixel of successive chunks of a region's row has less than all."""

    @classmethod
    def by(cls, shadows: list[Shadow], uncovered: Plane) -> "_Dimmed":
        """Return what shadows leave of the light on what is not covered, by shares (H, W)."""
        height, width = uncovered.shape
        dimmed = cls(
            np.array([each.chain for each in shadows], dtype=np.int64),
            np.array([numbers(each.region) for each in shadows], dtype=np.int64).reshape(-1, 4),
            np.empty((len(shadows), height, width), dtype=np.float32),
            np.zeros((len(shadows), height, -(-width // CHUNK)), dtype=np.bool_),
        )
        for each, light, marks in zip(shadows, dimmed.light, dimmed.marks, strict=True):
            compiled_shadows.dimmed(uncovered, each.left, light, marks, numbers(each.region))
        return dimmed


class MovingResponses:
    """Impulse responses at one time.

    ``uncovered``: shares (H, W) of pixels that show what stands still.
    ``region``: the pixels that differ from those of what stands still.
    """

    def __init__(
        self,
        still: StillLight,
        scene: Scene,
        layers: Layers | None,
        uncovered: Plane,
        shadows: list[Shadow],
        region: Region,
        held: HeldLight | None = None,
    ) -> None:
        self.region = region
        self.held = held
        self.scene = scene
        self._still = still
        self._found: dict[float, Moments] = {}
        self._shape = still.height, still.width
        self._layers = layers
        self._uncovered = uncovered
        self._dimmed = _Dimmed.by(shadows, uncovered)

    @property
    def kind(self) -> Literal["sparse", "dense"]:
        """Dense where a surface spreads light."""
        return self._whole.kind

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Moments of all pixels, (H, W)."""
        whole = slice(0, self._shape[0]), slice(0, self._shape[1])
        return self.moments_in(whole, frequency_hz).astype(np.complex128)

    def moments_in(self, region: Region, frequency_hz: float) -> Moments:
        """Moments of a region that holds all that differs."""
        differ = self.differing(frequency_hz)
        if region == self.region:
            return differ
        moments = self.unchanged(frequency_hz)[region].copy()
        moments[inside(self.region, region)] = differ
        return moments

    def unchanged(self, frequency_hz: float) -> Moments:
        """Moments (H, W) of what stands still."""
        stands = self._still.lit.surface.max() >= 0  # else it is dark
        return (self.held if self.held and stands else self._still).moments(frequency_hz)

    def differing(self, frequency_hz: float) -> Moments:
        """Moments of the region that differs."""
        if frequency_hz not in self._found:
            self._found[frequency_hz] = self._moments(frequency_hz)
        return self._found[frequency_hz]

    def _moments(self, frequency_hz: float) -> Moments:
        moments = self._of_still(frequency_hz)
        if self._layers is None:
            return moments
        of_rays, places = self._of_layers(self._layers, frequency_hz), self._layers.places
        if self.held is not None:
            of_rays = of_rays + self.held.on(self._layers.lit, self._layers.parts, frequency_hz)
        top, left = (of.start for of in self.region)
        numbers_of = of_rays.view(np.float32).reshape(len(of_rays), -1)
        planes = moments.view(np.float32)
        compiled_light.layered(planes, places, numbers_of, self._layers.share, top, left)
        return moments

    def _of_still(self, frequency_hz: float) -> Moments:
        """Moments of the region, of what stands still and is not covered."""
        each, total = self._still.phasors(frequency_hz)[0], self.unchanged(frequency_hz)
        dimmed = self._dimmed
        left = compiled_light.remaining(
            total.view(np.float32), each.view(np.float32), dimmed.chains, dimmed.regions,
            dimmed.light, dimmed.marks, self._uncovered, numbers(self.region),
        )  # fmt: skip
        return left.view(total.dtype)

    def _of_layers(self, layers: Layers, frequency_hz: float) -> Moments:
        """Moments of the points of layers, in single precision."""
        if not frequency_hz:
            brightness = np.zeros(layers.places.shape[1], dtype=np.float32)
            for _chain, way in layers.lit.ways:
                on = slice(None) if len(way.on) == len(brightness) else way.on
                brightness[on] += way.weight
            return brightness
        of_rays = np.zeros(layers.places.shape[1], dtype=np.complex64)
        for _chain, way in layers.lit.ways:
            phase_rad = compiled_light.phases(way.delay_s, 2 * np.pi * frequency_hz)
            cosine, sine = np.cos(phase_rad), np.sin(phase_rad)
            pairs = of_rays.view(np.float32).reshape(-1, 2)
            compiled_light.turned(pairs, way.on, way.weight, cosine, sine)
        scatter = scatter_of(self.scene, layers.lit.ends.index)
        if scatter is not None:
            of_rays *= scatter.transfer(frequency_hz)
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
            pixel, of = self._pixel[most], self._layers.lit.all()
            lit.surface[pixel] = of.surface[most]
            lit.point[pixel] = of.point[most]
            lit.distance_m[pixel] = of.distance_m[most]
        return lit

    @cached_property
    def reflectance(self) -> NDArray[np.float32]:
        """(H, W) of what the pixels see, by its shares."""
        reflectance = self._still.reflectance * self._uncovered.ravel()
        if self._layers is not None:
            more = (self._layers.share * self._layers.lit.reflectance).astype(np.float32)
            for part in self._layers.parts:
                reflectance[self._pixel[part]] += more[part]
        return reflectance.reshape(self._shape)

    @cached_property
    def _pixel(self) -> NDArray[np.intp]:
        """Pixels of layers by index."""
        assert self._layers is not None  # noqa: S101  (who asks has some)
        rows, columns = self._layers.places.astype(np.intp)
        pixel: NDArray[np.intp] = rows * self._shape[1] + columns
        return pixel

    @cached_property
    def _whole(self) -> SparseResponses:
        delay_s, weight, scatter = self._still.returns
        weight = weight * self._uncovered.ravel()
        chains = len(self._still.lit.weight)
        dimmed = self._dimmed
        for chain, light, of in zip(dimmed.chains, dimmed.light, dimmed.regions, strict=True):
            top, left, rows, columns = of
            part = light[top : top + rows, left : left + columns]
            row, column = np.nonzero(part != 1)
            pixel = np.ravel_multi_index((row + top, column + left), self._shape)
            weight[chain::chains, pixel] *= part[row, column]
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
        lit, pixel = layers.lit.all().part(part), self._pixel[part]
        shape = (len(lit.weight), self._uncovered.size)
        delay_s, weight = np.zeros(shape), np.zeros(shape)
        delay_s[:, pixel] = lit.delay_s
        weight[:, pixel] = layers.share[part] * lit.weight
        return delay_s, weight, scatter_of(self.scene, np.full(shape, lit.surface[0]))


def uncovered_by(layers: Layers | None, shape: tuple[int, int]) -> Plane:
    """Return the shares (H, W) of pixels that layers leave."""
    uncovered = np.ones(shape, dtype=np.float32)
    if layers is None:
        return uncovered
    compiled_light.uncover(uncovered, layers.places, layers.share)
    return uncovered
