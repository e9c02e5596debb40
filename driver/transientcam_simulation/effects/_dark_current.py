"""Dark current: electrons that gather in a pixel without light."""

import math

import numpy as np

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightPlanes, PlaneEffect


class DarkCurrentElectrons(PlaneEffect):
    """Adds the same electrons to every pixel, and with them their shot noise."""

    name = "dark-current"
    what = "electrons that come without light"
    figures = "dark_current"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self._electrons = np.float32(_electrons(conditions))

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where their shot noise counts."""
        electrons = _electrons(conditions)
        if not electrons:
            return Call(False, "the pixels of the device stay empty in the dark", 0.0, 0.0)
        error = 2 * math.sqrt(electrons / conditions.sequence.takes) / conditions.scale_e
        changes = tuple(np.full(each.brightness.shape, error) for each in conditions.glimpses)
        return weigh(conditions, changes, f"{electrons:.0f} electrons in each image without light")

    def on_light(self, planes: LightPlanes) -> None:
        """Add them to the part without the camera's light."""
        planes.constant = planes.constant + self._electrons


def _electrons(conditions: Conditions) -> float:
    current = conditions.device.dark_current
    return current.electrons_per_s * conditions.sequence.exposure_s if current else 0.0
