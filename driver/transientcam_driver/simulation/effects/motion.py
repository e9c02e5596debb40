"""Motion: the scene changes from one image of a sequence to the next."""

import numpy as np

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_driver.simulation.effects.effect import Call, Conditions, LightEffect, weigh

_COST_S_PER_PIXEL = 1.2e-7


class MotionDuringSequence(LightEffect):
    """Each image sees the scene at its own time; else all of a sequence see it at the first one's.

    The scene moves from sequence to sequence in any case.
    """

    name = "motion"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where something moves far enough during the images of one moment.

        Its error is that of a pixel that the silhouette leaves, over the share of such pixels, and
        the phase of the distance moved.
        """
        facts = conditions.facts
        cost_s = conditions.pixels * _COST_S_PER_PIXEL
        if facts is None or not facts.speed_m_s:
            return Call(False, "nothing moves", 0.0, 0.0)
        way_m = facts.speed_m_s * conditions.images_per_moment_s
        phase_rad = 4 * np.pi * conditions.highest_hz * way_m / SPEED_OF_LIGHT_M_S
        size_dn = phase_rad * np.sqrt(facts.moving_share) * conditions.brightness_dn
        reason = f"up to {way_m * 1e3:.1f} mm during the images of one moment"
        return weigh(conditions, float(size_dn), reason, cost_s)
