"""Jobs run one after another, report their progress, and end when they are cancelled."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from transientcam_server.camera import Job, Jobs
from transientcam_server.camera._jobs import MAX_UNFINISHED, REMEMBERED
from transientcam_server.errors import Problem, kinds

Work = Callable[[Job], Awaitable[dict[str, Any]]]
LONG_S = 60.0


async def nothing(job: Job) -> dict[str, Any]:
    return {}


def with_manager(main: Callable[[Jobs, list[tuple[str, str]]], Awaitable[None]]) -> None:
    """Run ``main`` with a manager of jobs and the list of its reports, and close it."""

    async def run() -> None:
        reports: list[tuple[str, str]] = []
        manager = Jobs(report=lambda job: reports.append((job.id, job.state)), clock=lambda: 100.0)
        try:
            await main(manager, reports)
        finally:
            await manager.close()

    asyncio.run(run())


def test_a_job_reports_its_progress_and_its_result() -> None:
    async def main(manager: Jobs, reports: list[tuple[str, str]]) -> None:
        async def work(job: Job) -> dict[str, Any]:
            await asyncio.to_thread(job.report, 0.5, "counting")
            seen.append((job.state, job.progress, job.step))
            return {"count": 7}

        seen: list[tuple[str, float, str]] = []
        job = manager.start("count", work)
        assert job.to_document()["state"] == "queued"
        await manager.end_of(job, wait_s=LONG_S)

        assert seen == [("running", 0.5, "counting")]
        assert job.to_document() == {
            "id": job.id,
            "kind": "count",
            "state": "done",
            "progress": 1.0,
            "step": "done",
            "result": {"count": 7},
            "problem": None,
            "created_at": 100.0,
            "finished_at": 100.0,
        }
        assert reports == [(job.id, "running"), (job.id, "done")]

    with_manager(main)


@pytest.mark.parametrize(
    ("error", "slug"),
    [
        (Problem(kinds.CAMERA_LOST, "It is gone."), "camera-lost"),
        (ZeroDivisionError("secret"), "internal-error"),
    ],
)
def test_what_a_job_raises_is_its_problem(error: Exception, slug: str) -> None:
    async def main(manager: Jobs, reports: list[tuple[str, str]]) -> None:
        async def work(job: Job) -> dict[str, Any]:
            raise error

        job = manager.start("fail", work)
        await manager.end_of(job, wait_s=LONG_S)

        document = job.to_document()
        assert document["state"] == "failed"
        assert document["problem"]["type"] == f"/problems/{slug}"
        assert "secret" not in str(document)

    with_manager(main)


def test_jobs_run_one_at_a_time_in_their_order() -> None:
    async def main(manager: Jobs, reports: list[tuple[str, str]]) -> None:
        jobs = [manager.start("count", nothing) for _ in range(4)]
        await manager.end_of(jobs[-1], wait_s=LONG_S)

        assert reports == [(job.id, state) for job in jobs for state in ("running", "done")]
        assert [job.id for job in manager.all] == [job.id for job in reversed(jobs)]

    with_manager(main)


def test_a_running_job_is_cancelled_where_it_reports_progress() -> None:
    async def main(manager: Jobs, reports: list[tuple[str, str]]) -> None:
        begun = threading.Event()

        def count(job: Job) -> None:
            while True:
                job.report(0.1, "counting")
                begun.set()

        async def work(job: Job) -> dict[str, Any]:
            await asyncio.to_thread(count, job)
            return {}

        job = manager.start("count", work)
        await asyncio.to_thread(begun.wait, LONG_S)
        manager.cancel(job.id)
        await manager.end_of(job, wait_s=LONG_S)

        assert job.state == "cancelled"
        assert job.result is None

    with_manager(main)


def test_one_that_waits_is_cancelled_at_once_and_never_runs() -> None:
    async def main(manager: Jobs, reports: list[tuple[str, str]]) -> None:
        go_on = asyncio.Event()

        async def work(job: Job) -> dict[str, Any]:
            await go_on.wait()
            return {}

        first, second = manager.start("count", work), manager.start("count", work)
        manager.cancel(second.id)
        assert second.state == "cancelled"
        go_on.set()
        await manager.end_of(first, wait_s=LONG_S)

        assert (second.id, "running") not in reports
        assert manager.cancel(first.id).state == "done"

    with_manager(main)


def test_one_too_many_is_refused_until_one_has_ended() -> None:
    async def main(manager: Jobs, reports: list[tuple[str, str]]) -> None:
        jobs = [manager.start("count", nothing) for _ in range(MAX_UNFINISHED)]
        with pytest.raises(Problem) as caught:
            manager.start("count", nothing)
        assert caught.value.kind is kinds.TOO_MANY_JOBS
        await manager.end_of(jobs[-1], wait_s=LONG_S)

        assert manager.start("count", nothing).state == "queued"

    with_manager(main)


def test_old_ones_are_forgotten_and_unknown_ones_are_a_problem() -> None:
    async def main(manager: Jobs, reports: list[tuple[str, str]]) -> None:
        jobs = []
        for _ in range(REMEMBERED + 2):
            jobs.append(manager.start("count", nothing))
            await manager.end_of(jobs[-1], wait_s=LONG_S)
        manager.start("count", nothing)

        assert len(manager.all) == REMEMBERED + 1
        with pytest.raises(Problem) as caught:
            manager.get(jobs[0].id)
        assert caught.value.kind is kinds.UNKNOWN_JOB

    with_manager(main)


def test_a_wait_that_is_too_short_returns_while_the_job_runs() -> None:
    async def main(manager: Jobs, reports: list[tuple[str, str]]) -> None:
        go_on = asyncio.Event()

        async def work(job: Job) -> dict[str, Any]:
            await go_on.wait()
            return {}

        job = manager.start("count", work)
        await manager.end_of(job, wait_s=0.01)
        assert not job.finished
        go_on.set()
        await manager.end_of(job, wait_s=LONG_S)
        assert job.finished

    with_manager(main)
