"""What is planned: a request waits for it until its client leaves, or a job does it."""

import asyncio
import threading
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import asdict
from typing import Any, Final, TypeVar

from fastapi import Request, Response

import transientcam_moments as tm
from transientcam_server.api._documents.document import Document
from transientcam_server.api._documents.job import JobDocument
from transientcam_server.api._job_answers import accepted
from transientcam_server.camera import Job, outdated
from transientcam_server.errors import JobCancelled, Problem, kinds
from transientcam_server.imaging import unusable
from transientcam_server.planning import Progress, families, takes_of
from transientcam_server.service import Service

FRAME_WITHIN_S: Final = 10.0
"""How long what is planned for the current frame waits for one."""
LOOKED: Final = 0.5
"""Share of the progress after which the scene was looked at."""
REFUSALS: Final = (
    kinds.TARGET_UNREACHABLE,
    kinds.ESTIMATOR_MISFIT,
    kinds.ONLY_MOMENTS,
    kinds.NO_FRAME_YET,
    kinds.SHUTTING_DOWN,
    kinds.PLANNING_BUSY,
    kinds.PLANNING_ENDED,
    kinds.PLAN_TOO_LONG,
)
"""What any of it may be answered with."""
_ASK_EVERY_S: Final = 0.5
_Answer = TypeVar("_Answer", bound=Document)
Work = Callable[[Progress], Coroutine[Any, Any, _Answer]]
"""Plans; what its progress raises ends it."""


async def for_request(http: Request, work: Work[_Answer]) -> _Answer:
    """Return what the work answers with; a client that leaves, or light that goes off, ends it."""
    left = threading.Event()

    def go_on(share: float, step: str) -> None:
        if left.is_set():
            raise _left()

    async def ask() -> None:
        if await http.is_disconnected():
            raise _left()

    try:
        return await _ended(work(Progress(go_on)), ask)
    except JobCancelled as ended:
        raise outdated() from ended
    finally:
        left.set()


def as_job(
    service: Service,
    kind: str,
    work: Work[_Answer],
    response: Response,
    files: dict[str, bytes] | None = None,
) -> JobDocument:
    """Start a job that does the work beside those of the camera; its result is the answer.

    While it runs, its result is what the work shows of it. The work may fill in ``files``.
    Raises Problem ``too-many-jobs``.
    """

    async def run(job: Job) -> dict[str, Any]:
        async def ask() -> None:
            job.report(job.progress, job.step)

        made = await _ended(work(Progress(job.report, show=job.show)), ask)
        job.files = files or {}
        return made.model_dump(mode="json")

    return accepted(service.jobs.start(kind, run, in_turn=False), response)


async def require_plannable(service: Service, address: str) -> None:
    """Refuse a camera whose captures are not predicted.

    Raises Problem ``target-unreachable``, with ``takes``: what more of them give, by the newest
    frame.
    """
    try:
        families.require_plannable(service.camera.capabilities)
    except Problem as problem:
        problem.extensions["takes"] = await _takes(service, address)
        raise


def require_scene(service: Service) -> None:
    """Refuse to look at the scene of a service that has no images to do it by.

    Raises Problem ``only-moments``.
    """
    if service.looks.needs_frame:
        service.require_images("The scene is seen")


async def _takes(service: Service, address: str) -> list[dict[str, Any]]:
    """Return what takes give; nothing where no frame or no noise is known."""
    frame = service.hub.latest
    if frame is None or frame.recipe.sensor is None or not service.has_images:
        return []
    async with service.planning.place_of(address):
        predicted, _ = await service.workers.run_long(
            takes_of, frame.raw, frame.recipe, service.camera.capabilities
        )
    return [asdict(each) for each in predicted]


def address_of(http: Request) -> str:
    """Return the address whose requests are counted together."""
    return "" if http.client is None else http.client.host


async def _ended(work: Coroutine[Any, Any, _Answer], ask: Callable[[], Awaitable[None]]) -> _Answer:
    """Return what the work answers with; what ``ask``, called meanwhile, raises cancels it."""
    task = asyncio.ensure_future(work)
    try:
        while not task.done():
            await asyncio.wait({task}, timeout=_ASK_EVERY_S)
            await ask()
        return task.result()
    except tm.PluginFailed as failed:
        raise unusable(failed) from failed
    finally:
        task.cancel()


def _left() -> Problem:
    """Return what ends the work for a client that has gone, and reads no answer."""
    return Problem(kinds.SHUTTING_DOWN, "The client left before there was an answer.")
