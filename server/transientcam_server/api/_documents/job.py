"""The JSON documents about jobs."""

from typing import Any, Literal

from pydantic import Field

from transientcam_server.api._documents.document import Document


class JobDocument(Document):
    """Long work, and where it stands."""

    id: str
    kind: str
    """What it does: `calibration` measures one, `plan` makes one, `tradeoff` finds the front,
    `series` compares settings."""
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: float = Field(ge=0.0, le=1.0)
    step: str
    """What is being done, in a word or two."""
    result: dict[str, Any] | None = None
    """What came of it; null until it is done. A `tradeoff` has the front so far while it runs, and
    keeps that when it is cancelled."""
    problem: dict[str, Any] | None = None
    """Why it failed: a problem as a request would be answered with."""
    created_at: float
    """Unix time."""
    finished_at: float | None = None
    """Unix time; null until then."""


class JobsDocument(Document):
    """All jobs that are remembered."""

    jobs: list[JobDocument]
    """The newest first."""
