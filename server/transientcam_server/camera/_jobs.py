"""Long work that a client starts and does not wait for: its progress, and how to cancel it.

Jobs run on the event loop, one task each. Those of the camera run in the order they were started
in, one at a time; plans, which have a queue of their own, beside them. A job reports its progress
from any thread.
"""

import asyncio
import contextlib
import logging
import secrets
import threading
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any, Final, Literal

from transientcam_server.errors import JobCancelled, Problem, kinds, problem_document, problem_of

_log = logging.getLogger("transientcam_server.camera.jobs")
MAX_UNFINISHED: Final = 8
"""Jobs that run or wait; one more is refused."""
REMEMBERED: Final = 64
"""Finished jobs whose result is kept."""
FILES_KEPT: Final = 8
"""And those whose files are, which are larger."""

State = Literal["queued", "running", "done", "failed", "cancelled"]


@dataclass(slots=True, eq=False)
class Job:
    """Long work, and its progress.

    ``in_turn``: whether it waits for those that were started before.
    ``progress``: from 0 to 1.
    ``step``: the present step, in a word or two.
    ``result``: a document, once it is done; before, and where it was cancelled, what there is of
    it.
    ``problem``: why it failed.
    ``files``: what it made beside its result, by format.
    ``cancelled``, ``ended``: set when it is to be cancelled, and when it has ended.
    """

    id: str
    kind: str
    created_at: float
    in_turn: bool = True
    state: State = "queued"
    progress: float = 0.0
    step: str = "waiting"
    result: dict[str, Any] | None = None
    problem: Problem | None = None
    finished_at: float | None = None
    files: dict[str, bytes] = field(default_factory=dict, repr=False)
    cancelled: threading.Event = field(default_factory=threading.Event, repr=False)
    ended: asyncio.Event = field(default_factory=asyncio.Event, repr=False)

    @property
    def finished(self) -> bool:
        """Whether it has ended."""
        return self.finished_at is not None

    def report(self, progress: float, step: str) -> None:
        """Report the progress of the work; from any thread.

        Raises JobCancelled if it was cancelled.
        """
        if self.cancelled.is_set():
            raise JobCancelled(self.id)
        self.progress, self.step = progress, step

    def show(self, so_far: dict[str, Any]) -> None:
        """Keep what there is of the result so far; from any thread."""
        self.result = so_far

    def to_document(self) -> dict[str, Any]:
        """Return the job as JSON."""
        return {
            "id": self.id,
            "kind": self.kind,
            "state": self.state,
            "progress": self.progress,
            "step": self.step,
            "result": self.result,
            "problem": None if self.problem is None else problem_document(self.problem),
            "created_at": self.created_at,
            "finished_at": self.finished_at,
        }


Work = Callable[[Job], Awaitable[dict[str, Any]]]
"""Does a job and returns its result; what it raises is the job's problem."""


class Jobs:
    """Starts, remembers and cancels jobs.

    ``report``: called when a job begins and when it ends.
    ``clock``: Unix time.
    """

    def __init__(
        self, *, report: Callable[[Job], None], clock: Callable[[], float] = time.time
    ) -> None:
        self._report = report
        self._clock = clock
        self._jobs: dict[str, Job] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._one_at_a_time = asyncio.Lock()

    @property
    def all(self) -> list[Job]:
        """Every job that is remembered, the newest first."""
        return list(reversed(self._jobs.values()))

    def get(self, job_id: str) -> Job:
        """Return a job.

        Raises Problem ``unknown-job``.
        """
        try:
            return self._jobs[job_id]
        except KeyError:
            shown = job_id[:64]
            raise Problem(
                kinds.UNKNOWN_JOB, f"There is no job {shown!r}.", field="job", value=shown
            ) from None

    def start(self, kind: str, work: Work, *, in_turn: bool = True) -> Job:
        """Start a job; one ``in_turn`` runs after those of these that were started before.

        Raises Problem ``too-many-jobs``.
        """
        unfinished = [each for each in self._jobs.values() if each.in_turn == in_turn]
        unfinished = [each for each in unfinished if not each.finished]
        if len(unfinished) >= MAX_UNFINISHED:
            raise Problem(
                kinds.TOO_MANY_JOBS,
                f"{len(unfinished)} jobs run or wait already.",
                limit=MAX_UNFINISHED,
            )
        job = Job(secrets.token_hex(6), kind, self._clock(), in_turn)
        self._jobs[job.id] = job
        self._forget_old()
        task = asyncio.get_running_loop().create_task(self._run(job, work))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return job

    def cancel(self, job_id: str) -> Job:
        """Cancel a job; one that has ended stays as it is.

        Raises Problem ``unknown-job``.
        """
        job = self.get(job_id)
        job.cancelled.set()
        if job.state == "queued":
            self._end(job, "cancelled")
        return job

    async def end_of(self, job: Job, *, wait_s: float) -> None:
        """Wait until a job has ended, or for so long."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(wait_s):
                await job.ended.wait()

    def cancel_all(self) -> None:
        """Cancel every job that has not ended."""
        for job in self._jobs.values():
            if not job.finished:
                self.cancel(job.id)

    async def close(self) -> None:
        """Cancel every job, and wait for those that run."""
        self.cancel_all()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _run(self, job: Job, work: Work) -> None:
        async with self._one_at_a_time if job.in_turn else contextlib.nullcontext():
            if job.finished:  # cancelled while it waited
                return
            job.state = "running"
            self._report(job)
            try:
                job.result = await work(job)
            except JobCancelled:
                self._end(job, "cancelled")
            except Exception as error:
                job.problem = problem_of(error)
                if job.problem.kind is kinds.INTERNAL_ERROR:
                    _log.exception("the job %s (%s) failed", job.id, job.kind)
                self._end(job, "failed")
            else:
                job.progress = 1.0
                self._end(job, "done")

    def _end(self, job: Job, state: State) -> None:
        job.state, job.finished_at = state, self._clock()
        job.step = state
        job.ended.set()
        _log.info("the job %s (%s) is %s", job.id, job.kind, state)
        self._report(job)

    def _forget_old(self) -> None:
        old = [each.id for each in self._jobs.values() if each.finished]
        for job_id in old[: max(0, len(old) - REMEMBERED)]:
            del self._jobs[job_id]
        for job_id in old[max(0, len(old) - REMEMBERED) : -FILES_KEPT]:
            self._jobs[job_id].files.clear()
