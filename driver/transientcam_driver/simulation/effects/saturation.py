"""Saturation: a pixel holds no more than its full well."""

import math

import numpy as np

from transientcam_driver.simulation.effects.effect import Call, Conditions, Exposure, ImageEffect

_COST_S_PER_PIXEL = 4e-10


class Saturation(ImageEffect):
    """Light beyond the full well is lost."""

    name = "saturation"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the brightest pixel of the brightest image may not hold its light."""
        full_well_e = conditions.sensor.full_well_e
        brightest_e = conditions.brightest_e + conditions.ambient_white_e
        cost_s = conditions.pixels * _COST_S_PER_PIXEL
        over_e = max(0.0, brightest_e - full_well_e)
        share = brightest_e / full_well_e
        reason = f"the brightest pixel gets up to {share:.0%} of a full well"
        size_dn = math.sqrt(2) * over_e / conditions.sensor.gain_e_per_dn
        return Call(over_e > 0, reason, size_dn, cost_s)

    def apply(self, exposure: Exposure) -> None:
        """Clip at the full well."""
        np.minimum(exposure.signal, np.float32(self._sensor.full_well_e), out=exposure.signal)
