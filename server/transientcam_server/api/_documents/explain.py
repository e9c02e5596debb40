"""The JSON document about the effects that a simulated scene calls for."""

from typing import Literal

from transientcam_server.api._documents.document import Document
from transientcam_server.api._documents.sequence import SequenceDocument


class EffectDocument(Document):
    """One effect's answer for the scene and the sequence."""

    effect: str
    what: str
    """The effect in a few words."""
    choice: Literal["auto", "on", "off", "always", "never"]
    called_for: bool
    built: bool
    reason: str
    size_dn: float
    """The error it causes in one moment, as a root mean square over the lit pixels."""
    relative: float
    """The same of the errors over each pixel's own noise."""
    worst: float
    """The largest error over its noise of any pixel judged."""
    cost_s: float
    """Of one frame, by the order of magnitude."""


class ExplanationDocument(Document):
    """What the simulated scene and the present sequence call for."""

    scene: str
    device: str
    sequence: SequenceDocument
    noise_floor_dn: float
    """Of one moment of a typical pixel."""
    called_above: float
    """An effect is called for above this share of the noise, as a root mean square."""
    called_above_worst: float
    """And above this share of its noise in any pixel."""
    effects: list[EffectDocument]
    not_made: list[EffectDocument]
    """Light that the scene has and the simulation cannot make; images lack it where called for."""
