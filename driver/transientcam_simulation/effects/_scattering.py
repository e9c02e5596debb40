"""Scattering: light enters a translucent surface and comes back later."""

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect


class Scattering(LightEffect):
    """Each return of such a surface is an exponentially modified Gaussian."""

    name = "scattering"
    what = "light that enters a surface and comes back late"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the camera sees a translucent surface."""
        changes = conditions.changes(cls.name)
        if not changes:
            return Call(False, "no surface lets light in", 0.0, 0.0)
        reason = "{share} of the pixels see a material that light enters"
        return weigh(conditions, changes, reason)
