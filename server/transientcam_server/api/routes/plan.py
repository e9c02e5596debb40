"""Accuracy and time: which sequence for a target or a budget, and what is on offer."""

import asyncio
import threading
from collections.abc import Awaitable, Callable, Coroutine
from typing import Annotated, Any, Final, Literal, TypeVar

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
_FRONT_REFUSALS: Final = (
    kinds.INVALID_REQUEST,
    kinds.TARGET_UNREACHABLE,
    kinds.NO_FRAME_YET,
    kinds.SHUTTING_DOWN,
    kinds.PLANNING_BUSY,
)
_By = Annotated[
    Literal["range_error_m", "range_std_m", "bound_width"],
    Query(description="the accuracy that capture time is held against"),
]
_T = TypeVar("_T")


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
        made = await _unless_ended(
            _planned(service, request, goal, _address(http), Progress(go_on)), has_left
        )
        return PlanDocument.model_validate(made)
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
        made = await _unless_ended(
            _planned(service, request, goal, address, Progress(job.report)), _asking(job)
        )
        return PlanDocument.model_validate(made).model_dump(mode="json")

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


def _asking(job: Job) -> Callable[[], Awaitable[None]]:
    """Return what raises once the job is cancelled, also while nothing reports its progress."""

    async def ask() -> None:
        job.report(job.progress, job.step)

    return ask


async def _unless_ended(work: Coroutine[Any, Any, _T], ask: Callable[[], Awaitable[None]]) -> _T:
    """Return the result of ``work``; what ``ask`` raises in between ends it."""
    task = asyncio.ensure_future(work)
    try:
        while not task.done():
            await asyncio.wait({task}, timeout=_ASK_EVERY_S)
            await ask()
        return task.result()
    finally:
        task.cancel()


async def _planned(
    service: Service, request: PlanRequest, goal: Goal, address: str, progress: Progress
) -> dict[str, Any]:
    """Plan once there is a place for the address."""
    async with service.planning.place_of(address):
        scene = await _scene(service, request, goal.base, progress.part(0.0, _LOOKED))
        made = progress.part(_LOOKED, 1.0)
        return await service.planning.run(service.planner.plan_document, goal, scene, made)


@router.get(
    "/tradeoff",
    summary="What accuracy costs on this scene",
    responses=documented(*_FRONT_REFUSALS),
)
async def read_tradeoff(
    service: ServiceOf,
    http: Request,
    by: _By = "range_error_m",
) -> TradeoffDocument:
    """Return the Pareto front for the scene, its lines, and where the current frame stands.

    `POST /tradeoff/jobs` reports its progress.
    """
    return TradeoffDocument.model_validate(await _front(service, _address(http), by))


@router.post(
    "/tradeoff/jobs",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Predict what accuracy costs as a job, with progress",
    responses=jobs.ACCEPTED | documented(*_FRONT_REFUSALS, kinds.TOO_MANY_JOBS),
)
@needs(Role.VIEWER, lease=False)
async def start_tradeoff(
    service: ServiceOf, http: Request, response: Response, by: _By = "range_error_m"
) -> JobDocument:
    """Begin to predict the front that `GET /tradeoff` answers with, which is the `result`.

    While the job runs the result is the front so far: its ends first, then what is between, without
    lines. It goes on when the client leaves; `POST /jobs/{job}/cancel` ends it.
    """
    address = _address(http)

    async def work(job: Job) -> dict[str, Any]:
        def so_far(document: dict[str, Any]) -> None:
            job.result = _front_json(document)

        made = await _unless_ended(
            _front(service, address, by, Progress(job.report), so_far), _asking(job)
        )
        return _front_json(made)

    return jobs.accepted(service.jobs.start(jobs.TRADEOFF, work, in_turn=False), response)


def _front_json(document: dict[str, Any]) -> dict[str, Any]:
    return TradeoffDocument.model_validate(document).model_dump(mode="json")


async def _front(
    service: Service,
    address: str,
    by: str,
    progress: Progress | None = None,
    so_far: Callable[[dict[str, Any]], None] = lambda document: None,
) -> dict[str, Any]:
    """Predict the front once there is a place for the address."""
    async with service.planning.place_of(address):
        frame = await service.hub.newest(after=0, wait_s=_FRAME_WITHIN_S)
        return await service.fronts.of(frame, by, progress, so_far)


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
