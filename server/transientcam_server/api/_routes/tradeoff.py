"""Accuracy and time: all that no other sequence beats on the scene before the camera."""

from functools import partial
from typing import Annotated, Final

from fastapi import APIRouter, Query, Request, Response, status

from transientcam_server.api import _planned as planned
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import needs
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.job import JobDocument
from transientcam_server.api._documents.plan import AccuracyName, TradeoffDocument, TradeoffRequest
from transientcam_server.api._job_answers import ACCEPTED
from transientcam_server.api._problems import documented
from transientcam_server.errors import kinds
from transientcam_server.planning import Goal, Progress, Region, front_goal
from transientcam_server.service import Service

router = APIRouter(tags=["accuracy"])
KIND: Final = "tradeoff"
"""Of the jobs that compute the front."""


@router.get(
    "/tradeoff",
    summary="What accuracy costs on this scene",
    responses=documented(*planned.REFUSALS),
)
async def read_tradeoff(
    service: ServiceOf,
    http: Request,
    by: Annotated[
        AccuracyName, Query(description="the accuracy that capture time is held against")
    ] = "range_error_m",
    share: Annotated[
        float | None, Query(gt=0, lt=1, description="of the pixels whose error counts")
    ] = None,
    region: Annotated[
        str | None,
        Query(description="`x,y,width,height` or corners `x,y/x,y/x,y`", max_length=1000),
    ] = None,
    estimator: Annotated[
        str | None, Query(description="the only one to predict with", max_length=64)
    ] = None,
) -> TradeoffDocument:
    """Return the Pareto front for the scene, its lines, and where the current frame stands.

    It takes seconds where the scene was not looked at within the last ten. A camera of fixed
    frequencies is refused; `takes` of the problem says what more of them give. A client that leaves
    ends the work; `POST /tradeoff/jobs` reports its progress.
    """
    goal = front_goal(by, share, region=Region.of(region), estimator=estimator)
    return await planned.for_request(http, await _work(service, goal, http))


@router.post(
    "/tradeoff/jobs",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Compute what accuracy costs as a job, with progress",
    responses=ACCEPTED | documented(*planned.REFUSALS, kinds.TOO_MANY_JOBS),
)
@needs(Role.VIEWER, lease=False)
async def start_tradeoff(
    service: ServiceOf, request: TradeoffRequest, http: Request, response: Response
) -> JobDocument:
    """Begin to compute what `GET /tradeoff` answers with, which is the `result` of the job.

    While the job runs the result is the front so far: its ends first, then what is between, without
    lines. What that would be refused with is the `problem` of the job. It goes on when the client
    leaves; `POST /jobs/{job}/cancel` ends it.
    """
    given = {"region": Region.of(request.region), "estimator": request.estimator}
    goal = front_goal(request.by, request.share, **given)
    return planned.as_job(service, KIND, await _work(service, goal, http), response)


async def _work(service: Service, goal: Goal, http: Request) -> planned.Work[TradeoffDocument]:
    await planned.require_plannable(service, planned.address_of(http))
    planned.require_scene(service)
    return partial(_made, service, goal, planned.address_of(http))


async def _made(service: Service, goal: Goal, address: str, progress: Progress) -> TradeoffDocument:
    """Compute the front once there is a place for the address."""
    async with service.planning.place_of(address):
        frame = await service.hub.newest(after=0, wait_s=planned.FRAME_WITHIN_S)
        looked = progress.part(0.0, planned.LOOKED), progress.part(planned.LOOKED, 1.0)
        return TradeoffDocument.model_validate(await service.fronts.of(frame, goal, *looked))
