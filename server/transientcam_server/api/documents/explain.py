"""The JSON document about the effects that a simulated scene calls for."""

from typing import Literal

from transientcam_server.api.documents.document import Document
from transientcam_server.api.documents.sequence import SequenceDocument


class EffectDocument(Document):
    """One effect's answer for the scene and the sequence."""

    effect: str
    choice: Literal["auto", "on", "off", "always"]
    called_for: bool
    built: bool
    reason: str
    size_dn: float
    """The error it causes in one moment of a typical pixel, as a root mean square."""
    relative: float
    """That over the noise floor."""
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
    """Share of the noise floor above which an effect is called for."""
    effects: list[EffectDocument]
