"""Long work of a daemon, seen from afar.

`Jobs` serves `Camera` and `AsyncCamera` alike: what a method returns is a document for one, and to
be awaited for the other.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final, Generic, TypeVar
from urllib.parse import quote

from transientcam.requests import request

_Document = TypeVar("_Document")
WAIT_S: Final = 10.0
"""How long one request waits for the end of a job."""
PROGRESS_EVERY_S: Final = 0.5
"""The same where somebody wants to be told meanwhile."""
OnProgress = Callable[[Mapping[str, Any]], None]


class Jobs(Generic[_Document]):
    """The jobs of a daemon; made by ``camera.jobs``.

    Methods return documents, as ``GET /api/v1/jobs/{id}`` has them: ``id``, ``kind``, ``state``,
    ``progress``, ``step``, ``result``, ``problem``.
    """

    def __init__(self, ask: Callable[[request.Request[dict[str, Any]]], _Document]) -> None:
        self._ask = ask

    def all(self) -> _Document:
        """Return what runs, what waits and the last ones that have ended, in ``jobs``."""
        return self._ask(request.document("jobs"))

    def get(self, job_id: str, *, wait_s: float = 0.0) -> _Document:
        """Return how far a job is, once it has ended or after ``wait_s``, at most 30 s."""
        return self._ask(waiting(job_id, wait_s=wait_s))

    def cancel(self, job_id: str) -> _Document:
        """Let a job end as soon as it can."""
        return self._ask(request.document(f"{_path(job_id)}/cancel", method="POST"))


def waiting(job_id: str, *, wait_s: float) -> request.Request[dict[str, Any]]:
    """Build the request for a job, answered when it has ended or after a while."""
    return request.document(_path(job_id), params=[("wait_s", wait_s)], patience_s=wait_s)


def ended(job: Mapping[str, Any]) -> bool:
    """Return whether nothing more will happen to a job.

    Raises
    ------
    ProblemError
        If it failed.
    """
    if job.get("state") == "failed":
        raise request.problem_error(job.get("problem") or {})
    return job.get("state") in ("done", "cancelled")


def _path(job_id: str) -> str:
    return f"jobs/{quote(job_id, safe='')}"
