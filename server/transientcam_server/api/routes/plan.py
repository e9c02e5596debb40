"""Accuracy and time: which sequence for a target or a budget, and what is on offer."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query

from transientcam_driver import Sequence
from transientcam_server.api.auth import Role
from transientcam_server.api.auth.permissions import needs
from transientcam_server.api.dependencies import ServiceOf
from transientcam_server.api.documents.plan import PlanDocument, PlanRequest, TradeoffDocument
from transientcam_server.api.problems import documented
from transientcam_server.errors import kinds
from transientcam_server.planning import Goal, SceneStatistics, uniform_scene
from transientcam_server.service import Service

router = APIRouter(tags=["accuracy"])
_FRAME_WITHIN_S = 10.0


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
    ),
)
@needs(Role.VIEWER, lease=False)
async def make_plan(service: ServiceOf, request: PlanRequest) -> PlanDocument:
    """Recommend a sequence with its predicted accuracy and its neighbours on the Pareto front.

    With targets it is the quickest one that reaches all of them within the budgets; with budgets
    alone the most accurate one within them. The scene is that of the current frame where none is
    given; the plan cannot consider what that frame does not resolve. Nothing is changed: `sequence`
    of the answer is the body for a `PUT /sequence`.
    """
    document = {"base_frequency_hz": service.applied.sequence.base_frequency_hz, **request.fixed}
    goal = Goal(
        **request.target.model_dump(),
        **request.budget.model_dump(),
        base=Sequence.from_document(document),
        fixed=frozenset(request.fixed),
    )
    scene = await _scene(service, request)
    made, _ = await service.workers.run_long(service.planner.plan_document, goal, scene)
    return PlanDocument.model_validate(made)


@router.get(
    "/tradeoff",
    summary="What accuracy costs on this scene",
    responses=documented(
        kinds.INVALID_REQUEST, kinds.TARGET_UNREACHABLE, kinds.NO_FRAME_YET, kinds.SHUTTING_DOWN
    ),
)
async def read_tradeoff(
    service: ServiceOf,
    by: Annotated[
        Literal["range_std_m", "bound_width"],
        Query(description="the accuracy that capture time is held against"),
    ] = "range_std_m",
) -> TradeoffDocument:
    """Return the Pareto front for the scene of the current frame, and where that frame stands."""
    frame = await service.hub.newest(after=0, wait_s=_FRAME_WITHIN_S)
    return TradeoffDocument.model_validate(await service.fronts.of(frame, by))


async def _scene(service: Service, request: PlanRequest) -> SceneStatistics:
    scene = request.scene
    if scene is not None:
        return uniform_scene(
            scene.brightness_dn_per_s,
            [(each.range_m, each.weight) for each in scene.returns],
            ambient_dn_per_s=scene.ambient_dn_per_s,
        )
    frame = await service.hub.newest(after=0, wait_s=_FRAME_WITHIN_S)
    found = await frame.reconstruction("returns")
    statistic, _ = await service.workers.run(
        service.planner.scene_statistics, frame.recipe, found, request.ambient_dn_per_s
    )
    return statistic
