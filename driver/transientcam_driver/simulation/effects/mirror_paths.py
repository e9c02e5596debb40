"""Mirror paths: light that comes to a surface over mirrors."""

from transientcam_driver.simulation.effects.effect import Call, Conditions, LightEffect, weigh


class MirrorPaths(LightEffect):
    """Further returns, by image points; costs nothing once the scene is traced."""

    name = "mirror-paths"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where mirrors send light to what the camera sees."""
        share = conditions.facts.mirror_share if conditions.facts else 0.0
        if not share:
            return Call(False, "no light comes over mirrors", 0.0, 0.0)
        reason = f"{share:.1%} of the light comes over mirrors"
        return weigh(conditions, share * conditions.brightness_dn, reason, 0.0)
