"""Effects of the lens: it bends and darkens light."""

from dataclasses import replace

import numpy as np

from transientcam_simulation.base import TYPICAL_LENS
from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect, LightPlanes, PlaneEffect


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


class Vignetting(PlaneEffect):
    """Light falls with a power of the cosine to the lens's axis; the fourth is a thin lens's."""

    name = "vignetting"
    what = "the lens is darker towards the corners"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self._share = (conditions.cosine**conditions.lens.vignetting).astype(np.float32)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the lens darkens pixels that light reaches."""
        power = conditions.lens.vignetting
        if not power:
            return Call(False, "the lens passes the same light everywhere", 0.0, 0.0)
        changes = tuple((1 - each.cosine**power) * each.brightness for each in conditions.glimpses)
        least = min(float(each.cosine.min()) for each in conditions.glimpses) ** power
        return weigh(conditions, changes, f"down to {least:.0%} of the light in the corners")

    @classmethod
    def forced_on(cls, conditions: Conditions) -> Conditions:
        """Return conditions with a thin lens, where the scene's passes light evenly."""
        if conditions.lens.vignetting:
            return conditions
        lens = replace(conditions.lens, vignetting=TYPICAL_LENS.vignetting)
        return replace(conditions, lens=lens)

    def on_light(self, planes: LightPlanes) -> None:
        """Darken all light."""
        share = self._share[planes.region] if self._share.ndim else self._share
        planes.constant = planes.constant * share
        planes.mean = planes.mean * share
        for k, term in planes.terms.items():
            planes.terms[k] = term * share
