"""Read noise: the amplifier adds the same to every pixel of every image."""

import math

import numpy as np

from transientcam_simulation.effects._conditions import Call, Conditions, always
from transientcam_simulation.effects._effect import Exposure, ImageEffect

_COST_S_PER_PIXEL = 8e-9


class ReadNoise(ImageEffect):
    """Normal, the same for every pixel, independent of the light."""

    name = "read-noise"
    what = "the amplifier adds noise"
    adds_variance = True

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self.variance_e2 = np.float32(conditions.sensor.read_noise_e**2)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Wherever the sensor has any."""
        noise_e = conditions.sensor.read_noise_e
        cost_s = conditions.pixels * _COST_S_PER_PIXEL
        if noise_e == 0:
            return Call(False, "the sensor reads without noise", 0.0, cost_s)
        # a moment is made of four images and has twice their noise
        size_dn = 2 * noise_e / math.sqrt(conditions.sequence.takes)
        size_dn /= conditions.sensor.gain_e_per_dn
        return always(conditions, size_dn, f"{noise_e:g} electrons at each read-out", cost_s)

    def apply(self, exposure: Exposure) -> None:
        """Add its variance."""
        exposure.variance_e2 = exposure.variance_e2 + self.variance_e2
