"""Accuracy and time: which sequence for a target or a budget, and what is on offer."""

import asyncio
import threading
from collections.abc import Callable
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Query, Request

from transientcam_driver import Sequence
from transientcam_server.api.auth import Role
from transientcam_server.api.auth.permissions import needs
from transientcam_server.api.dependencies import ServiceOf
from transientcam_server.api.documents.plan import PlanDocument, PlanRequest, TradeoffDocument
from transientcam_server.api.problems import documented
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning import Goal, SceneStatistics, uniform_scene
from transientcam_server.service import Service

router = APIRouter(tags=["accuracy"])
_FRAME_WITHIN_S: Final = 10.0
_ASK_EVERY_S: Final = 0.5


@router.post(
    "/plan",
    summary="A sequence for a target accuracy or a budget of time",
    responses=documented(
        kinds.BAD_REQUEST,
        kinds.INVALID_REQUEST,
        kinds.INVALID_SEQUENCE,
        kinds.TARGET_UNREACHABLE,
        kinds.NO_FRAME_YET,
        kinds.SHUTTING_DOWN,
        kinds.PLANNING_BUSY,
    ),
)
@needs(Role.VIEWER, lease=False)
async def make_plan(service: ServiceOf, request: PlanRequest, http: Request) -> PlanDocument:
    """Recommend a sequence and an estimator with predicted accuracy, and neighbours.

    With targets it is the quickest one that reaches all of them with margin within the budgets;
    with budgets alone the most accurate one within them. Where no scene is given it is looked at:
    before a simulated camera by another one in virtual time, at all frequencies; before any other
    by the current frame, and the plan cannot consider what that does not resolve. Nothing is
    changed: `sequence` of the answer is the body for a `PUT /sequence`. A client that leaves ends
    the work.
    """
    document = {"base_frequency_hz": service.applied.sequence.base_frequency_hz, **request.fixed}
    goal = Goal(
        **request.target.model_dump(),
        **request.budget.model_dump(),
        base=Sequence.from_document(document),
        fixed=frozenset(request.fixed),
        estimator=request.estimator,
    )
    goal.require_sensible()
    left = threading.Event()

    def go_on() -> None:
        if left.is_set():
            raise _left()

    async with service.planning.place_of(_address(http)):
        task = asyncio.ensure_future(_planned(service, request, goal, go_on))
        try:
            while not task.done():
                await asyncio.wait({task}, timeout=_ASK_EVERY_S)
                if await http.is_disconnected():
                    raise _left()
            return PlanDocument.model_validate(task.result())
        finally:
            left.set()
            task.cancel()


def _address(http: Request) -> str:
    return "" if http.client is None else http.client.host


def _left() -> Problem:
    """Return what ends the work for a client that has gone, and reads no answer."""
    return Problem(kinds.SHUTTING_DOWN, "The client left before the plan was made.")


async def _planned(
    service: Service, request: PlanRequest, goal: Goal, go_on: Callable[[], None]
) -> dict[str, Any]:
    scene = await _scene(service, request, goal.base, go_on)
    return await service.planning.run(service.planner.plan_document, goal, scene, go_on)


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
    service: Service, request: PlanRequest, base: Sequence, go_on: Callable[[], None]
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
    return await service.looks.of_twin(same, request.ambient_dn_per_s, go_on)
