"""Quantisation: the converter gives whole numbers, from 0 to its highest code."""

import math

import numpy as np

from transientcam_simulation.effects._conditions import Call, Conditions, always
from transientcam_simulation.effects._effect import Exposure, ImageEffect

_COST_S_PER_PIXEL = 3e-9


class Quantisation(ImageEffect):
    """Round to the nearest code. Always there: an image holds integers."""

    name = "quantisation"
    what = "images hold whole numbers"
    optional = False

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self.dn_per_e = np.float32(1 / conditions.sensor.gain_e_per_dn)
        self.dark_dn = np.float32(conditions.sensor.dark_dn)
        self.highest_dn = np.float32(conditions.sensor.highest_dn)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Call for it always; its error is that of rounding four images, 1 / sqrt(12) each."""
        reason = f"{conditions.sensor.bits} bits of {conditions.sensor.gain_e_per_dn:g} electrons"
        size_dn = 2 / math.sqrt(12 * conditions.sequence.takes)
        return always(conditions, size_dn, reason, conditions.pixels * _COST_S_PER_PIXEL)

    def apply(self, exposure: Exposure) -> None:
        """Turn electrons into codes."""
        image = exposure.signal
        image *= self.dn_per_e
        image += self.dark_dn
        np.rint(image, out=image)
        np.clip(image, np.float32(0), self.highest_dn, out=image)
