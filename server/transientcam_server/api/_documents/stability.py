"""The JSON documents about averaging over time."""

from pydantic import Field

from transientcam_server.api._documents.document import Document, JsonInteger, RequestDocument
from transientcam_server.api._documents.plan import RegionOfPixels


class StabilityRequest(
    RequestDocument, strict=True, json_schema_extra={"examples": [{"frames": 256}]}
):
    """Frames whose averages are held against each other."""

    frames: JsonInteger = Field(default=256, ge=16, le=4096)
    """The longest averaging time is that of an eighth of them."""
    region: RegionOfPixels | None = None
    recording: str | None = Field(default=None, max_length=200)
    """Its id; null for the running camera."""


class StabilityDocument(Document):
    """How far averages of the range are off, by averaging time: the overlapping Allan deviation."""

    frames: int
    every_s: float
    """From one frame to the next."""
    pixels: int
    """That have a range in each frame."""
    averaging_s: list[float]
    median_m: list[float]
    """Of the median pixel."""
    p90_m: list[float]
    """What nine pixels of ten are below."""
    noise_alone_m: list[float]
    """The median pixel's, if it went on as noise does: with the root of the time."""
    best_averaging_s: float
    best_frames: int
    longer_may_help: bool
    """Whether the longest averaging time is the best: more frames may show a longer one."""
