"""Figures of a scene by which effects are judged, still or over time."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.effects import Facts
from transientcam_driver.simulation.light.mixed_pixels import edges
from transientcam_driver.simulation.light.paths import Lit, camera_rays, light_rays
from transientcam_driver.simulation.light.radiosity import Interreflection
from transientcam_driver.simulation.responses import Scatter
from transientcam_driver.simulation.scene import Scene
from transientcam_driver.simulation.scene.geometry import Rectangle

_ROUGH_PATCHES = 6  # a side, to estimate the share of interreflection
_JUDGED_TIMES = 5  # of a period, at which a moving scene is judged
_COARSER = 3  # times fewer pixels a side than the image, where a moving scene is judged


def facts_of(scene: Scene, lit: Lit, *, width: int, height: int) -> Facts:
    """Judge a scene that stands still by what the camera's rays see of it."""
    return _StillFacts(scene, lit, width, height)


def facts_over_time(scene: Scene, *, width: int, height: int) -> Facts:
    """Judge a moving scene at several times of its longest period, with fewer rays."""
    period_s = max(motion.period_s for each in scene.surfaces for motion in each.motions)
    times_s = (np.arange(_JUDGED_TIMES) + 0.5) / _JUDGED_TIMES * period_s
    width, height = max(2, width // _COARSER), max(2, height // _COARSER)
    assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
    rays = camera_rays(scene.camera, width=width, height=height)
    scenes = [scene.at(float(time_s)) for time_s in times_s]
    return _MovingFacts(
        scene, [_StillFacts(still, light_rays(still, rays), width, height) for still in scenes]
    )


class _StillFacts:
    """Of a scene that stands still."""

    speed_m_s = 0.0
    moving_share = 0.0

    def __init__(self, scene: Scene, lit: Lit, width: int, height: int) -> None:
        self._scene = scene
        self._lit = lit
        self._width, self._height = width, height

    @cached_property
    def brightness(self) -> float:
        """All light but that of interreflection."""
        return float(self._lit.weight.sum())

    @property
    def mirror_share(self) -> float:
        if not self.brightness:
            return 0.0
        return float(self._lit.weight[1:].sum() / self.brightness)

    @property
    def indirect_share(self) -> float:
        return self._indirect_share

    @cached_property
    def _indirect_share(self) -> float:
        transport = self._scene.transport
        scattering = [each for each in self._scene.surfaces if each.scatters]
        flat = len(scattering) == 1 and isinstance(scattering[0].shape, Rectangle)
        if flat or not scattering or not transport.diffuse_bounces or not self.brightness:
            return 0.0
        rough = replace(transport, patches=min(_ROUGH_PATCHES, transport.patches))
        scene = replace(self._scene, transport=rough)
        further = Interreflection(scene, self._lit, width=self._width, height=self._height)
        indirect = float(further.moments(0.0).real.sum())
        return indirect / (indirect + self.brightness)

    @property
    def _depths(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        scatter = self._lit.scatter(self._scene)
        none = np.zeros(len(self._lit.surface))
        return (none, none) if scatter is None else (scatter.width_s, scatter.decay_s)

    @property
    def scatter(self) -> Scatter | None:
        width_s, decay_s = self._depths
        slowest = int(decay_s.argmax())
        return Scatter(width_s[slowest], decay_s[slowest]) if decay_s[slowest] else None

    @property
    def scatter_share(self) -> float:
        return float(np.mean(self._depths[1] > 0))

    @property
    def edges(self) -> tuple[float, float]:
        return self._edges

    @cached_property
    def _edges(self) -> tuple[float, float]:
        edge, steps = edges(self._lit.distance_m.reshape(self._height, self._width))
        return float(edge.mean()), float(np.sqrt(np.mean(steps**2))) if steps.size else 0.0

    @property
    def surface(self) -> NDArray[np.intp]:
        """What the rays see."""
        return self._lit.surface


class _MovingFacts:
    """Of a scene that moves: means over several times, or the largest of them."""

    def __init__(self, scene: Scene, still: list[_StillFacts]) -> None:
        self._scene = scene
        self._still = still

    def _mean(self, values: list[float]) -> float:
        return float(np.mean(values))

    @property
    def mirror_share(self) -> float:
        return self._mean([each.mirror_share for each in self._still])

    @property
    def indirect_share(self) -> float:
        return self._indirect_share

    @cached_property
    def _indirect_share(self) -> float:
        return self._mean([each.indirect_share for each in self._still])

    @property
    def scatter(self) -> Scatter | None:
        found = [each.scatter for each in self._still if each.scatter is not None]
        return max(found, key=lambda scatter: float(scatter.decay_s), default=None)

    @property
    def scatter_share(self) -> float:
        return self._mean([each.scatter_share for each in self._still])

    @property
    def edges(self) -> tuple[float, float]:
        shares, steps = zip(*(each.edges for each in self._still), strict=True)
        # on the coarser grid the share of pixels at an edge is as many times higher
        return float(np.mean(shares)) / _COARSER, float(max(steps))

    @property
    def speed_m_s(self) -> float:
        return max(
            sum(motion.speed_m_s for motion in each.motions) for each in self._scene.surfaces
        )

    @property
    def moving_share(self) -> float:
        moving = [index for index, each in enumerate(self._scene.surfaces) if each.motions]
        return self._mean([float(np.isin(still.surface, moving).mean()) for still in self._still])
