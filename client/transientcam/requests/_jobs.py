"""The long-running jobs of a daemon; one class for `Camera` and `AsyncCamera`."""

from collections.abc import Callable, Mapping
from typing import Any, Final, Generic, TypeVar
from urllib.parse import quote

from transientcam.requests._request import Request, document, problem_error

_Document = TypeVar("_Document")
WAIT_S: Final = 10.0
"""How long one request waits for the end of a job."""
PROGRESS_EVERY_S: Final = 0.5
"""The same where the caller follows the progress."""
OnProgress = Callable[[Mapping[str, Any]], None]


class Jobs(Generic[_Document]):
    """The jobs of a daemon; made by ``camera.jobs``.

    Methods return documents, as ``GET /api/v1/jobs/{id}`` has them: ``id``, ``kind``, ``state``,
    ``progress``, ``step``, ``result``, ``problem``; those of an `AsyncCamera` return awaitables.
    """

    def __init__(self, ask: Callable[[Request[dict[str, Any]]], _Document]) -> None:
        self._ask = ask

    def all(self) -> _Document:
        """Return those that run, those that wait and the last ones that have ended, in ``jobs``."""
        return self._ask(document("jobs"))

    def get(self, job_id: str, *, wait_s: float = 0.0) -> _Document:
        """Return a job once it has ended, or after ``wait_s``, at most 30 s."""
        params = [("wait_s", wait_s)]
        return self._ask(document(_path(job_id), params=params, extra_timeout_s=wait_s))

    def cancel(self, job_id: str) -> _Document:
        """Cancel a job; it ends as soon as it can."""
        return self._ask(document(f"{_path(job_id)}/cancel", method="POST"))


def ended(job: Mapping[str, Any]) -> bool:
    """Return whether a job is done or cancelled.

    Raises ProblemError if it failed.
    """
    if job.get("state") == "failed":
        raise problem_error(job.get("problem") or {})
    return job.get("state") in ("done", "cancelled")


def _path(job_id: str) -> str:
    return f"jobs/{quote(job_id, safe='')}"
