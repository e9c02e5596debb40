"""The JSON document that says what a simulated scene calls for."""

from typing import Literal

from pydantic import ConfigDict

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

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "scene": "mirrors",
                    "device": "ideal",
                    "sequence": {"base_frequency_hz": 23e6, "harmonics": 3},
                    "noise_floor_dn": 20.5,
                    "called_above": 0.1,
                    "effects": [
                        {
                            "effect": "shot-noise",
                            "choice": "auto",
                            "called_for": True,
                            "built": True,
                            "reason": "7612 electrons in a typical pixel",
                            "size_dn": 19.4,
                            "relative": 0.95,
                            "cost_s": 0.0038,
                        }
                    ],
                }
            ]
        }
    )

    scene: str
    device: str
    sequence: SequenceDocument
    noise_floor_dn: float
    """Of one moment of a typical pixel."""
    called_above: float
    """Share of the noise floor above which an effect is called for."""
    effects: list[EffectDocument]
