"""Light that surfaces give each other while some of them move, between times at which it is solved.

It follows from the time alone. Patches' light is solved at multiples of a step, in which nothing
moves by more than part of a patch, and interpolated between them in the patches' own places: what
moves takes its light with it. What it gives the pixels stands for a half a step. How fine
patches are, and with them how long steps, is chosen by the noise (`SceneFacts.patches_a_side`).
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._patches import Patches, form_factors
from transientcam_simulation.light._paths import blocked
from transientcam_simulation.light._recent import Recent
from transientcam_simulation.scene import Points, Scene, patch_edges_m

STEP_PATCHES: Final = 0.5
"""Of the largest patches' edges, that anything moves in a step at most."""
HELD_STEPS: Final = 0.5
"""Of a step, for which what patches give the pixels stands (`HeldLight`)."""
_LONGEST_S = 3600.0  # of a step
_COSTS_S = 3e-7, 3e-8, 1e-7, 1e-7  # of each kind of `Work`
_EXCHANGES, _SOLVED = 3, 128  # kept


_Alike = tuple[NDArray[np.bool_], NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]
"""Surfaces (S) that move otherwise, and receivers, givers and form factors of patches."""


class FurtherLight:
    """Light over several surfaces, on patches, at any time.

    Parameters
    ----------
    scene
        With surfaces that move.
    per_side
        Patches along the longest side of a surface that stands still; those of others are as fine
        as the scene says.
    tolerance
        Brightness that light may lack, where the scene does not say how far it is followed.
    """

    def __init__(self, scene: Scene, *, per_side: int, tolerance: float = 1e-4) -> None:
        self._scene, self._per_side, self._tolerance = scene, per_side, tolerance
        self._reach_m = STEP_PATCHES * max(patch_edges_m(scene, per_side).values())
        self._exchanges: Recent[float, tuple[Exchange, int]] = Recent(_EXCHANGES)
        self._solved: Recent[tuple[float, float], NDArray[np.complex128]] = Recent(_SOLVED)

    @cached_property
    def patches(self) -> Patches:
        """All patches, at their places without motion."""
        finest = self._scene.transport.patches
        return Patches.of(self._scene, self._per_side, moving=finest)

    @cached_property
    def step_s(self) -> float:
        """Time between solutions."""
        speeds_m_s = (sum(each.speed_m_s for each in of.motions) for of in self._scene.surfaces)
        return self._reach_m / max(*speeds_m_s, self._reach_m / _LONGEST_S)

    def irradiance(self, time_s: float, frequency_hz: float) -> NDArray[np.complex128]:
        """Moments (N) of the light that patches get from each other."""
        step = math.floor(time_s / self.step_s)
        first_s, last_s = step * self.step_s, (step + 1) * self.step_s
        if np.abs(self._offsets(first_s) - self._offsets(last_s)).max() > 1.01 * self._reach_m:
            return self.solution(time_s, frequency_hz)  # as a path starts again in between
        later = time_s / self.step_s - step
        one, other = (self.solution(at_s, frequency_hz) for at_s in (first_s, last_s))
        return (1 - later) * one + later * other

    @cached_property
    def _groups(self) -> NDArray[np.intp]:
        """By surface (S): which of them move alike."""
        kinds = [tuple(map(id, each.motions)) for each in self._scene.surfaces]
        return np.array([kinds.index(kind) for kind in kinds])

    @cached_property
    def _alike(self) -> list[_Alike]:
        """Form factors between patches that move alike, but for what comes between them."""
        found, patches, groups = [], self.patches, self._groups
        for group in np.unique(groups[patches.surface]):
            mine = np.flatnonzero(groups[patches.surface] == group)
            ends = patches.centre[mine], patches.normal[mine]
            wanted = np.broadcast_to(groups[patches.surface] == group, (len(mine), len(patches)))
            near = _some(self._scene, groups == group)
            factors = form_factors(near, patches, *ends, wanted)
            p, n = np.nonzero(factors)
            found.append((groups != group, mine[p], n, factors[p, n]))
        return found

    def _factors(self, now: Scene, patches: Patches) -> NDArray[np.float64]:
        """Form factors of patches at their places, of which those that move alike are kept."""
        group = self._groups[patches.surface]
        apart = group[:, None] != group
        factors = form_factors(now, patches, patches.centre, patches.normal, apart)
        for others, p, n, kept in self._alike:
            hidden = blocked(_some(now, others), patches.centre[p], patches.centre[n])
            factors[p, n] = np.where(hidden, 0.0, kept)
        return factors

    def _offsets(self, time_s: float) -> Points:
        """How far each surface is from its place, (S, 3)."""
        return np.array([each.offset_m(time_s) for each in self._scene.surfaces])

    def solution(self, time_s: float, frequency_hz: float) -> NDArray[np.complex128]:
        """Solve it at a time, or find what is kept."""

        def exchange() -> tuple[Exchange, int]:
            now, patches = self._scene.at(time_s), self.patches.moved(self._offsets(time_s))
            between = Exchange.between(now, patches, self._factors(now, patches))
            return between, between.bounces(self._tolerance)

        def solve() -> NDArray[np.complex128]:
            between, bounces = self._exchanges.get(time_s, exchange)
            return between.irradiance(frequency_hz, bounces)

        return self._solved.get((time_s, frequency_hz), solve)


def _some(scene: Scene, wanted: NDArray[np.bool_]) -> Scene:
    """Return a scene with only some of its surfaces."""
    pairs = zip(scene.surfaces, wanted, strict=True)
    return replace(scene, surfaces=tuple(each for each, is_wanted in pairs if is_wanted))


@dataclass(frozen=True, slots=True)
class Work:
    """What that light takes an image, on average.

    Attributes
    ----------
    pairs
        Of patches, whose form factors are computed.
    turned
        Of patches, between which a moment goes.
    still, moving
        Moments on pixels of what stands still, and of what moves.
    """

    pairs: float
    turned: float
    still: float
    moving: float

    @classmethod
    def of(
        cls, light: FurtherLight, *, moments: int, every_s: float, pixels: int, moving: float
    ) -> "Work":
        """Count it, for images so far apart that ask for moments at so many frequencies in all.

        ``moving``: pixels that show what moves.
        """
        count = len(light.patches) ** 2
        solutions = min(2.0, every_s / light.step_s)
        parts = min(1.0, every_s / light.step_s / HELD_STEPS)
        return cls(
            solutions * count,
            solutions * count * _asked(moments, solutions),
            parts * pixels * _asked(moments, parts),
            2 * moving,
        )

    @property
    def cost_s(self) -> float:
        """Processor time."""
        costs_s = zip(_COSTS_S, (self.pairs, self.turned, self.still, self.moving), strict=True)
        return sum(each_s * count for each_s, count in costs_s)


def _asked(moments: int, an_image: float) -> float:
    """Return the moments that are asked of what is computed so many times an image.

    Each image asks for two: at 0 Hz, and at its own frequency.
    """
    return min(moments, max(2.0, 2.0 / an_image))
