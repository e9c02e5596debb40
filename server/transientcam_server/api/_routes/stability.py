"""What averaging over time is worth, with the running camera or of a recording."""

from collections.abc import AsyncIterator
from functools import partial
from typing import Any

from fastapi import APIRouter, Response, status
from numpy.typing import NDArray

from transientcam_server.api import _planned as planned
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import needs
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.job import JobDocument
from transientcam_server.api._documents.stability import StabilityDocument, StabilityRequest
from transientcam_server.api._job_answers import ACCEPTED
from transientcam_server.api._problems import documented
from transientcam_server.errors import kinds
from transientcam_server.imaging import PIXELS, Frame, Pipeline, stability
from transientcam_server.planning import Progress, Region
from transientcam_server.service import Service

router = APIRouter(tags=["accuracy"])


@router.post(
    "/stability/jobs",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Find the best averaging time, as a job",
    responses=ACCEPTED | documented(kinds.BAD_REQUEST, kinds.INVALID_REQUEST, kinds.TOO_MANY_JOBS),
)
@needs(Role.VIEWER, lease=False)
async def start_stability(
    service: ServiceOf, request: StabilityRequest, response: Response
) -> JobDocument:
    """Begin to hold averages of ranges over rising times against those that follow them.

    The result is the Allan deviation of the median pixel and of nine in ten: it falls with noise,
    and rises with drift and with what moves. Of the frames that the camera captures from now on,
    or of the first ones of a recording.
    """
    work = partial(_found, service, request, Region.of(request.region))
    return planned.as_job(service, "stability", work, response)


async def _found(
    service: Service, request: StabilityRequest, region: Region | None, progress: Progress
) -> StabilityDocument:
    ranges: list[NDArray[Any]] = []
    times_s: list[float] = []
    async for frame, pipeline in _frames(service, request):
        progress.at(len(ranges) / request.frames, "frames")
        range_m = await frame.product(pipeline.product("range"))
        seen = range_m.ravel() if region is None else range_m[region.mask(*range_m.shape)]
        ranges.append(seen[:: -(-seen.size // PIXELS)])
        times_s.append(frame.raw.device_time_s)
    return StabilityDocument.model_validate(stability(ranges, times_s))


async def _frames(
    service: Service, request: StabilityRequest
) -> AsyncIterator[tuple[Frame, Pipeline]]:
    """Yield the first frames of a recording, or those that the camera captures from now on."""
    if request.recording is not None:
        recorded = await service.recorded_frames.opened(request.recording)
        count = min(request.frames, len(await recorded.captured_unix_s()))
        for number in range(1, count + 1):
            yield await recorded.frame(str(number)), recorded.pipeline
        return
    number = 0
    for _ in range(request.frames):
        frame = await service.hub.newest(after=number, wait_s=planned.FRAME_WITHIN_S)
        number = frame.number
        yield frame, service.pipeline
