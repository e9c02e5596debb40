"""Mixed pixels: a pixel at an edge sees both sides of it."""

import numpy as np

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_driver.simulation.effects.effect import Call, Conditions, LightEffect, weigh

_COST_S_PER_EDGE = 2e-6  # pixel; only where the scene moves, else it is done once


class MixedPixels(LightEffect):
    """Pixels at edges are traced along several rays."""

    name = "mixed-pixels"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where range jumps from one pixel to the next."""
        share, step_m = conditions.facts.edges if conditions.facts else (0.0, 0.0)
        if not share:
            return Call(False, "range jumps nowhere", 0.0, 0.0)
        # two returns of random shares: their sum is off by up to the whole difference
        turn = 4 * np.pi * conditions.sequence.base_frequency_hz * step_m / SPEED_OF_LIGHT_M_S
        difference = min(2.0, abs(np.exp(1j * min(turn, np.pi)) - 1))
        size_dn = difference / np.sqrt(12) * np.sqrt(share) * conditions.brightness_dn
        moving = bool(conditions.facts and conditions.facts.speed_m_s)
        cost_s = share * conditions.pixels * _COST_S_PER_EDGE if moving else 0.0
        reason = f"{share:.1%} of the pixels lie at an edge, of {step_m:.2g} m"
        return weigh(conditions, float(size_dn), reason, cost_s)
