"""JSON documents about the simulated world."""

from typing import Annotated, Final, Literal

from pydantic import AliasChoices, Field

from transientcam_server.api._documents.document import Document, RequestDocument
from transientcam_server.api._documents.sequence import SequenceDocument

MAX_DEFINITION: Final = 65_536
"""Characters of a scene that a client sends."""
Choice = Literal["auto", "on", "off"]


class SceneDocument(Document):
    """A scene that comes along."""

    name: str
    description: str


class SimulationDocument(Document):
    """The simulated world before the camera."""

    scene: str
    effects: dict[str, Choice]
    """What was chosen for effects by name, in place of the scene's own choice."""
    scenes: list[SceneDocument]
    """What the camera can be put before."""
    diffusor: bool
    """Whether filter and diffuser are before the lens, and hide the scene."""
    plugged: bool
    """Whether the simulated cable is in."""
    faults: list[str]
    """What can be made to go wrong."""


class SimulationRequest(
    RequestDocument,
    json_schema_extra={"examples": [{"scene": "corner", "effects": {"ambient": "on"}}]},
):
    """What the camera should be put before; what is absent stays."""

    scene: Annotated[str, Field(max_length=64)] | None = None
    definition: Annotated[str, Field(max_length=MAX_DEFINITION)] | None = None
    """In its place the text of a scene's file (TOML); it may name no other file."""
    effects: Annotated[dict[str, Choice], Field(max_length=64)] | None = None
    """By name, in place of all earlier choices; of the others the scene decides."""
    diffuser: Annotated[
        bool | None, Field(validation_alias=AliasChoices("diffuser", "diffusor"))
    ] = None
    """Put filter and diffuser before the lens, to measure a calibration, or take them away.

    Also accepted as `diffusor`, which answers call it."""


class FaultRequest(RequestDocument, json_schema_extra={"examples": [{"fault": "corrupt-image"}]}):
    """What should go wrong."""

    fault: Literal["unplug", "replug", "corrupt-image", "drop-image"]


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
