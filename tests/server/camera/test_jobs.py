"""Jobs run one after another, say how far they are, and end when they are told to."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from transientcam_server.camera.jobs import MAX_UNFINISHED, REMEMBERED, Job, Jobs
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem

Work = Callable[[Job], Awaitable[dict[str, Any]]]
LONG_S = 10.0


async def nothing(job: Job) -> dict[str, Any]:
    return {}


def with_desk(main: Callable[[Jobs, list[tuple[str, str]]], Awaitable[None]]) -> None:
    """Run ``main`` with a desk and the list of what it reports, and close it."""

    async def run() -> None:
        told: list[tuple[str, str]] = []
        desk = Jobs(report=lambda job: told.append((job.id, job.state)), clock=lambda: 100.0)
        try:
            await main(desk, told)
        finally:
            await desk.close()

    asyncio.run(run())


def test_a_job_says_how_far_it_is_and_what_came_of_it() -> None:
    async def main(desk: Jobs, told: list[tuple[str, str]]) -> None:
        async def work(job: Job) -> dict[str, Any]:
            await asyncio.to_thread(job.report, 0.5, "counting")
            seen.append((job.state, job.progress, job.step))
            return {"count": 7}

        seen: list[tuple[str, float, str]] = []
        job = desk.start("count", work)
        assert job.to_document()["state"] == "queued"
        await desk.end_of(job, wait_s=LONG_S)

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
        assert told == [(job.id, "running"), (job.id, "done")]

    with_desk(main)


@pytest.mark.parametrize(
    ("error", "slug"),
    [
        (Problem(kinds.CAMERA_LOST, "It is gone."), "camera-lost"),
        (ZeroDivisionError("secret"), "internal-error"),
    ],
)
def test_what_a_job_raises_is_its_problem(error: Exception, slug: str) -> None:
    async def main(desk: Jobs, told: list[tuple[str, str]]) -> None:
        async def work(job: Job) -> dict[str, Any]:
            raise error

        job = desk.start("fail", work)
        await desk.end_of(job, wait_s=LONG_S)

        document = job.to_document()
        assert document["state"] == "failed"
        assert document["problem"]["type"] == f"/problems/{slug}"
        assert "secret" not in str(document)

    with_desk(main)


def test_jobs_run_one_at_a_time_in_their_order() -> None:
    async def main(desk: Jobs, told: list[tuple[str, str]]) -> None:
        jobs = [desk.start("count", nothing) for _ in range(4)]
        await desk.end_of(jobs[-1], wait_s=LONG_S)

        assert told == [(job.id, state) for job in jobs for state in ("running", "done")]
        assert [job.id for job in desk.all] == [job.id for job in reversed(jobs)]

    with_desk(main)


def test_one_that_runs_hears_that_it_should_end_where_it_reports() -> None:
    async def main(desk: Jobs, told: list[tuple[str, str]]) -> None:
        begun = threading.Event()

        def count(job: Job) -> None:
            while True:
                job.report(0.1, "counting")
                begun.set()

        async def work(job: Job) -> dict[str, Any]:
            await asyncio.to_thread(count, job)
            return {}

        job = desk.start("count", work)
        await asyncio.to_thread(begun.wait, LONG_S)
        desk.cancel(job.id)
        await desk.end_of(job, wait_s=LONG_S)

        assert job.state == "cancelled"
        assert job.result is None

    with_desk(main)


def test_one_that_waits_is_cancelled_at_once_and_never_runs() -> None:
    async def main(desk: Jobs, told: list[tuple[str, str]]) -> None:
        go_on = asyncio.Event()

        async def work(job: Job) -> dict[str, Any]:
            await go_on.wait()
            return {}

        first, second = desk.start("count", work), desk.start("count", work)
        desk.cancel(second.id)
        assert second.state == "cancelled"
        go_on.set()
        await desk.end_of(first, wait_s=LONG_S)

        assert (second.id, "running") not in told
        assert desk.cancel(first.id).state == "done"

    with_desk(main)


def test_one_too_many_is_refused_until_one_has_ended() -> None:
    async def main(desk: Jobs, told: list[tuple[str, str]]) -> None:
        jobs = [desk.start("count", nothing) for _ in range(MAX_UNFINISHED)]
        with pytest.raises(Problem) as caught:
            desk.start("count", nothing)
        assert caught.value.kind is kinds.TOO_MANY_JOBS
        await desk.end_of(jobs[-1], wait_s=LONG_S)

        assert desk.start("count", nothing).state == "queued"

    with_desk(main)


def test_old_ones_are_forgotten_and_unknown_ones_are_a_problem() -> None:
    async def main(desk: Jobs, told: list[tuple[str, str]]) -> None:
        jobs = []
        for _ in range(REMEMBERED + 2):
            jobs.append(desk.start("count", nothing))
            await desk.end_of(jobs[-1], wait_s=LONG_S)
        desk.start("count", nothing)

        assert len(desk.all) == REMEMBERED + 1
        with pytest.raises(Problem) as caught:
            desk.get(jobs[0].id)
        assert caught.value.kind is kinds.UNKNOWN_JOB

    with_desk(main)


def test_who_waits_too_short_is_told_that_it_goes_on() -> None:
    async def main(desk: Jobs, told: list[tuple[str, str]]) -> None:
        go_on = asyncio.Event()

        async def work(job: Job) -> dict[str, Any]:
            await go_on.wait()
            return {}

        job = desk.start("count", work)
        await desk.end_of(job, wait_s=0.01)
        assert not job.finished
        go_on.set()
        await desk.end_of(job, wait_s=LONG_S)
        assert job.finished

    with_desk(main)
