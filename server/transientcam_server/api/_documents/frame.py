"""The JSON documents about frames; what is known of one is stated in `transientcam.documents`."""

from pydantic import AliasPath, ConfigDict, Field, with_config

from transientcam import documents
from transientcam.documents import FrameDocument as FrameDocument
from transientcam_server.api._documents.document import Document

for _each in (
    documents.PixelCountsDocument,
    documents.PredictedStdDocument,
    documents.TrustCountsDocument,
    documents.RangeAccuracyDocument,
    documents.FramesAveragedDocument,
    documents.HopDocument,
    documents.FrameDocument,
):
    with_config(ConfigDict(use_attribute_docstrings=True))(_each)


class HistoryDocument(Document):
    """Which frames can be had, and how many may be kept."""

    first: int | None = None
    """Null before there is any."""
    last: int | None = None
    """Number of the latest frame."""
    count: int
    bytes: int = Field(validation_alias="size_bytes")
    """That their raw images take."""
    seconds: float = Field(validation_alias="span_s")
    """From the arrival of the first to that of the last."""
    limit_bytes: int = Field(validation_alias=AliasPath("settings", "max_bytes"))
    limit_seconds: float = Field(validation_alias=AliasPath("settings", "seconds"))


class ComplexDocument(Document):
    """A complex number."""

    re: float
    im: float


class ReturnDocument(Document):
    """Light that came back after one time of flight."""

    time_s: float
    weight: float
    """In DN."""


class TruthDocument(Document):
    """What the simulated scene really holds at a pixel."""

    kind: str
    range_m: float | None = None
    """That of the surface which is seen, lit or not."""
    direct_share: float | None = None
    """Of the light, what came straight from the lamp by that surface: 0 where there is none."""
    direct: float
    """The first return."""
    brightness: float
    returns: list[ReturnDocument]
    """At most the 16 strongest."""


class BoundsDocument(Document):
    """What every density with these moments lies between, smoothed (Sec. 5.2)."""

    radius: float
    """Of the Poisson kernel that it is smoothed with."""
    lower_per_s: list[float | None]
    """In DN/s, at `time_s` of the pixel."""
    upper_per_s: list[float | None]


class PixelDocument(Document):
    """Everything about one pixel of one frame."""

    meta: FrameDocument
    x: int
    y: int
    range_m: float | None = None
    """Of the first return; null without one."""
    direct: float
    indirect: float
    brightness: float
    uniform: float
    validity: float | None = None
    """Smallest eigenvalue of the moments over the brightness; null without light."""
    flags: list[str]
    """What was wrong with the pixel; empty for nothing."""
    moments: list[ComplexDocument]
    """b_0 to b_m in DN; of multiples with gaps: b_0, or 0, and those."""
    returns: list[ReturnDocument]
    """By time of flight: the sparse estimate (Theorem 2), with gaps the estimator's."""
    time_s: list[float]
    """Of density, cumulative and bounds; all are empty for multiples with gaps."""
    density_per_s: list[float | None]
    """The maximum entropy estimate (Theorem 1) in DN/s; null where the pixel has none."""
    cumulative: list[float | None]
    """Light up to each time of flight in DN."""
    bounds: BoundsDocument
    truth: TruthDocument | None = None
    """Null where the camera is a real one."""
