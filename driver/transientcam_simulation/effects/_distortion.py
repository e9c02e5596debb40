"""Distortion: the lens shows places elsewhere than a pinhole does."""

from dataclasses import replace

from transientcam_simulation.base import TYPICAL_LENS
from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect


class Distortion(LightEffect):
    """Bends the camera's rays; costs nothing once the scene is traced."""

    name = "distortion"
    what = "straight lines bend in the lens"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the lens bends rays to other light."""
        if not conditions.lens.bends:
            return Call(False, "the lens shows straight lines straight", 0.0, 0.0)
        k1 = conditions.lens.distortion[0]
        reason = f"radial distortion k1 = {k1:g} and an axis off the middle by "
        reason += f"({conditions.lens.centre[0]:g}, {conditions.lens.centre[1]:g})"
        changes = conditions.changes(cls.name)
        return weigh(conditions, changes, reason) if changes else Call(False, reason, 0.0, 0.0)

    @classmethod
    def forced_on(cls, conditions: Conditions) -> Conditions:
        """Return conditions with a typical lens, where the scene's is a pinhole."""
        if conditions.lens.bends:
            return conditions
        lens = replace(conditions.lens, distortion=TYPICAL_LENS.distortion)
        return replace(conditions, lens=lens)
