"""The kinds of notices, and what each carries beside its kind."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

_Types = str | tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NoticeKind:
    """One kind of notice."""

    name: str
    summary: str
    keys: Mapping[str, _Types] = field(default_factory=dict)
    """The names of JSON types by key; several where it may be either."""
    optional: tuple[str, ...] = ()
    """Those of them that may be left out."""


_OR_NIL = ("string", "null")

NOTICES: Final[dict[str, NoticeKind]] = {
    kind.name: kind
    for kind in (
        NoticeKind(
            "dropped",
            "this client was too slow for frames of a channel",
            {
                "channel": "integer",
                "count": "integer",
                "total": "integer",
                "unacknowledged": "integer",
            },
            optional=("unacknowledged",),
        ),
        NoticeKind(
            "gap",
            "frames that were asked for and cannot be had",
            {"from": "integer", "to": "integer", "reason": "string"},
        ),
        NoticeKind(
            "lost-images",
            "images were lost or corrupt between camera and daemon",
            {"count": "integer", "frame": "integer"},
        ),
        NoticeKind("camera-lost", "the camera does not answer", {"reason": "string"}),
        NoticeKind("camera-back", "the camera answers again"),
        NoticeKind("light-arming", "the light goes on after this time", {"in_s": "number"}),
        NoticeKind(
            "light-off",
            "the capture ended, and stays so until somebody starts it",
            {"because": "string", "reason": "string"},
        ),
        NoticeKind(
            "light-unconfirmed", "the light was to go off and may be on", {"reason": "string"}
        ),
        NoticeKind("light-confirmed", "that has ended: it is off, or was started again"),
        NoticeKind(
            "sequence-changed",
            "what is captured from now on",
            {"sequence": "object", "channels": "array"},
        ),
        NoticeKind("recording-started", "a recording began", {"recording": "string"}),
        NoticeKind(
            "recording-dropped",
            "frames that the disk was too slow for",
            {"count": "integer", "total": "integer"},
        ),
        NoticeKind(
            "disk-stalled", "the disk of the recordings does not answer", {"recording": "string"}
        ),
        NoticeKind(
            "recording-stopped",
            "a recording ended",
            {
                "recording": "string",
                "reason": "string",
                "problem": _OR_NIL,
                "frames": "integer",
                "dropped_frames": "integer",
            },
        ),
        NoticeKind(
            "lease-changed",
            "who controls the camera",
            {"change": "string", "holder": "string", "from": "string"},
            optional=("from",),
        ),
        NoticeKind(
            "calibration-changed",
            "which gains frames are computed with from now on, and whether these are doubtful",
            {"calibration_id": "string", "reason": _OR_NIL, "warning": _OR_NIL},
            optional=("warning",),
        ),
        NoticeKind(
            "noise-differs",
            "images scatter otherwise than the stated sensor's, or, without a reason, no longer",
            {"ratio": "number", "reason": _OR_NIL},
        ),
        NoticeKind(
            "reconstruction-changed",
            "how frames are computed from now on",
            {"reconstruction": "object"},
        ),
        NoticeKind(
            "simulation-changed",
            "the simulated camera stands before another scene, or with other effects",
            {"scene": "string", "effects": "object", "diffusor": "boolean"},
            optional=("diffusor",),
        ),
        NoticeKind("job-changed", "a job began or ended", {"job": "object"}),
    )
}
"""Every kind by its name; a client ignores unknown ones."""
