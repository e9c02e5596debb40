"""Effects on light on its way through the scene: over mirrors, within surfaces, between them."""

from dataclasses import replace
from typing import ClassVar

from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightEffect

_MIXED_COST_S_PER_PIXEL = 3e-9  # only where the scene moves, else it is done once
_MOTION_COST_S_PER_PIXEL = 8e-8
_CARRIED_COST_S_PER_PIXEL = 5e-7  # and surface, of a camera or a lamp that moves


class _InGeometry(LightEffect):
    """One that is called for by the light that it changes in the scene's geometry."""

    without: ClassVar[str]
    """Why it is not called for where it changes nothing."""
    where: ClassVar[str]
    """Why it is, with the ``{share}`` of the pixels."""

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the camera sees light that it changes, at any frequency that is measured."""
        changes = conditions.changes(cls.name)
        if not changes:
            return Call(False, cls.without, 0.0, 0.0)
        return weigh(conditions, changes, cls.reason(conditions), cls.cost_s(conditions))

    @classmethod
    def reason(cls, conditions: Conditions) -> str:
        """Return why it is called for."""
        return cls.where

    @classmethod
    def cost_s(cls, conditions: Conditions) -> float:
        """Return what one image costs; nothing, once the scene is traced."""
        return 0.0


class MirrorPaths(_InGeometry):
    """Further returns, by image points."""

    name = "mirror-paths"
    what = "light over mirrors"
    without = "no light comes over mirrors"
    where = "{share} of the pixels see light over mirrors"


class GlassPanes(_InGeometry):
    """Rays part at panes, and light is less and later behind them."""

    name = "glass"
    what = "what panes let through, mirror and scatter"
    without = "no pane stands in the scene"
    where = "{share} of the pixels see light that has met a pane"


class Gloss(_InGeometry):
    """A lobe around the direction of reflection, as of a dull mirror."""

    name = "gloss"
    what = "highlights on glossy surfaces, and what they reflect"
    without = "all surfaces are matt"
    where = "{share} of the pixels see light that gloss reflects"


class Scattering(_InGeometry):
    """Each return of a translucent surface is an exponentially modified Gaussian."""

    name = "scattering"
    what = "light that enters a surface and comes back late"
    without = "no surface lets light in"
    where = "{share} of the pixels see a material that light enters"


class MixedPixels(_InGeometry):
    """Pixels that silhouettes, shadows or edges of colours cross see the mean over their area."""

    name = "mixed-pixels"
    what = "a pixel at an edge sees both sides of it"
    without = "the scene has no edges"
    where = "an edge crosses {share} of the pixels"

    @classmethod
    def reason(cls, conditions: Conditions) -> str:
        """Name what is too thin as well."""
        if conditions.facts is None or not conditions.facts.too_thin:
            return cls.where
        names = ", ".join(conditions.facts.too_thin).replace("{", "{{").replace("}", "}}")
        return f"{cls.where}; too thin for a share, as it moves: {names}"

    @classmethod
    def cost_s(cls, conditions: Conditions) -> float:
        """Return that of a scene that moves."""
        return conditions.pixels * _MIXED_COST_S_PER_PIXEL if conditions.moves else 0.0


class MotionDuringSequence(_InGeometry):
    """Each image sees the scene at its own time; else all of a sequence see it at the first one's.

    The scene moves from sequence to sequence in any case.
    """

    name = "motion"
    what = "the scene moves while a sequence is captured"
    without = "nothing moves"

    @classmethod
    def reason(cls, conditions: Conditions) -> str:
        """Name the time of a sequence."""
        took = f"the {conditions.sequence_s:.3g} s of a sequence"
        return f"{{share}} of the pixels change within {took}"

    @classmethod
    def cost_s(cls, conditions: Conditions) -> float:
        """Return that of light at a time of its own."""
        return _instant_s(conditions)


def _instant_s(conditions: Conditions) -> float:
    surfaces = conditions.facts.carried_past if conditions.facts else 0
    return conditions.pixels * (_MOTION_COST_S_PER_PIXEL + surfaces * _CARRIED_COST_S_PER_PIXEL)


class MotionBlur(_InGeometry):
    """An image is the mean over so many instants of its exposure; else it is its middle."""

    name = "blur"
    what = "what moves blurs while an image is exposed"
    without = "nothing moves"
    where = ""
    instants: ClassVar[int] = 8
    _least_pixels: ClassVar[float] = 0.5
    """That anything moves in an exposure: light is not computed at closer places (`Steps`)."""

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where something moves so far that its edges pass pixels unevenly."""
        call, facts = super().called_for(conditions), conditions.facts
        if facts is None or not facts.pixels_per_s:
            return call
        moved = facts.pixels_per_s * conditions.sequence.exposure_s
        reason = f"the fastest moves by {moved:.2g} pixels in an exposure"
        return replace(call, called=call.called and moved > cls._least_pixels, reason=reason)

    @classmethod
    def cost_s(cls, conditions: Conditions) -> float:
        """Return that of light at further times."""
        return (cls.instants - 1) * _instant_s(conditions)


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
