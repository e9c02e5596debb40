"""Light that surfaces give each other where some move, as a function of the time alone.

It is solved at steps of time, and interpolated in the patches' own places: what moves takes its
light with it. Coarse patches do where only the change by what moves is taken of them, and the rest
is solved once on fine ones. `SceneFacts.resolution` says how fine patches and steps must be.
"""

import math
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._patches import Patches
from transientcam_simulation.light._paths import camera_of
from transientcam_simulation.light._recent import Recent
from transientcam_simulation.light._variants import still_scene
from transientcam_simulation.scene import Points, Scene, patch_edges_m, speed_m_s

_HELD_PATCHES: Final = 0.25
"""Of the largest patches' edges: that anything moves while what patches give the pixels stands."""
_LONGEST_S = 3600.0  # of a step
_EXCHANGES, _SOLVED = 3, 128  # kept


class FurtherLight:
    """Light over several surfaces, on patches, at any time, but for what is below a tolerance.

    ``per_side``: patches along the longest side of what stands still; the rest is cut as the scene
    says. ``reach``: how many edges of the largest patches anything moves in a step at most.
    """

    def __init__(
        self, scene: Scene, *, per_side: int, reach: float = 0.5, tolerance: float = 1e-4
    ) -> None:
        self._scene, self._per_side, self._tolerance = scene, per_side, tolerance
        self._reach_m = reach * max(patch_edges_m(scene, per_side).values())
        self._held_steps = _HELD_PATCHES / reach
        self._exchanges: Recent[float, tuple[Exchange, int]] = Recent(_EXCHANGES)
        self._solved: Recent[tuple[float, float], NDArray[np.complex128]] = Recent(_SOLVED)
        self._without: Recent[float, NDArray[np.complex128]] = Recent(_SOLVED)

    @cached_property
    def patches(self) -> Patches:
        """All patches, at their places without motion."""
        finest = self._scene.transport.patches
        return Patches.of(self._scene, self._per_side, moving=finest)

    @cached_property
    def _standing(self) -> tuple[NDArray[np.intp], Exchange, int]:
        """Patches of what stands still, and the light between these alone."""
        moves = np.array([bool(each.motions) for each in self._scene.surfaces])
        still = np.flatnonzero(~moves[self.patches.surface])
        between = Exchange.between(still_scene(self._scene), self.patches.part(still))
        return still, between, between.bounces(self._tolerance)

    def without_movers(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Moments (N) of the light that patches get where nothing moves; 0 for what does."""

        def solve() -> NDArray[np.complex128]:
            still, between, bounces = self._standing
            light = np.zeros(len(self.patches), dtype=np.complex128)
            light[still] = between.irradiance(frequency_hz, bounces)
            return light

        return self._without.get(frequency_hz, solve)

    @cached_property
    def step_s(self) -> float:
        """Time between solutions."""
        lamp, speeds_m_s = self._scene.light, [each.speed_m_s for each in self._scene.surfaces]
        lamp_m_s = speed_m_s(lamp.motions, camera_of(self._scene).position_m, lamp.position_m)
        return self._reach_m / max(*speeds_m_s, lamp_m_s, self._reach_m / _LONGEST_S)

    @property
    def held_s(self) -> float:
        """Time for which what patches give the pixels stands."""
        return self._held_steps * self.step_s

    def irradiance(self, time_s: float, frequency_hz: float) -> NDArray[np.complex128]:
        """Moments (N) of the light that patches get from each other."""
        step = math.floor(time_s / self.step_s)
        first_s, last_s = step * self.step_s, (step + 1) * self.step_s
        if np.abs(self._places(first_s) - self._places(last_s)).max() > 1.01 * self._reach_m:
            return self.solution(time_s, frequency_hz)  # as a path starts again in between
        later = time_s / self.step_s - step
        one, other = (self.solution(at_s, frequency_hz) for at_s in (first_s, last_s))
        return (1 - later) * one + later * other

    def _places(self, time_s: float) -> Points:
        """Places of surfaces' corners and of the lamp."""
        now = self._scene.at(time_s)
        return np.vstack([now.light.position_m, *(each.shape.extent() for each in now.surfaces)])

    def solution(self, time_s: float, frequency_hz: float) -> NDArray[np.complex128]:
        """Solve it at a time, or find what is kept."""

        def exchange() -> tuple[Exchange, int]:
            scene, surfaces = self._scene.at(time_s), self._scene.surfaces
            patches = self.patches.moved(np.array([each.offset_m(time_s) for each in surfaces]))
            if any(each.turns for each in surfaces):
                cuts = {k: (of.up, of.along) for k, of in patches.cells.items()}
                patches = Patches.cut(scene, cuts)
            between = Exchange.between(scene, patches)
            return between, between.bounces(self._tolerance)

        def solve() -> NDArray[np.complex128]:
            between, bounces = self._exchanges.get(time_s, exchange)
            return between.irradiance(frequency_hz, bounces)

        return self._solved.get((time_s, frequency_hz), solve)
