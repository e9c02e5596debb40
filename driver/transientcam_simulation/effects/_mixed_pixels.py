"""Mixed pixels: a pixel sees an area, with all that is in it."""

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect

_COST_S_PER_PIXEL = 3e-9  # only where the scene moves, else it is done once


class MixedPixels(LightEffect):
    """Pixels that silhouettes, shadows or edges of colours cross see the mean over their area."""

    name = "mixed-pixels"
    what = "a pixel at an edge sees both sides of it"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where light differs within a pixel, at any frequency that is measured."""
        changes = conditions.changes(cls.name)
        if not changes:
            return Call(False, "the scene has no edges", 0.0, 0.0)
        cost_s = conditions.pixels * _COST_S_PER_PIXEL if conditions.moves else 0.0
        reason = "an edge crosses {share} of the pixels"
        if conditions.facts is not None and conditions.facts.too_thin:
            names = ", ".join(conditions.facts.too_thin).replace("{", "{{").replace("}", "}}")
            reason += f"; too thin for a share, as it moves: {names}"
        return weigh(conditions, changes, reason, cost_s)
