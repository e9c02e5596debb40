"""What the light that surfaces give each other gives the pixels while it stands."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.base import Moments
from transientcam_simulation.light import (
    _compiled_gathered as compiled_gathered,
    _compiled_light as compiled_light,
)
from transientcam_simulation.light._further_light import FurtherLight
from transientcam_simulation.light._hit_points import LitEnds
from transientcam_simulation.light._paths import scatter_of
from transientcam_simulation.light._radiosity import Gathering
from transientcam_simulation.light._recent import Recent
from transientcam_simulation.light._still import StillLight
from transientcam_simulation.scene import Ellipsoid

_FREQUENCIES = 32  # kept
_WAYS = 8  # kept


class StillEnds:
    """Places on what stands still where rays end, and their ways to the camera.

    ``fine``: light on patches so fine that what nothing that moves changes is taken of it.
    """

    def __init__(self, light: FurtherLight, fine: FurtherLight, still: StillLight) -> None:
        lit = replace(still.lit, reflectance=still.reflectance.astype(np.float64))
        self._light, self._fine = light, fine
        self._ends = Gathering(still.scene, light.patches, lit)
        self._fine_ends = Gathering(still.scene, fine.patches, lit)
        index, shares = self._ends.places
        self.places = index.astype(np.int32), shares.astype(np.float32)
        self._kept: Recent[float, tuple[NDArray[np.complex64], ...]] = Recent(_WAYS)

    def moments(self, light: NDArray[np.complex64], frequency_hz: float) -> Moments:
        """Return the moments (P) that the camera sees, given those on the patches."""

        def found() -> tuple[NDArray[np.complex64], ...]:
            light = self._light.without_movers(frequency_hz)
            fine = self._fine_ends.moments(self._fine.without_movers(frequency_hz), frequency_hz)
            kept = light, self._ends.way(frequency_hz), fine
            return tuple(each.astype(np.complex64) for each in kept)

        without, way, fine = self._kept.get(frequency_hz, found)
        light = light - without
        moments = np.empty(len(self.places[0]), dtype=np.complex64)
        pairs = (each.view(np.float32).reshape(-1, 2) for each in (light, moments))
        compiled_gathered.on_ends(*self.places, *pairs)
        moments *= way
        moments += fine
        return moments if frequency_hz else moments.real


class HeldLight:
    """The light of patches at a time, on ``ends`` of rays on what stands still, and on the rest."""

    def __init__(
        self, light: FurtherLight, still: StillLight, ends: StillEnds, time_s: float
    ) -> None:
        self._patches, self._still, self._ends = light.patches, still, ends
        self._moments: Recent[float, Moments] = Recent(_FREQUENCIES)
        self._light: Recent[float, NDArray[np.complex64]] = Recent(_FREQUENCIES)
        self._solve: Callable[[float], NDArray[np.complex64]] = lambda f_hz: light.irradiance(
            time_s, f_hz
        ).astype(np.complex64)

    def moments(self, frequency_hz: float) -> Moments:
        """Moments (H, W) of what stands still, with all of its light and nothing before it."""

        def found() -> Moments:
            direct = self._still.moments(frequency_hz)
            more = self._ends.moments(self._of_patches(frequency_hz), frequency_hz)
            return direct + more.reshape(direct.shape)

        return self._moments.get(frequency_hz, found)

    def on(self, lit: LitEnds, parts: tuple[slice, ...], frequency_hz: float) -> Moments:
        """Moments (P) of points on what moves, of which each part lies on one surface."""
        ends, patches, light = lit.ends, self._patches, self._of_patches(frequency_hz)
        moments = np.empty(len(lit.reflectance), np.complex64)
        balls, spans = [], []
        for part in parts:
            index = int(ends.index[part.start])
            shape, grid, first = (
                ends.surfaces[index].primitive,
                patches.cells[index],
                patches.first[index],
            )
            if isinstance(shape, Ellipsoid):
                balls.append((*shape.centre, *(1 / shape.radii)))
                spans.append((part.start, part.stop, first, grid.rows, grid.columns))
            else:
                point = np.stack([each[part] for each in ends.point], axis=-1, dtype=np.float64)
                cells, shares = shape.between_cells(point, grid)
                moments[part] = np.einsum("pk,pk->p", shares, light[cells + first])
        of = np.array(balls, np.float32).reshape(-1, 6), np.array(spans, np.int64).reshape(-1, 5)
        given, on = (each.view(np.float32).reshape(-1, 2) for each in (light, moments))
        compiled_gathered.on_ellipsoids(*ends.point, *of, given, on)
        if not frequency_hz:
            return moments.real * lit.reflectance.astype(np.float32)
        delay_s = ends.distance_m.astype(np.float64) / SPEED_OF_LIGHT_M_S
        phase_rad = compiled_light.phases(delay_s, 2 * np.pi * frequency_hz)
        compiled_gathered.sent(on, lit.reflectance, np.cos(phase_rad), np.sin(phase_rad))
        scatter = scatter_of(ends.scene, ends.index)
        return moments if scatter is None else moments * scatter.transfer(frequency_hz)

    def _of_patches(self, frequency_hz: float) -> NDArray[np.complex64]:
        return self._light.get(frequency_hz, lambda: self._solve(frequency_hz))


def held_light(
    light: FurtherLight, fine: FurtherLight, still: StillLight
) -> Callable[[float], HeldLight]:
    """Return the light that stands at any time: that of the middle of its part of a step."""
    ends, held_s = StillEnds(light, fine, still), light.held_s
    kept: Recent[int, HeldLight] = Recent(3)

    def at(time_s: float) -> HeldLight:
        part = math.floor(time_s / held_s)
        return kept.get(part, lambda: HeldLight(light, still, ends, (part + 0.5) * held_s))

    return at
