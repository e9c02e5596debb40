"""The JSON documents of recordings."""

import re
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, Field, JsonValue

from transientcam_server.api._documents.document import Document, RequestDocument
from transientcam_server.api._documents.sequence import AppliedDocument
from transientcam_server.recording import tags_of

_ANNOTATIONS_EXAMPLE: dict[str, JsonValue] = {"sample": "corner, white paint", "operator": "Åsa"}


_ONE_LINE: Final = r"^(?=.*\S)[^\x00-\x1f\x7f-\x9f\u2028\u2029]+$"
"""Text without control characters and line ends, that is not blank."""


def _one_line(name: str) -> str:
    if not re.match(_ONE_LINE, name):
        raise ValueError("must be a line of text without control characters")
    if re.search("[\ud800-\udfff]", name):  # JSON can escape half a character, UTF-8 has none
        raise ValueError("must be text without halves of characters (surrogates)")
    return name


class RecordingDocument(Document):
    """A recording: what is in it, and how it is."""

    id: str
    """What requests call it."""
    name: str
    """What people call it."""
    state: Literal["recording", "finishing", "complete", "interrupted", "recovering", "damaged"]
    """`interrupted`: its writer died, and the next start of the service recovers it."""
    frames: int
    """Written: they survive the death of the service."""
    synced_frames: int | None = None
    """Of these, brought to the disk: they survive a power cut, too. Null of an unfinished one that
    is not written here."""
    dropped_frames: int
    """Frames the disk was too slow for; each frame in the file states how many before it."""
    size_bytes: int
    started_s: float | None = None
    """Unix time."""
    duration_s: float
    reason: str | None = None
    """Why it ended: `stopped`, `duration`, `size`, `frames`, `disk-space`, `sequence-changed`,
    `failed`, `shutdown`, or `interrupted`; null while it runs."""
    problem: str | None = None
    """What went wrong, if anything did."""
    annotations: dict[str, Any]
    tags: list[str]
    """Those of the annotation `tags`: a list, or a text with commas between them."""
    sequence: AppliedDocument | None = None
    camera: dict[str, Any]
    calibration: dict[str, Any]
    width: int | None = None
    height: int | None = None
    versions: dict[str, str]
    """Of the software that recorded it."""
    limits: dict[str, float | None] | None = None
    """When it ends by itself; null once it has ended."""
    history_frames: int | None = None
    """Of the past that it began with; only in the answer to the request that started it."""


class RecordingLimitsDocument(Document):
    """When recordings end by themselves, whatever was requested; null without such a limit."""

    max_duration_s: float | None = None
    max_bytes: int | None = None
    min_free_bytes: int
    """What the disk keeps."""
    max_upload_bytes: int
    """No recording that is sent here is larger."""


class RecordingTotalsDocument(Document):
    """All recordings that match, on this page and on others."""

    recordings: int
    frames: int
    size_bytes: int
    duration_s: float


class RecordingsDocument(Document):
    """Recordings that match, in the order that was asked for."""

    directory: str
    """Where they are kept, on the machine of the service."""
    free_bytes: int | None = None
    """What its disk has left; null before the first recording made the directory."""
    active: str | None = None
    """The one that runs."""
    limits: RecordingLimitsDocument
    recordings: list[RecordingDocument]
    """Those of this page."""
    next_offset: int | None = None
    """Where the next page begins; null on the last one."""
    totals: RecordingTotalsDocument
    tags: dict[str, int]
    """How many of all that match have each tag, the most frequent first."""


class TimelineDocument(Document):
    """Which frames a recording has, and when they were captured."""

    first: int | None = None
    """Recorded frames are counted from 1; null before there is any."""
    last: int | None = None
    count: int
    duration_s: float
    """From the first to the last."""
    frame_rate_hz: float | None = None
    """On average; null before there are two."""
    host_time_s: float | None = None
    """Capture of the first frame, Unix time."""
    times_s: list[float]
    """Capture of every `times_step`-th frame, beginning with the first, after the first."""
    times_step: int
    """1 unless there are very many."""


class RecordingRequest(
    RequestDocument,
    json_schema_extra={
        "examples": [
            {"name": "corner at 3 m", "duration_s": 30.0, "annotations": _ANNOTATIONS_EXAMPLE},
            {},
        ]
    },
):
    """What should be recorded, and until when; the least of all limits ends it."""

    name: (
        Annotated[
            str,
            AfterValidator(_one_line),
            Field(min_length=1, max_length=200, json_schema_extra={"pattern": _ONE_LINE}),
        ]
        | None
    ) = None
    """For people; without one it is named after the time."""
    duration_s: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    """From now on."""
    max_bytes: int | None = Field(default=None, ge=1)
    frames: int | None = Field(default=None, ge=1)
    """Those of the past count, too."""
    history_s: float | None = Field(default=None, ge=0, le=3600, allow_inf_nan=False)
    """Begin with the frames of so many seconds before, as far as `GET /frames` has them; 0 is
    without."""
    frame: int | None = Field(default=None, ge=1)
    """Only this one of the frames that `GET /frames` has; it is frame 1 of the recording."""
    annotations: dict[str, Any] = Field(default_factory=dict)
    """Anything worth keeping with it, at most 16 KiB as JSON."""


class RecordingChange(
    RequestDocument, json_schema_extra={"examples": [{"annotations": _ANNOTATIONS_EXAMPLE}]}
):
    """What can be changed of a recording."""

    annotations: dict[str, Any]
    """Replace those it has."""


def document(described: dict[str, Any]) -> RecordingDocument:
    """Return the library's description of a recording as its document."""
    return RecordingDocument.model_validate(described | {"tags": tags_of(described["annotations"])})


class ProductStoreDocument(Document):
    """Products of all frames of a recording, as `transientcam reconstruct` wrote them."""

    id: str
    """Name of the store, without `.zarr`."""
    generation: str
    """Names what it holds. At `/products/{id}~{generation}/zarr` a reader gets an error instead of
    the data of another store that has taken its place."""
    recording: str = Field(validation_alias="recording_id")
    """Id of the recording whose products these are; it may have been deleted."""
    name: str = Field(validation_alias="title")
    """What people call that."""
    state: Literal["complete", "unfinished", "damaged"]
    """`unfinished`: frames are still computed, or an interrupted run was not gone on with.
    `damaged`: it cannot be read, and what is said of it is empty."""
    problem: str | None = None
    """Why it cannot be read."""
    frames: int
    products: list[str]
    bins: int
    """Times of flight of products over time."""
    reconstruction: dict[str, Any]
    """Settings that they were computed with."""


class ProductStoresDocument(Document):
    """Stores of products beside the recordings, by their ids."""

    directory: str
    """Where they are, on the machine of the service: that of the recordings."""
    stores: list[ProductStoreDocument]
