"""What was found out of a scene's light serves all cameras of the process in front of it.

Following light takes a second. The same scene is seen again when a camera is opened twice, when a
plan looks at a second camera in virtual time, and when clients change scenes back and forth.
"""

import pickle
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Final

from transientcam_driver.camera import Sensor
from transientcam_simulation.base import IDEAL, STEADY
from transientcam_simulation.light._transport import KEPT_PIXELS, SurfaceScenery
from transientcam_simulation.scene import Scene

_SCENES: Final = 3


@dataclass(frozen=True, slots=True)
class _Geometry:
    """What light depends on: two are equal where all values are."""

    values: bytes
    scene: Scene = field(compare=False)


def shared_scenery(scene: Scene, *, width: int, height: int) -> SurfaceScenery:
    """Return the light of surfaces for a sensor of so many pixels, by any thread."""
    if width * height > KEPT_PIXELS:
        return SurfaceScenery(scene, width=width, height=height)
    seen = replace(
        scene,
        name="",
        description="",
        file=None,
        sensor=Sensor(),
        device=IDEAL,
        ambient_electrons_per_s=0.0,
        other_light=STEADY,
        effects={},
        seed=1,
    )
    return _kept(_Geometry(pickle.dumps(seen), seen), width, height)


@lru_cache(maxsize=_SCENES)
def _kept(geometry: _Geometry, width: int, height: int) -> SurfaceScenery:
    return SurfaceScenery(geometry.scene, width=width, height=height)
