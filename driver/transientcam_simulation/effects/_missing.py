"""What a scene has and the simulation cannot make: judged as effects are, but never built."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from transientcam_simulation.effects._conditions import Call, Conditions, weigh


class Missing(NamedTuple):
    """A kind of light, in a few words, and why a scene calls for it."""

    name: str
    what: str
    reason: str


MIRRORS_BETWEEN = Missing(
    "mirrors-between",
    "light over a mirror from one scattering surface to another",
    "mirrors show {share} of the pixels' surfaces other lit ones",
)
GLOSS_OF_SURROUNDINGS = Missing(
    "gloss-of-surroundings",
    "gloss that reflects more than the lamp, or shines on surfaces",
    "gloss sends on light of surfaces, or to surfaces, in {share} of the pixels",
)
FURTHER_BOUNCES = Missing(
    "further-bounces",
    "light over more surfaces than the scene's file lets it go",
    "its transport.diffuse_bounces leaves out too much in {share} of the pixels",
)
COARSE_PATCHES = Missing(
    "coarse-patches",
    "light that surfaces give each other, where it changes within a patch",
    "patches are too coarse in {share} of the pixels; more transport.patches may help",
)
BLUR = Missing(
    "blur",
    "what moves blurs while an image is exposed",
    "{share} of the pixels change within an exposure",
)
MISSING = (MIRRORS_BETWEEN, GLOSS_OF_SURROUNDINGS, FURTHER_BOUNCES, COARSE_PATCHES, BLUR)


def missing_calls(conditions: Conditions) -> Iterator[tuple[Missing, Call]]:
    """Judge those that the scene has anything for."""
    if conditions.facts is None:
        return
    exposure_s = conditions.sequence.exposure_s
    for kind in MISSING:
        glimpses, changes = conditions.facts.missing(
            kind.name, conditions.frequencies_hz, during_s=exposure_s
        )
        if any(each.any() for each in changes):
            yield kind, weigh(replace(conditions, glimpses=glimpses), changes, kind.reason)
