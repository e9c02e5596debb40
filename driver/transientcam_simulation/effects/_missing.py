"""What a scene has and the simulation cannot make: judged as effects are, but never built."""

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from transientcam_simulation.effects._conditions import Call, Conditions, weigh


class Missing(NamedTuple):
    """A kind of light, in a few words, and why a scene calls for it."""

    name: str
    what: str
    reason: str


_FILE: Final = Path(__file__).with_name("missing.toml")
MISSING = [Missing(name, **of) for name, of in tomllib.loads(_FILE.read_text("utf-8")).items()]


def missing_calls(conditions: Conditions) -> Iterator[tuple[Missing, Call]]:
    """Judge those that the scene has anything for."""
    facts = conditions.facts
    if facts is None:
        return
    for kind in MISSING:
        glimpses, lacks = facts.missing(kind.name, conditions.frequencies_hz)
        if any(each.any() for each in lacks):
            yield kind, weigh(replace(conditions, glimpses=glimpses), lacks, kind.reason)
