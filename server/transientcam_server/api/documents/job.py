"""The JSON documents about jobs."""

from typing import Any, Final, Literal

from pydantic import ConfigDict, Field, JsonValue

from transientcam_server.api.documents.document import Document

EXAMPLE: Final[dict[str, JsonValue]] = {
    "id": "5a0c1f6be2d4",
    "kind": "calibration",
    "state": "running",
    "progress": 0.35,
    "step": "capturing",
    "result": None,
    "problem": None,
    "created_at": 1795161600.25,
    "finished_at": None,
}


class JobDocument(Document):
    """Long work, and where it stands."""

    model_config = ConfigDict(json_schema_extra={"examples": [EXAMPLE]})

    id: str
    kind: str
    """What it does: `calibration` measures one."""
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: float = Field(ge=0.0, le=1.0)
    step: str
    """What is being done, in a word or two."""
    result: dict[str, Any] | None = None
    """What came of it; null until it is done."""
    problem: dict[str, Any] | None = None
    """Why it failed: a problem as a request would be answered with."""
    created_at: float
    """Unix time."""
    finished_at: float | None = None
    """Unix time; null until then."""


class JobsDocument(Document):
    """All jobs that are remembered."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"jobs": [EXAMPLE]}]})

    jobs: list[JobDocument]
    """The newest first."""
