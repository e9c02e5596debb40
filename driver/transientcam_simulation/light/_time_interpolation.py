"""A moving scene between the times at which it is computed."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.base import Moments
from transientcam_simulation.light import _compiled_light as compiled_light
from transientcam_simulation.light._bundle import Region, numbers, union
from transientcam_simulation.light._coverage import single
from transientcam_simulation.light._layers import MovingResponses
from transientcam_simulation.scene import Scene, Surface

_PIXELS = 0.5
"""That the fastest surface moves from one time to the next, at most. In between, light is
interpolated: at a pixel's width edges would be off by a quarter of their contrast."""
_BLOCK = 8  # of the shortest steps: in each block they are as long as its speeds allow
_WORTH = 2  # images in a step, from which on interpolation is cheaper than each image by itself


class Steps:
    """Light at any time from the light at multiples of a step.

    Steps are longer while everything is slower than it ever gets, and depend on the time alone.

    ``scene``: with moving surfaces.
    ``at``: computes the light at a time.
    ``pixel_rad``: angle of a pixel.
    ``every_s``: time between images: where steps are shorter, each image has its own light.
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
        self._at = at
        self._paths = _paths(scene, pixel_rad)
        self.step_s = min((path.step_s for path in self._paths), default=1.0)
        self._kept: dict[float, MovingResponses] = {}
        self._block: tuple[int, float] = (-1, 0.0)

    def at(self, time_s: float) -> "MovingResponses | Between":
        """Return the light at a time."""
        block = int(np.floor(time_s / (_BLOCK * self.step_s)))
        if block != self._block[0]:
            self._block = block, self._farthest(block)
        farthest = self._block[1]
        count = min(_BLOCK, max(1, int(np.ceil(_BLOCK * farthest - 1e-6))))
        step_s = _BLOCK * self.step_s / count
        if step_s < _WORTH * self._every_s or farthest > 1 + 1e-6:
            return self._at(time_s)
        step = int(np.floor(time_s / step_s))
        return Between(
            self._of(step * step_s), self._of((step + 1) * step_s), time_s / step_s - step
        )

    def _farthest(self, block: int) -> float:
        """Farthest that anything moves in one of the shortest steps of a block.

        In units of what it may; more than that where a path starts again.
        """
        times_s = [(block * _BLOCK + k) * self.step_s for k in range(_BLOCK + 1)]
        return max((path.farthest(times_s) for path in self._paths), default=0.0)

    def _of(self, time_s: float) -> MovingResponses:
        if time_s not in self._kept:
            latest = sorted(self._kept)[-1:]
            self._kept = {k: self._kept[k] for k in latest}
            self._kept[time_s] = self._at(time_s)
        return self._kept[time_s]


@dataclass(frozen=True, slots=True)
class _Path:
    """A surface that moves, and how far it may within a step."""

    surface: Surface
    most_m: float

    @property
    def step_s(self) -> float:
        """Longest step at its highest speed."""
        return self.most_m / self.surface.speed_m_s

    def farthest(self, times_s: list[float]) -> float:
        """Longest way between successive times, over the one that is allowed."""
        of = self.surface
        places = [of.at(t).shape.extent() if of.turns else of.offset_m(t) for t in times_s]
        return float(np.linalg.norm(np.diff(places, axis=0), axis=-1).max() / self.most_m)


class Between:
    """Moments between two times, as a mean of both."""

    def __init__(self, first: MovingResponses, second: MovingResponses, share: float) -> None:
        self._parts = ((1 - share, first), (share, second))
        self.region: Region = union([first.region, second.region])
        self.held = first.held

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Moments of all pixels, (H, W)."""
        (one, first), (other, second) = self._parts
        return one * first.moments(frequency_hz) + other * second.moments(frequency_hz)

    def moments_in(self, region: Region, frequency_hz: float) -> Moments:
        """Moments of a region that holds all that differs."""
        (one, first), (other, second) = self._parts
        total = first.unchanged(frequency_hz)
        plane = total.view(np.float32)
        mixed = compiled_light.blended(
            plane, plane.shape[1] // total.shape[1], numbers(region),
            np.float32(one), first.differing(frequency_hz).view(np.float32), numbers(first.region),
            np.float32(other), second.differing(frequency_hz).view(np.float32),
            numbers(second.region),
        )  # fmt: skip
        return mixed.view(np.complex64) if frequency_hz else mixed

    @cached_property
    def reflectance(self) -> NDArray[np.float32]:
        """(H, W) of what the pixels see."""
        (one, first), (other, second) = self._parts
        return single(one * first.reflectance + other * second.reflectance)


def _paths(scene: Scene, pixel_rad: float) -> tuple[_Path, ...]:
    """Return the paths of moving surfaces; of those with the same motions the closest one's."""
    assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
    most_m: dict[tuple[float, ...], _Path] = {}
    for surface in scene.surfaces:
        if not surface.speed_m_s:
            continue
        away_m = np.linalg.norm(surface.shape.extent() - scene.camera.position_m, axis=-1)
        path = _Path(surface, _PIXELS * pixel_rad * max(float(away_m.min()), 1e-3))
        same = surface.speed_m_s, *(id(motion) for motion in surface.motions)
        if same not in most_m or path.most_m < most_m[same].most_m:
            most_m[same] = path
    return tuple(most_m.values())
