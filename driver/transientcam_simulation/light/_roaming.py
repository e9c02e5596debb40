"""Light before a camera or by a lamp that moves: at each time all that scatters counts as moving.

Where light differs between pixels, several rays are followed into each, as if these were an image.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from transientcam_simulation.effects import Noise
from transientcam_simulation.light._followed import FollowedRays
from transientcam_simulation.light._held_light import HeldLight
from transientcam_simulation.light._layers import MovingResponses
from transientcam_simulation.light._moving import MovingLight
from transientcam_simulation.light._paths import camera_of
from transientcam_simulation.light._rays import rays_within
from transientcam_simulation.light._still import StillLight, differing
from transientcam_simulation.scene import Points, Scene

_RAYS: Final = 16  # into a pixel that light differs in


@dataclass(frozen=True, slots=True)
class RoamingLight:
    """Of a scene; ``noise``, ``highest_hz``: as of `StillLight`."""

    scene: Scene
    size: dict[str, int]
    noise: Noise | None
    highest_hz: float

    def centres(
        self, time_s: float, held: HeldLight | None = None, rays: Points | None = None, **size: int
    ) -> MovingResponses:
        """Return the light at a time on rays through pixels' centres, or on others."""
        now, size = replace(self.scene.at(time_s), surfaces=self.scene.surfaces), size or self.size
        bare = replace(now, surfaces=tuple(each for each in now.surfaces if not each.scatters))
        followed = FollowedRays(bare, rays, **size)
        still = StillLight(bare, **size, noise=None, highest_hz=0.0, followed=followed)
        return MovingLight(now, still, soft=False).at(time_s, held)

    def at(
        self, time_s: float, held: HeldLight | None
    ) -> tuple[Callable[[float], Any], Callable[[], Any]]:
        """Return what gives moments (H, W) at a time by frequency, and reflectance (H, W)."""
        centres = self.centres(time_s, held)
        of = centres.moments, lambda: centres.reflectance
        if self.noise is None:
            return of
        planes = [centres.moments(frequency_hz) for frequency_hz in (0.0, self.highest_hz)]
        noise = self.noise.deviation(planes[0].real, centres.reflectance.astype(np.float64))
        pixel = np.flatnonzero(differing(planes, centres.lit.surface.reshape(noise.shape), noise))
        if not pixel.size:
            return of
        rays = rays_within(camera_of(self.scene.at(time_s)), pixel, _RAYS, **self.size)
        within = self.centres(time_s, held, rays, width=pixel.size, height=_RAYS)

        def mixed(plane: Any, rays: Any) -> Any:
            plane.ravel()[pixel] = rays.mean(axis=0)
            return plane

        return (
            lambda frequency_hz: mixed(of[0](frequency_hz), within.moments(frequency_hz)),
            lambda: mixed(centres.reflectance, within.reflectance),
        )
