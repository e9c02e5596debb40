"""The JSON documents about the lease."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from transientcam_server.api._documents.document import Document, RequestDocument
from transientcam_server.camera import DEFAULT_DURATION_S, MAX_DURATION_S, MIN_DURATION_S

_Holder = Annotated[
    str,
    StringConstraints(
        strip_whitespace=True, min_length=1, max_length=80, pattern=r"^[^\x00-\x1f\x7f]*$"
    ),
]
_Duration = Annotated[float, Field(ge=MIN_DURATION_S, le=MAX_DURATION_S, allow_inf_nan=False)]


class LeaseDocument(Document):
    """Who controls the camera."""

    held: bool
    """Whether a client does; where none does, every client may."""
    holder: str | None = None
    """The name that the holder gave itself."""
    expires_in_s: float | None = None
    """How long the lease lasts unless it is renewed."""
    duration_s: float | None = None
    """How long it lasts after it was granted or renewed."""
    on_lapse: Literal["stop", "keep"] | None = None
    """What becomes of the capture, and so of the light, when it is not renewed in time."""


class GrantedLeaseDocument(LeaseDocument):
    """A lease, for the eyes of its holder."""

    lease_id: str
    """To be sent in the header Transientcam-Lease with every change; no other client sees it."""


class LeaseRequest(
    RequestDocument,
    json_schema_extra={"examples": [{"holder": "alignment on bench 2", "duration_s": 30.0}]},
):
    """Which client is to control the camera, and on which terms."""

    holder: _Holder
    """What to call you, for others to read."""
    duration_s: _Duration = DEFAULT_DURATION_S
    """How long the lease lasts unless it is renewed."""
    on_lapse: Literal["stop", "keep"] = "stop"
    """What becomes of the capture, and so of the light, when you do not renew it in time."""
    takeover: bool = Field(default=False, strict=True)
    """Take it from the client that has it, which is notified with all others."""


class LeaseRenewal(Document, extra="forbid", json_schema_extra={"examples": [{}]}):
    """New terms of a lease; what is absent stays as it is."""

    duration_s: _Duration | None = None
    on_lapse: Literal["stop", "keep"] | None = None
