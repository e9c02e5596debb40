"""Read noise: the amplifier adds the same to every pixel of every image."""

import numpy as np

from transientcam_driver.simulation.effects.effect import Call, Conditions, Effect, Electrons

_COST_S_PER_PIXEL = 8e-9


class ReadNoise(Effect):
    """Normal, the same for every pixel, independent of the light."""

    name = "read-noise"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self._sigma_e = np.float32(conditions.sensor.read_noise_e)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Wherever the sensor has any."""
        noise_e = conditions.sensor.read_noise_e
        cost_s = conditions.pixels * _COST_S_PER_PIXEL
        if noise_e == 0:
            return Call(False, "the sensor reads without noise", 0.0, cost_s)
        size_dn = noise_e / conditions.sensor.gain_e_per_dn
        return Call(True, f"{noise_e:g} electrons at each read-out", size_dn, cost_s)

    def apply(self, image: Electrons, random: np.random.Generator) -> None:
        """Add it."""
        noise = random.standard_normal(image.shape, dtype=np.float32)
        noise *= self._sigma_e
        image += noise
