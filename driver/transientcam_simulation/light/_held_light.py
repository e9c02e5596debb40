"""What the light that surfaces give each other gives the pixels, while it stands."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.base import Moments, Scatter
from transientcam_simulation.light import _compiled_gathered as compiled_gathered
from transientcam_simulation.light._coverage import Plane
from transientcam_simulation.light._further_light import HELD_STEPS, FurtherLight
from transientcam_simulation.light._hit_points import LitEnds
from transientcam_simulation.light._patches import Patches
from transientcam_simulation.light._paths import scatter_of
from transientcam_simulation.light._radiosity import Gathering
from transientcam_simulation.light._recent import Recent
from transientcam_simulation.light._still import StillLight
from transientcam_simulation.scene import Ellipsoid

_HELD: Final = 3  # kept
_FACTORS: Final = 32


@dataclass(frozen=True, slots=True)
class SeenPatches:
    """Patches around points that rays of the camera end on.

    Attributes
    ----------
    cells, weights
        (4, P) patches, and weights of the interpolation.
    distance_m, reflectance
        (P) from the camera, and share of the light on a point that gets there.
    """

    cells: NDArray[np.int32]
    weights: Plane
    distance_m: Plane
    reflectance: Plane
    scatter: Scatter | None

    @classmethod
    def still(cls, still: StillLight, patches: Patches) -> "SeenPatches":
        """Return those on what stands still, one ray a pixel."""
        lit = still.lit
        cells, weights = Gathering(still.scene, patches, lit).places
        return cls(
            np.ascontiguousarray(cells.T, np.int32),
            np.ascontiguousarray(weights.T, np.float32),
            lit.distance_m.astype(np.float32),
            still.reflectance,
            lit.scatter(still.scene),
        )

    @classmethod
    def moving(cls, lit: LitEnds, patches: Patches) -> "SeenPatches":
        """Return those on what moves, wherever it is."""
        ends, count = lit.ends, len(lit.reflectance)
        cells, weights = np.zeros((4, count), np.int32), np.zeros((4, count), np.float32)
        balls, spans = [], []
        for start, stop in ends.spans.tolist():
            index = int(ends.index[start])
            shape, grid = ends.surfaces[index].shape, patches.cells[index]
            if isinstance(shape, Ellipsoid):
                balls.append((*shape.centre, *(1 / shape.radii)))
                spans.append((start, stop, patches.first[index], grid.rows, grid.columns))
                continue
            point = np.stack([each[start:stop] for each in ends.point], axis=-1)
            around, shares = shape.between_cells(point, grid.rows, grid.columns)
            cells[:, start:stop] = around.T + patches.first[index]
            weights[:, start:stop] = shares.T
        of = np.array(balls, np.float32).reshape(-1, 6), np.array(spans, np.int64).reshape(-1, 5)
        compiled_gathered.around_on_ellipsoids(*ends.point, *of, cells, weights)
        scatter = scatter_of(ends.still, ends.index)
        reflectance = lit.reflectance.astype(np.float32)
        return cls(cells, weights, ends.distance_m, reflectance, scatter)

    def to_camera(self, frequency_hz: float) -> Plane:
        """Return the factors (P, 2) of moments on their way to the camera, as pairs."""
        factor = np.empty((len(self.distance_m), 2), np.float32)
        if not frequency_hz:
            factor[:, 0], factor[:, 1] = self.reflectance, 0
            return factor
        phase_rad = np.float32(2 * np.pi * frequency_hz / SPEED_OF_LIGHT_M_S) * self.distance_m
        np.multiply(np.cos(phase_rad), self.reflectance, out=factor[:, 0])
        np.multiply(np.sin(phase_rad), self.reflectance, out=factor[:, 1])
        if self.scatter is not None:
            turned = factor.view(np.complex64)[:, 0] * self.scatter.transfer(frequency_hz)
            factor = turned.astype(np.complex64).view(np.float32).reshape(-1, 2)
        return factor

    def moments(self, light: Plane, factor: Plane, frequency_hz: float) -> Moments:
        """Return moments (P) as the camera sees them, given those of patches (N, 2)."""
        pairs = compiled_gathered.gathered(self.cells, self.weights, light, factor)
        return pairs.view(np.complex64)[:, 0] if frequency_hz else pairs[:, 0]


class HeldLight:
    """What the light of patches at a time gives the pixels."""

    def __init__(self, of: "HeldLights", time_s: float) -> None:
        self._of, self._time_s = of, time_s
        self._light: dict[float, Plane] = {}
        self._still: dict[float, Moments] = {}

    def moments(self, frequency_hz: float) -> Moments:
        """Moments (H, W) of what stands still, with all of its light and nothing before it."""
        if frequency_hz not in self._still:
            of, direct = self._of, self._of.still.moments(frequency_hz)
            factor = of.to_camera(frequency_hz)
            more = of.seen.moments(self._by_patches(frequency_hz), factor, frequency_hz)
            self._still[frequency_hz] = direct + more.reshape(direct.shape)
        return self._still[frequency_hz]

    def seen(self, lit: LitEnds) -> SeenPatches:
        """Return patches around points on what moves."""
        return SeenPatches.moving(lit, self._of.light.patches)

    def on(self, seen: SeenPatches, frequency_hz: float) -> Moments:
        """Moments (P) of such points."""
        factor = seen.to_camera(frequency_hz)
        return seen.moments(self._by_patches(frequency_hz), factor, frequency_hz)

    def _by_patches(self, frequency_hz: float) -> Plane:
        """Moments (N, 2) of the patches, as pairs."""
        if frequency_hz not in self._light:
            found = self._of.light.irradiance(self._time_s, frequency_hz).astype(np.complex64)
            self._light[frequency_hz] = found.view(np.float32).reshape(-1, 2)
        return self._light[frequency_hz]


class HeldLights:
    """Light over several surfaces as pixels see it, which changes a few times in a step."""

    def __init__(self, light: FurtherLight, still: StillLight) -> None:
        self.light, self.still = light, still
        self.seen = SeenPatches.still(still, light.patches)
        self._factors: Recent[float, Plane] = Recent(_FACTORS)
        self._kept: Recent[int, HeldLight] = Recent(_HELD)
        self._held_s = HELD_STEPS * light.step_s

    def at(self, time_s: float) -> HeldLight:
        """Return the light that stands at a time: that of the middle of its part of a step."""
        part = math.floor(time_s / self._held_s)
        return self._kept.get(part, lambda: HeldLight(self, (part + 0.5) * self._held_s))

    def to_camera(self, frequency_hz: float) -> Plane:
        """Return the factors of moments on what stands still."""
        return self._factors.get(frequency_hz, lambda: self.seen.to_camera(frequency_hz))
