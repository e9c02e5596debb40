"""Ambient light: unmodulated, in every image, also without the camera's own."""

import math
from dataclasses import replace

import numpy as np

from transientcam_simulation.base import STEADY
from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightPlanes, PlaneEffect


class AmbientLight(PlaneEffect):
    """Adds electrons, and with them shot noise, and fills the full well.

    It falls evenly on all surfaces: a pixel gets its share by the reflectance of what it sees.
    """

    name = "ambient"
    what = "light other than the camera's own"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self._electrons = np.float32(conditions.white_e)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where there is any that changes, or whose shot noise counts."""
        if not conditions.ambient_e:
            return Call(False, "no light but the camera's", 0.0, 0.0)
        per_e = 2 / conditions.scale_e / math.sqrt(conditions.sequence.takes)
        noise = tuple(
            per_e * np.sqrt(conditions.white_e * each.reflectance) for each in conditions.glimpses
        )
        reason = f"{conditions.ambient_e:.0f} electrons in a typical pixel of each image"
        call = weigh(replace(conditions, white_e=0.0), noise, reason)
        return replace(call, called=call.called or conditions.other_light != STEADY)

    @classmethod
    def forced_on(cls, conditions: Conditions) -> Conditions:
        """Return conditions with ambient light: a tenth of a full well, where there is none."""
        if conditions.white_e:
            return conditions
        return replace(conditions, white_e=0.1 * conditions.sensor.full_well_e)

    def on_light(self, planes: LightPlanes) -> None:
        """Add it to the part without the camera's light."""
        reflectance = np.asarray(planes.reflectance())
        of_region = reflectance[planes.region] if reflectance.ndim else reflectance
        planes.constant = planes.constant + self._electrons * of_region
