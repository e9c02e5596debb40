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


MISSING = [
    Missing(*each.split(" | "))
    for each in (
        "mirrors-between | light over a mirror from one surface to another where some move | "
        "mirrors show {share} of the pixels' surfaces other lit ones",
        "gloss-of-surroundings | gloss that reflects more than the lamp where some move, or "
        "the lamp from curved surfaces to others | "
        "gloss sends on light of surfaces, or to surfaces, in {share} of the pixels",
        "further-bounces | light over more surfaces than the scene's file lets it go | "
        "its transport.diffuse_bounces leaves out too much in {share} of the pixels",
        "between-meshes | light that a mesh and other surfaces, or its parts, give each other | "
        "it brings too much in {share} of the pixels",
        "coarse-patches | light that surfaces give each other, where it changes within a patch | "
        "patches are too coarse in {share} of the pixels; more transport.patches may help",
    )
]


def missing_calls(conditions: Conditions) -> Iterator[tuple[Missing, Call]]:
    """Judge those that the scene has anything for."""
    facts = conditions.facts
    if facts is None:
        return
    for kind in MISSING:
        glimpses, lacks = facts.missing(kind.name, conditions.frequencies_hz)
        if any(each.any() for each in lacks):
            yield kind, weigh(replace(conditions, glimpses=glimpses), lacks, kind.reason)
