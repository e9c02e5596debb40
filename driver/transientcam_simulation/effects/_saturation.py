"""Saturation: a pixel holds no more than its full well."""

import math

import numpy as np

from transientcam_simulation.effects._conditions import Call, Conditions
from transientcam_simulation.effects._effect import Exposure, ImageEffect

_COST_S_PER_PIXEL = 4e-10
_SPREADS = (
    4  # standard deviations of noise that may fill a pixel, or bring it below the converter's end
)
_FURTHER_LIGHT = 0.25  # that comes over several surfaces, at most, where a pixel is brightest


class Saturation(ImageEffect):
    """Light beyond the full well is lost."""

    name = "saturation"
    what = "full pixels hold no more light"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the brightest pixel may fill up before the converter is at its end."""
        sensor = conditions.sensor
        full_well_e = sensor.full_well_e
        highest_e = (sensor.highest_dn - sensor.dark_dn) * sensor.gain_e_per_dn
        if full_well_e >= highest_e + _SPREADS * sensor.read_noise_e:
            reason = f"the converter ends at {highest_e / full_well_e:.0%} of a full well"
            return Call(False, reason, 0.0, 0.0)
        brightest_e = conditions.brightest_e * (1 + _FURTHER_LIGHT) + conditions.white_e
        cost_s = conditions.pixels * _COST_S_PER_PIXEL
        over_e = max(0.0, brightest_e + _SPREADS * math.sqrt(brightest_e) - full_well_e)
        share = brightest_e / full_well_e
        reason = f"the brightest pixel gets up to {share:.0%} of a full well"
        size_dn = math.sqrt(2) * over_e / sensor.gain_e_per_dn
        relative = size_dn / conditions.floor_dn
        return Call(over_e > 0, reason, size_dn, cost_s, relative, relative)

    def apply(self, exposure: Exposure) -> None:
        """Clip at the full well."""
        np.minimum(exposure.signal, np.float32(self._sensor.full_well_e), out=exposure.signal)
