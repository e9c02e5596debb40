"""Accuracy and time: which sequence for a target or a budget, and what is on offer."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Query, Request, Response, status

from transientcam_driver import Sequence
from transientcam_server.api.auth import Role
from transientcam_server.api.auth.permissions import needs
from transientcam_server.api.dependencies import ServiceOf
from transientcam_server.api.documents.job import JobDocument
from transientcam_server.api.documents.plan import PlanDocument, PlanRequest, TradeoffDocument
from transientcam_server.api.problems import documented
from transientcam_server.api.routes import jobs
from transientcam_server.camera.jobs import Job
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning import Goal, Progress, SceneStatistics, uniform_scene
from transientcam_server.service import Service

router = APIRouter(tags=["accuracy"])
_FRAME_WITHIN_S: Final = 10.0
_ASK_EVERY_S: Final = 0.5
_LOOKED: Final = 0.5
"""Share of the time of a plan after which the scene was looked at."""
_REFUSALS: Final = (
    kinds.BAD_REQUEST,
    kinds.INVALID_REQUEST,
    kinds.INVALID_SEQUENCE,
    kinds.TARGET_UNREACHABLE,
    kinds.NO_FRAME_YET,
    kinds.SHUTTING_DOWN,
    kinds.PLANNING_BUSY,
)


@router.post(
    "/plan",
    summary="A sequence for a target accuracy or a budget of time",
    responses=documented(*_REFUSALS),
)
@needs(Role.VIEWER, lease=False)
async def make_plan(service: ServiceOf, request: PlanRequest, http: Request) -> PlanDocument:
    """Recommend a sequence and an estimator with predicted accuracy, and neighbours.

    With targets it is the quickest one that reaches all of them with margin within the budgets;
    with budgets alone the most accurate one within them. Where no scene is given it is looked at:
    before a simulated camera by another one in virtual time, at all frequencies; before any other
    by the current frame, and the plan cannot consider what that does not resolve. Nothing is
    changed: `sequence` of the answer is the body for a `PUT /sequence`. A client that leaves ends
    the work; `POST /plan/jobs` reports its progress.
    """
    goal = _goal(service, request)
    left = threading.Event()

    def go_on(share: float, step: str) -> None:
        if left.is_set():
            raise _left()

    async def has_left() -> None:
        if await http.is_disconnected():
            raise _left()

    try:
        return await _planned(service, request, goal, _address(http), Progress(go_on), has_left)
    finally:
        left.set()


@router.post(
    "/plan/jobs",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Make a plan as a job, with progress",
    responses=jobs.ACCEPTED | documented(*_REFUSALS, kinds.TOO_MANY_JOBS),
)
@needs(Role.VIEWER, lease=False)
async def start_plan(
    service: ServiceOf, request: PlanRequest, http: Request, response: Response
) -> JobDocument:
    """Begin to make the plan that `POST /plan` answers with, which is the `result` of the job.

    What that would be refused with is the `problem` of the job. It goes on when the client leaves;
    `POST /jobs/{job}/cancel` ends it.
    """
    goal, address = _goal(service, request), _address(http)

    async def work(job: Job) -> dict[str, Any]:
        async def ask() -> None:
            job.report(job.progress, job.step)

        progress = Progress(job.report)
        made = await _planned(service, request, goal, address, progress, ask)
        return made.model_dump(mode="json")

    return jobs.accepted(service.jobs.start(jobs.PLAN, work, in_turn=False), response)


def _goal(service: Service, request: PlanRequest) -> Goal:
    document = {"base_frequency_hz": service.applied.sequence.base_frequency_hz, **request.fixed}
    goal = Goal(
        **request.target.model_dump(),
        **request.budget.model_dump(),
        base=Sequence.from_document(document),
        fixed=frozenset(request.fixed),
        estimator=request.estimator,
    )
    goal.require_sensible()
    return goal


def _address(http: Request) -> str:
    return "" if http.client is None else http.client.host


def _left() -> Problem:
    """Return what ends the work for a client that has gone, and reads no answer."""
    return Problem(kinds.SHUTTING_DOWN, "The client left before the plan was made.")


async def _planned(
    service: Service,
    request: PlanRequest,
    goal: Goal,
    address: str,
    progress: Progress,
    ask: Callable[[], Awaitable[None]],
) -> PlanDocument:
    """Plan once there is a place for the address; what ``ask`` raises in between ends it."""
    task = asyncio.ensure_future(_in_place(service, request, goal, address, progress))
    try:
        while not task.done():
            await asyncio.wait({task}, timeout=_ASK_EVERY_S)
            await ask()
        return PlanDocument.model_validate(task.result())
    finally:
        task.cancel()


async def _in_place(
    service: Service, request: PlanRequest, goal: Goal, address: str, progress: Progress
) -> dict[str, Any]:
    async with service.planning.place_of(address):
        scene = await _scene(service, request, goal.base, progress.part(0.0, _LOOKED))
        made = progress.part(_LOOKED, 1.0)
        return await service.planning.run(service.planner.plan_document, goal, scene, made)


@router.get(
    "/tradeoff",
    summary="What accuracy costs on this scene",
    responses=documented(
        kinds.INVALID_REQUEST,
        kinds.TARGET_UNREACHABLE,
        kinds.NO_FRAME_YET,
        kinds.SHUTTING_DOWN,
        kinds.PLANNING_BUSY,
    ),
)
async def read_tradeoff(
    service: ServiceOf,
    http: Request,
    by: Annotated[
        Literal["range_error_m", "range_std_m", "bound_width"],
        Query(description="the accuracy that capture time is held against"),
    ] = "range_error_m",
) -> TradeoffDocument:
    """Return the Pareto front for the scene, its lines, and where the current frame stands."""
    async with service.planning.place_of(_address(http)):
        frame = await service.hub.newest(after=0, wait_s=_FRAME_WITHIN_S)
        return TradeoffDocument.model_validate(await service.fronts.of(frame, by))


async def _scene(
    service: Service, request: PlanRequest, base: Sequence, progress: Progress
) -> SceneStatistics:
    scene = request.scene
    if scene is not None:
        return uniform_scene(
            scene.brightness_dn_per_s,
            [(each.range_m, each.weight) for each in scene.returns],
            ambient_dn_per_s=scene.ambient_dn_per_s,
        )
    if service.looks.needs_frame:
        frame = await service.hub.newest(after=0, wait_s=_FRAME_WITHIN_S)
        return await service.looks.of_frame(frame, request.ambient_dn_per_s)
    same = Sequence(base_frequency_hz=base.base_frequency_hz, sub_phases=base.sub_phases)
    return await service.looks.of_twin(same, request.ambient_dn_per_s, progress)
