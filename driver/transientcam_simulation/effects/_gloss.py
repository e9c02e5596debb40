"""Gloss: surfaces that send some light on as a dull mirror does."""

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect


class Gloss(LightEffect):
    """A highlight around the direction of reflection; costs nothing once the scene is traced."""

    name = "gloss"
    what = "highlights on glossy surfaces"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the camera sees a highlight."""
        changes = conditions.changes(cls.name)
        if not changes:
            return Call(False, "all surfaces are matt", 0.0, 0.0)
        reason = "{share} of the pixels see a highlight"
        return weigh(conditions, changes, reason)
