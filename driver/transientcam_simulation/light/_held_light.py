"""Light that surfaces give each other while some of them move, between times at which it is solved.

It follows from the time alone. Patches' light is solved at multiples of a step, in which nothing
moves by more than part of a patch, and interpolated between them in the patches' own places: what
moves takes its light with it. What it gives the pixels stands for a part of a step. How fine
patches are, and with them how long steps, is chosen by the noise (`SceneFacts.patches_a_side`).
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.base import Moments
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._patches import Patches
from transientcam_simulation.light._paths import Lit
from transientcam_simulation.light._radiosity import Gathering
from transientcam_simulation.light._recent import Recent
from transientcam_simulation.light._still import StillLight
from transientcam_simulation.scene import Points, Scene, patch_edges_m

STEP_PATCHES: Final = 0.5
"""Of the largest patches' edges, that anything moves in a step at most."""
HELD_STEPS: Final = 0.25
"""Of a step, for which what patches give the pixels stands."""
_LONGEST_S = 3600.0  # of a step
_COSTS_S = 3e-7, 3e-8, 1e-7, 1e-7  # of each kind of `Work`
_EXCHANGES, _SOLVED, _HELD, _FACTORS = 3, 128, 3, 32  # kept


class FurtherLight:
    """Light over several surfaces, on patches, at any time.

    Parameters
    ----------
    scene
        With surfaces that move.
    per_side
        Patches along the longest side of a surface.
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
        return Patches.of(self._scene, self._per_side)

    @cached_property
    def step_s(self) -> float:
        """Time between solutions."""
        speeds_m_s = (sum(each.speed_m_s for each in of.motions) for of in self._scene.surfaces)
        return self._reach_m / max(*speeds_m_s, self._reach_m / _LONGEST_S)

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
        return np.array([each.shape.box[0] for each in self._scene.at(time_s).surfaces])

    def solution(self, time_s: float, frequency_hz: float) -> NDArray[np.complex128]:
        """Solve it at a time, or find what is kept."""

        def exchange() -> tuple[Exchange, int]:
            between = Exchange.of(self._scene.at(time_s), self._per_side)
            return between, between.bounces(self._tolerance)

        def solve() -> NDArray[np.complex128]:
            between, bounces = self._exchanges.get(time_s, exchange)
            return between.irradiance(frequency_hz, bounces)

        return self._solved.get((time_s, frequency_hz), solve)


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


class HeldLight:
    """What the light of patches at a time gives the pixels, while it stands."""

    def __init__(self, of: "HeldLights", time_s: float) -> None:
        self._of, self._time_s = of, time_s
        self._irradiance: dict[float, NDArray[np.complex128]] = {}
        self._still: dict[float, Moments] = {}

    def moments(self, frequency_hz: float) -> Moments:
        """Moments (H, W) of what stands still, with all of its light and nothing before it."""
        if frequency_hz not in self._still:
            of, irradiance = self._of, self._by_patches(frequency_hz)
            light = of.ends.on_ends(irradiance) * of.to_camera(frequency_hz)
            direct = of.still.moments(frequency_hz)
            self._still[frequency_hz] = direct + _moments(light, frequency_hz).reshape(direct.shape)
        return self._still[frequency_hz]

    def ends(self, scene: Scene, lit: Lit) -> Gathering:
        """Return where rays end on surfaces at their places at any time."""
        return Gathering(scene, self._of.light.patches, lit)

    def on(self, ends: Gathering, frequency_hz: float) -> Moments:
        """Moments of rays."""
        return _moments(ends.moments(self._by_patches(frequency_hz), frequency_hz), frequency_hz)

    def _by_patches(self, frequency_hz: float) -> NDArray[np.complex128]:
        if frequency_hz not in self._irradiance:
            found = self._of.light.irradiance(self._time_s, frequency_hz)
            self._irradiance[frequency_hz] = found
        return self._irradiance[frequency_hz]


class HeldLights:
    """Light over several surfaces as pixels see it, which changes a few times in a step."""

    def __init__(self, light: FurtherLight, still: StillLight) -> None:
        self.light, self.still = light, still
        lit = replace(still.lit, reflectance=still.reflectance.astype(np.float64))
        self.ends = Gathering(still.scene, light.patches, lit)
        self._factors: Recent[float, NDArray[np.complex64]] = Recent(_FACTORS)
        self._kept: Recent[int, HeldLight] = Recent(_HELD)
        self._held_s = HELD_STEPS * light.step_s

    def at(self, time_s: float) -> HeldLight:
        """Return the light that stands at a time: that of the middle of its part of a step."""
        part = math.floor(time_s / self._held_s)
        return self._kept.get(part, lambda: HeldLight(self, (part + 0.5) * self._held_s))

    def to_camera(self, frequency_hz: float) -> NDArray[np.complex64]:
        """Return the factors of the moments where rays end on what stands still."""
        return self._factors.get(
            frequency_hz, lambda: self.ends.to_camera(frequency_hz).astype(np.complex64)
        )


def _moments(values: NDArray[np.complexfloating], frequency_hz: float) -> Moments:
    """Return moments in single precision, as real numbers at the frequency 0."""
    return values.astype(np.complex64) if frequency_hz else values.real.astype(np.float32)
