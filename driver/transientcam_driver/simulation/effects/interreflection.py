"""Interreflection: light that goes from one scattering surface to another."""

from transientcam_driver.simulation.effects.effect import Call, Conditions, LightEffect, weigh


class DiffuseInterreflection(LightEffect):
    """A continuous tail of late light, by radiosity with times of flight."""

    name = "interreflection"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where surfaces that scatter light each other, and enough light goes that way."""
        share = conditions.facts.indirect_share if conditions.facts else 0.0
        if not share:
            return Call(
                False, "no surfaces light each other, or the scene follows no such light", 0.0, 0.0
            )
        reason = f"about {share:.1%} of the light comes over several surfaces"
        return weigh(conditions, share * conditions.brightness_dn, reason, 0.0)
