"""Shot noise: electrons come one by one (Poisson statistics)."""

import math

import numpy as np

from transientcam_driver.simulation.effects.effect import Call, Conditions, Effect, Electrons

FEW_E = 100.0
"""Below this mean a pixel is drawn from the Poisson distribution itself.

Above it the normal distribution of the same mean and variance takes its place, which is more than
ten times cheaper. At 100 electrons the skewness it leaves out is 0.1, and the read noise that
follows hides that further.
"""

_COST_S_PER_PIXEL = 1.2e-8


class ShotNoise(Effect):
    """Variance equal to the mean."""

    name = "shot-noise"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Wherever there is light."""
        mean_e = conditions.brightness_e / 2
        size_dn = math.sqrt(mean_e) / conditions.sensor.gain_e_per_dn
        cost_s = conditions.pixels * _COST_S_PER_PIXEL
        if mean_e == 0:
            return Call(False, "no light reaches the sensor", 0.0, cost_s)
        return Call(True, f"{mean_e:.0f} electrons in a typical pixel", size_dn, cost_s)

    def apply(self, image: Electrons, random: np.random.Generator) -> None:
        """Draw each pixel around its mean."""
        few = image < FEW_E
        drawn = random.poisson(image[few]) if few.any() else None
        noise = random.standard_normal(image.shape, dtype=np.float32)
        noise *= np.sqrt(image)
        image += noise
        if drawn is not None:
            image[few] = drawn
