"""Jobs: long work that other requests started, and its progress."""

from typing import Annotated, Final, Literal

from fastapi import APIRouter, Path, Query, Request, Response

from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import TO_CHANGE, needs, require
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.job import JobDocument, JobsDocument
from transientcam_server.api._job_answers import job_document
from transientcam_server.api._problems import documented
from transientcam_server.errors import Problem, kinds

router = APIRouter(tags=["jobs"])
MAX_WAIT_S: Final = 30.0
_MAP_TYPES: Final = {"npy": "application/octet-stream", "png": "image/png"}
_Job = Annotated[
    str, Path(description="its id, as the list has it", max_length=200, examples=["5a0c1f6be2d4"])
]


@router.get("/jobs", summary="All jobs")
async def read_jobs(service: ServiceOf) -> JobsDocument:
    """List what runs, what waits and the last ones that have ended, the newest first."""
    return JobsDocument(jobs=[job_document(job) for job in service.jobs.all])


@router.get("/jobs/{job}", summary="A job", responses=documented(kinds.UNKNOWN_JOB))
async def read_job(
    service: ServiceOf,
    job: _Job,
    wait_s: Annotated[
        float, Query(ge=0.0, le=MAX_WAIT_S, description="how long to wait for its end")
    ] = 0.0,
) -> JobDocument:
    """Return how far a job is; with `wait_s` not before it has ended, or that long has passed."""
    found = service.jobs.get(job)
    await service.jobs.end_of(found, wait_s=wait_s)
    return job_document(found)


@router.get(
    "/jobs/{job}/map.{form}",
    summary="The predicted error of each pixel",
    response_class=Response,
    responses=documented(kinds.UNKNOWN_JOB, kinds.NOT_FOUND)
    | {200: {"description": "the map", "content": {each: {} for each in _MAP_TYPES.values()}}},
)
async def read_map(
    service: ServiceOf,
    job: _Job,
    form: Annotated[
        Literal["npy", "png"],
        Path(description="values in m, or colours for eyes", examples=["npy"]),
    ],
) -> Response:
    """Return noise and bias together of each pixel (H, W), as the planned sequence would have them.

    A plan's job with `map` makes it; the last few are kept. It is NaN, or grey, where no light is.
    Colours go from dark at 0 over their middle at the target to the brightest at twice that.
    """
    found = service.jobs.get(job)
    if form not in found.files:
        detail = f"The job {found.id} has no map: it made none, it has not ended, or it is too old."
        raise Problem(kinds.NOT_FOUND, detail, field="job", value=found.id)
    return Response(found.files[form], media_type=_MAP_TYPES[form])


@router.post(
    "/jobs/{job}/cancel",
    summary="Cancel a job",
    responses=documented(kinds.UNKNOWN_JOB, kinds.ROLE_TOO_LOW, kinds.LEASE_HELD),
)
@needs(Role.VIEWER, lease=False)
async def cancel_job(service: ServiceOf, job: _Job, request: Request) -> JobDocument:
    """Cancel a job, which ends as soon as it can; it stays listed, and an ended one as it is.

    What is planned changes nothing, and may be cancelled by every client that may request it;
    another job by those that may change the camera.
    """
    if service.jobs.get(job).in_turn:
        require(request, service, TO_CHANGE)
    return job_document(service.jobs.cancel(job))
