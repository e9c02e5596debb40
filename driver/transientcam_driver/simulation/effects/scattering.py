"""Scattering: light enters a translucent surface and comes back later."""

import math

from transientcam_driver.simulation.effects.effect import Call, Conditions, LightEffect, weigh


class Scattering(LightEffect):
    """Each return of such a surface is an exponentially modified Gaussian."""

    name = "scattering"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the camera sees a translucent surface."""
        facts = conditions.facts
        if facts is None or facts.scatter is None or not facts.scatter_share:
            return Call(False, "no translucent surface in sight", 0.0, 0.0)
        lost = abs(complex(facts.scatter.transfer(conditions.highest_hz)) - 1)
        share = facts.scatter_share
        reason = (
            f"{share:.0%} of the pixels see a material whose light comes back "
            f"{facts.scatter.decay_s * 1e9:.2g} ns late"
        )
        size_dn = lost * math.sqrt(share) * conditions.brightness_dn
        return weigh(conditions, size_dn, reason, 0.0)
