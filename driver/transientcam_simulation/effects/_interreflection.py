"""Interreflection: light that goes from one scattering surface to another."""

from dataclasses import replace

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect


class DiffuseInterreflection(LightEffect):
    """A continuous tail of late light, by radiosity with times of flight."""

    name = "interreflection"
    what = "light that surfaces give each other"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where surfaces that scatter light each other, and enough light goes that way."""
        changes = conditions.changes(cls.name)
        if conditions.facts is None or not changes:
            return Call(
                False, "no surfaces light each other, or the scene follows no such light", 0.0, 0.0
            )
        light = sum(float(each.brightness.sum()) for each in conditions.glimpses)
        further = sum(float(each.sum()) for each in changes)
        share = further / (light + further) if further else 0.0
        bounces = conditions.facts.further_bounces(conditions.negligible)
        surfaces = "1 further surface" if bounces == 1 else f"up to {bounces} further surfaces"
        reason = f"about {share:.1%} of the light comes over {surfaces}"
        cost_s = conditions.facts.further_cost_s(
            replace(conditions.noise, white_e=conditions.white_e),
            moments=1 + len(conditions.frequencies_hz),
            image_period_s=conditions.image_period_s,
        )
        return weigh(conditions, changes, reason, cost_s)
