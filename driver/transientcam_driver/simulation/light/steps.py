"""A moving scene between the times at which it is computed."""

from collections.abc import Callable
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.light.bundle import Region, union
from transientcam_driver.simulation.light.coverage import single
from transientcam_driver.simulation.light.layers import MovingResponses
from transientcam_driver.simulation.scene.scene import Scene

_PIXELS = 1.0
"""That the fastest surface moves from one time to the next. In between, light is interpolated: a
silhouette that crosses a pixel does so at an even rate, and range is continuous."""


class Steps:
    """Light at any time from the light at multiples of a step.

    Parameters
    ----------
    scene
        With moving surfaces.
    at
        Computes the light at a time.
    pixel_rad
        Angle of a pixel.
    every_s
        Time between images: where a step is shorter, each image has its own light.
    """

    def __init__(
        self,
        scene: Scene,
        at: Callable[[float], MovingResponses],
        *,
        pixel_rad: float,
        every_s: float = 0.0,
    ) -> None:
        self._every_s = every_s
        self._scene = scene
        self._at = at
        self.step_s = _step_s(scene, pixel_rad)
        self._kept: dict[int, MovingResponses] = {}

    def at(self, time_s: float) -> "MovingResponses | Between":
        """Return the light at a time."""
        step = int(np.floor(time_s / self.step_s + 1e-9))
        share = time_s / self.step_s - step
        if self.step_s <= self._every_s or self._jumps(step):
            return self._at(time_s)
        return Between(self._of(step), self._of(step + 1), min(1.0, max(0.0, share)))

    def _of(self, step: int) -> MovingResponses:
        if step not in self._kept:
            self._kept = {k: v for k, v in self._kept.items() if abs(k - step) <= 1}
            self._kept[step] = self._at(step * self.step_s)
        return self._kept[step]

    def _jumps(self, step: int) -> bool:
        """Whether a path starts again within a step."""
        motions = [motion for surface in self._scene.surfaces for motion in surface.motions]
        for motion in motions:
            first, second = (motion.offset_m((step + k) * self.step_s) for k in (0, 1))
            if np.linalg.norm(second - first) > 1.01 * motion.speed_m_s * self.step_s:
                return True
        return False


class Between:
    """Impulse responses between two times, as a mean of both."""

    def __init__(self, first: MovingResponses, second: MovingResponses, share: float) -> None:
        self._parts = ((1 - share, first), (share, second))
        self.region: Region = union([first.region, second.region])

    @property
    def kind(self) -> Literal["sparse", "dense"]:
        """Kind of both."""
        return self._nearer.kind

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Moments of all pixels, (H, W)."""
        (one, first), (other, second) = self._parts
        return one * first.moments(frequency_hz) + other * second.moments(frequency_hz)

    def moments_in(self, region: Region, frequency_hz: float) -> NDArray[np.complex64]:
        """Moments of a region that holds all that differs."""
        (one, first), (other, second) = self._parts
        moments = np.float32(one) * first.moments_in(region, frequency_hz)
        moments += np.float32(other) * second.moments_in(region, frequency_hz)
        return moments

    @cached_property
    def reflectance(self) -> NDArray[np.float32]:
        """(H, W) of what the pixels see."""
        (one, first), (other, second) = self._parts
        return single(one * first.reflectance + other * second.reflectance)

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return those at the nearer time."""
        return self._nearer.returns()

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return that of one pixel at the nearer time."""
        return self._nearer.of_pixel(x, y)

    @property
    def _nearer(self) -> MovingResponses:
        return max(self._parts, key=lambda part: part[0])[1]


def _step_s(scene: Scene, pixel_rad: float) -> float:
    """Longest time in which nothing moves by more than ``_PIXELS``."""
    assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
    steps_s = []
    for surface in scene.surfaces:
        speed_m_s = sum(motion.speed_m_s for motion in surface.motions)
        if speed_m_s:
            away_m = np.linalg.norm(surface.shape.extent() - scene.camera.position_m, axis=-1)
            steps_s.append(_PIXELS * pixel_rad * max(float(away_m.min()), 1e-3) / speed_m_s)
    return min(steps_s, default=1.0)
