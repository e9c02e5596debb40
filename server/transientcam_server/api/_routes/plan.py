"""Accuracy and time: which sequence for a target or a budget."""

from functools import partial
from typing import Any, Final

from fastapi import APIRouter, Request, Response, status

from transientcam_driver import Sequence
from transientcam_server.api import _planned as planned
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import TO_LIGHT, needs, require
from transientcam_server.api._dependencies import OffsOf, ServiceOf
from transientcam_server.api._documents.job import JobDocument
from transientcam_server.api._documents.plan import PlanDocument, PlanRequest
from transientcam_server.api._job_answers import ACCEPTED
from transientcam_server.api._problems import documented
from transientcam_server.errors import kinds
from transientcam_server.imaging import Frame
from transientcam_server.planning import (
    Goal,
    Progress,
    Region,
    SceneStatistics,
    map_files,
    uniform_scene,
)
from transientcam_server.service import Service

router = APIRouter(tags=["accuracy"])
KIND: Final = "plan"
"""Of the jobs that make a plan."""
_OF_LOOK: Final = (kinds.ROLE_TOO_LOW, kinds.MAY_NOT_LIGHT, kinds.LEASE_HELD, kinds.LEASE_LOST)
_REFUSALS: Final = (
    *(*planned.REFUSALS, kinds.INVALID_SEQUENCE, *_OF_LOOK),
    *(kinds.CAMERA_BUSY, kinds.RECORDING_RUNS, kinds.START_OUTDATED),
)


@router.post(
    "/plan",
    summary="A sequence for a target accuracy or a budget of time",
    responses=documented(*_REFUSALS),
)
@needs(Role.VIEWER, lease=False)
async def make_plan(
    service: ServiceOf, request: PlanRequest, http: Request, offs: OffsOf
) -> PlanDocument:
    """Recommend a sequence and an estimator with predicted accuracy, and neighbours.

    With targets it is the quickest one that reaches all of them with margin within the budgets;
    with budgets alone the most accurate one within them. Where no scene is given it is looked at:
    before a simulated camera by another one in virtual time, at all frequencies; before any other
    by the current frame, and the plan cannot consider what that does not resolve, or with `look` by
    the camera itself at all frequencies, under the lease: no frames for some seconds. A camera of
    fixed frequencies is refused; `takes` of the problem says what more of them give. Nothing is
    changed: `sequence` of the answer is the body for a `PUT /sequence`. A client that leaves ends
    the work; `POST /plan/jobs` reports its progress.
    """
    return await planned.for_request(http, await _work(service, request, http, offs))


@router.post(
    "/plan/jobs",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Make a plan as a job, with progress",
    responses=ACCEPTED | documented(*_REFUSALS, kinds.TOO_MANY_JOBS),
)
@needs(Role.VIEWER, lease=False)
async def start_plan(
    service: ServiceOf, request: PlanRequest, http: Request, response: Response, offs: OffsOf
) -> JobDocument:
    """Begin to make the plan that `POST /plan` answers with, which is the `result` of the job.

    What that would be refused with is the `problem` of the job. It goes on when the client leaves;
    `POST /jobs/{job}/cancel` ends it. With `map` the error of each pixel is predicted, too:
    `GET /jobs/{job}/map`.
    """
    files: dict[str, bytes] = {}
    work = await _work(service, request, http, offs, files)
    return planned.as_job(service, KIND, work, response, files)


async def _work(
    service: Service,
    request: PlanRequest,
    http: Request,
    offs: int,
    files: dict[str, bytes] | None = None,
) -> planned.Work[PlanDocument]:
    """Return what makes the plan; a goal that cannot be meant or planned is refused at once.

    Once there is a place for the address it plans, and puts the map into the files of a job.
    """
    address, looks = planned.address_of(http), service.looks
    await planned.require_plannable(service, address)
    by_camera = request.look and looks.needs_frame and service.relay is None
    if request.scene is None:
        planned.require_scene(service)
        if by_camera:
            require(http, service, TO_LIGHT)
            service.require_no_recording("A look")
            service.acquisition.require_free()
    goal, planning = _goal(service, request), service.planning
    into = files if request.map else None
    searched = 1.0 if into is None else 0.8

    async def seen(progress: Progress) -> SceneStatistics:
        if (scene := request.scene) is not None:
            returns = [(each.range_m, each.weight) for each in scene.returns]
            light, ambient = scene.brightness_dn_per_s, scene.ambient_dn_per_s
            return uniform_scene(light, returns, ambient_dn_per_s=ambient)
        if by_camera:
            occupy = partial(service.acquisition.occupy, "look", offs=offs)
            recipe = service.pipeline.recipe_of(service.applied)
            return await looks.of_camera(occupy, recipe, request.ambient_dn_per_s, progress)
        if looks.needs_frame:
            frame = await service.hub.newest(after=0, wait_s=planned.FRAME_WITHIN_S)
            return await looks.of_frame(frame, request.ambient_dn_per_s)
        base = goal.base
        same = Sequence(base_frequency_hz=base.base_frequency_hz, sub_phases=base.sub_phases)
        return await looks.of_twin(same, request.ambient_dn_per_s, progress)

    async def made(progress: Progress) -> PlanDocument:
        async with planning.place_of(address):
            scene = await seen(progress.part(0.0, planned.LOOKED))
            plan = await planning.run(
                service.planner.plan_document,
                goal,
                scene,
                progress=progress.part(planned.LOOKED, searched),
            )
            if into is not None:
                error_m = await planning.run(
                    service.planner.map_m,
                    scene,
                    plan["estimator"],
                    Sequence.from_document(plan["sequence"]),
                    progress=progress.part(searched, 1.0),
                )
                into.update(map_files(error_m, goal.range_error_m))
            _add_transport(plan["price"], service.hub.latest)
            return PlanDocument.model_validate(plan)

    return made


def _goal(service: Service, request: PlanRequest) -> Goal:
    document = {"base_frequency_hz": service.applied.sequence.base_frequency_hz, **request.fixed}
    region, capabilities = Region.of(request.region), service.camera.capabilities
    if region is not None:
        region.mask(capabilities.height, capabilities.width)
    goal = Goal(
        **request.target.model_dump(),
        share=request.share,
        region=region,
        **request.budget.model_dump(),
        base=capabilities.sequence_of(document),
        fixed=frozenset(request.fixed),
        estimator=request.estimator,
    )
    goal.require_sensible()
    return goal


def _add_transport(price: dict[str, Any], frame: Frame | None) -> None:
    """State what transport takes, by the newest frame."""
    begun_s = None if frame is None else frame.meta()["captured_unix_s"]
    if frame is not None and begun_s is not None:
        taken_s = frame.raw.host_time_s - begun_s - frame.raw.capture_s
        price["transport_s"] = max(0.0, taken_s)
        price["sum_s"] += price["transport_s"]
