"""Series: frames at several settings, and how far their ranges scatter and are off."""

import numpy as np
from fastapi import APIRouter, Response, status

from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import needs
from transientcam_server.api._dependencies import OffsOf, ServiceOf
from transientcam_server.api._documents.job import JobDocument
from transientcam_server.api._documents.series import SeriesRequest, SettingRequest
from transientcam_server.api._job_answers import ACCEPTED, accepted
from transientcam_server.api._problems import documented
from transientcam_server.camera import Setting, start_series
from transientcam_server.errors import kinds
from transientcam_server.imaging import require_estimator
from transientcam_server.planning import Region
from transientcam_server.service import Service

router = APIRouter(tags=["accuracy"])


@router.post(
    "/series/jobs",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Compare settings by captured frames",
    responses=ACCEPTED
    | documented(
        kinds.INVALID_SEQUENCE,
        kinds.ESTIMATOR_MISFIT,
        kinds.CAMERA_BUSY,
        kinds.RECORDING_RUNS,
        kinds.TOO_MANY_JOBS,
    ),
)
@needs(Role.OPERATOR, lease=True, light=True)
async def start(
    service: ServiceOf, response: Response, wanted: SeriesRequest, offs: OffsOf
) -> JobDocument:
    """Start a job that captures frames at each setting, with the camera for itself.

    Its result has in `rows`, from the first setting on, what was set, how long it took, and of the
    pixels: `range_std_m` (of the median pixel, `range_std_p90_m` of nine in ten), the standard
    deviation of the range between frames; `range_bias_m` and `range_bias_abs_m`, how far the mean
    of a pixel is off the `reference`, in the median: the truth of a simulated scene, or the plane
    that fits the ranges best, which suits a `region` that is flat; `within_share`, of all ranges;
    and `valid_share`, of those that there are. The sequence in use before returns at the end, also
    where the job is cancelled or the light switched off.
    """
    service.require_no_recording("A series")
    capabilities, region = service.camera.capabilities, Region.of(wanted.region)
    shape = capabilities.height, capabilities.width
    job = start_series(
        [_setting(service, each) for each in wanted.settings],
        frames=wanted.frames,
        pixels=np.ones(shape, bool) if region is None else region.mask(*shape),
        target_m=wanted.target_m,
        acquisition=service.acquisition,
        pipeline=service.pipeline,
        jobs=service.jobs,
        offs=offs,
    )
    return accepted(job, response)


def _setting(service: Service, wanted: SettingRequest) -> Setting:
    present = service.applied.to_document() | wanted.sequence
    sequence = service.camera.capabilities.sequence_of(present)
    service.camera.validate(sequence)
    changes = wanted.reconstruction.model_dump(exclude_unset=True)
    settings = service.pipeline.reconstruction.settings.model_copy(update=changes)
    require_estimator(settings, sequence, field="estimator")
    return Setting(sequence, settings)
