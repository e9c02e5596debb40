"""Shot noise: electrons come one by one (Poisson statistics)."""

import math

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.effects._conditions import Call, Conditions, always
from transientcam_simulation.effects._effect import Exposure, ImageEffect

FEW_E = 100.0
"""Below this mean a pixel is drawn from the Poisson distribution itself.

Above it the normal distribution of the same mean and variance takes its place: it is cheaper to
draw, and its draw is shared with other noise. At 100 electrons the skewness it leaves out is 0.1,
and the read noise that follows hides that further.
"""

_COST_S_PER_PIXEL = 1.2e-8


class ShotNoise(ImageEffect):
    """Variance equal to the mean."""

    name = "shot-noise"
    what = "light comes in single electrons"
    adds_variance = True

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Call for it always: what is dark now may be lit later."""
        mean_e = conditions.mean_e
        # a moment is made of four images and has twice their noise
        size_dn = 2 * math.sqrt(mean_e / conditions.sequence.takes)
        size_dn /= conditions.sensor.gain_e_per_dn
        cost_s = conditions.pixels * _COST_S_PER_PIXEL
        return always(conditions, size_dn, f"{mean_e:.0f} electrons in a typical pixel", cost_s)

    def apply(self, exposure: Exposure) -> None:
        """Draw few electrons one by one; give many their variance."""
        few = np.flatnonzero(exposure.signal < FEW_E)
        exposure.variance_e2 = exposure.variance_e2 + exposure.signal
        if few.size:
            exposure.variance_e2.reshape(-1)[few] -= exposure.signal.reshape(-1)[few]
            draw_few(exposure, few)


def draw_few(exposure: Exposure, few: NDArray[np.intp]) -> None:
    """Draw the electrons of some pixels, by rising index, one by one."""
    flat = exposure.signal.reshape(-1)
    lit = few[flat[few] > 0]
    flat[lit] = exposure.random.poisson(flat[lit])
