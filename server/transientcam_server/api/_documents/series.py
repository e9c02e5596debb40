"""The JSON documents about series: frames at several settings, compared."""

from typing import Any

from pydantic import Field

from transientcam_server.api._documents.document import JsonInteger, RequestDocument
from transientcam_server.api._documents.plan import RegionOfPixels
from transientcam_server.settings import ReconstructionSettings

MAX_SETTINGS = 64
_EXAMPLE = {"settings": [{"sequence": {"harmonics": 3}}, {"sequence": {"harmonics": 4}}]}


class SettingRequest(RequestDocument):
    """A row of a series; what is absent stays as it is at present."""

    sequence: dict[str, Any] = Field(default_factory=dict)
    """Fields of `PUT /sequence`."""
    reconstruction: ReconstructionSettings = ReconstructionSettings()
    """Fields of `PUT /reconstruction`; frames are not averaged over `still_frames`."""


class SeriesRequest(RequestDocument, json_schema_extra={"examples": [_EXAMPLE]}):
    """What is to be compared."""

    settings: list[SettingRequest] = Field(min_length=1, max_length=MAX_SETTINGS)
    frames: JsonInteger = Field(default=100, ge=2, le=10_000)
    """At each setting."""
    target_m: float | None = Field(default=None, gt=0)
    """`within_share` is of the ranges that are so close to the truth, or to the plane."""
    region: RegionOfPixels | None = None
    """Whose pixels count; null for all."""
