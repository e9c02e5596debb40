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
