"""Motion: the scene changes from one image of a sequence to the next."""

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect

_COST_S_PER_PIXEL = 8e-8


class MotionDuringSequence(LightEffect):
    """Each image sees the scene at its own time; else all of a sequence see it at the first one's.

    The scene moves from sequence to sequence in any case.
    """

    name = "motion"
    what = "the scene moves while a sequence is captured"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the light of any pixel changes from the first image of a sequence to the last."""
        changes = conditions.changes(cls.name)
        if not changes:
            return Call(False, "nothing moves", 0.0, 0.0)
        cost_s = conditions.pixels * _COST_S_PER_PIXEL
        took = f"the {conditions.sequence_s:.3g} s of a sequence"
        reason = f"{{share}} of the pixels change within {took}"
        return weigh(conditions, changes, reason, cost_s)
