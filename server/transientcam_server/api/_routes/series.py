"""Series: frames at several settings, and how far their ranges scatter and are off."""

import numpy as np
from fastapi import APIRouter, Response, status

from transientcam_driver import Sequence
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import needs
from transientcam_server.api._dependencies import OffsOf, ServiceOf
from transientcam_server.api._documents.job import JobDocument
from transientcam_server.api._documents.plan import SeriesRequest, SettingRequest
from transientcam_server.api._job_answers import ACCEPTED, accepted
from transientcam_server.api._problems import documented
from transientcam_server.camera import MAX_VALUES, start_series
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import require_estimator
from transientcam_server.planning import Region
from transientcam_server.service import Service
from transientcam_server.settings import ReconstructionSettings

router = APIRouter(tags=["accuracy"])
_REFUSALS = (kinds.INVALID_SEQUENCE, kinds.ESTIMATOR_MISFIT, kinds.CAMERA_BUSY)


@router.post(
    "/series/jobs",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Compare settings by captured frames",
    responses=ACCEPTED | documented(*_REFUSALS, kinds.RECORDING_RUNS, kinds.TOO_MANY_JOBS),
)
@needs(Role.OPERATOR, lease=True, light=True)
async def start(
    service: ServiceOf, response: Response, wanted: SeriesRequest, offs: OffsOf
) -> JobDocument:
    """Start a job that captures frames at each setting, with the camera for itself.

    Its `rows`, so far while it runs, have what was set and how long it took; `range_std_m`, the
    standard deviation of the range between frames in the median pixel, and in nine of ten;
    `range_bias_m` and `range_bias_abs_m`, how far the mean of the median pixel is off the
    `reference`: the `truth` of a simulation, or the `plane` that fits the ranges best, which suits
    a flat `region`; `within_share`, of all ranges; and `valid_share`, of those that there are. The
    sequence in use returns at the end, also of a job that is cancelled or whose light goes off.
    """
    service.require_no_recording("A series")
    region, capabilities = Region.of(wanted.region), service.camera.capabilities
    shape = capabilities.height, capabilities.width
    pixels = np.ones(shape, bool) if region is None else region.mask(*shape)
    most = MAX_VALUES // max(1, int(pixels.sum()))
    if wanted.frames > most:
        limit = f"at most {most}, by the memory"
        detail = f"frames = {wanted.frames}: must be {limit}"
        raise Problem(
            kinds.INVALID_REQUEST, detail, field="frames", value=wanted.frames, limit=limit
        )
    job = start_series(
        [_setting(service, each) for each in wanted.settings],
        frames=wanted.frames,
        pixels=pixels,
        target_m=wanted.target_m,
        acquisition=service.acquisition,
        pipeline=service.pipeline,
        jobs=service.jobs,
        offs=offs,
    )
    return accepted(job, response)


def _setting(service: Service, wanted: SettingRequest) -> tuple[Sequence, ReconstructionSettings]:
    present = service.applied.to_document() | wanted.sequence
    sequence = service.camera.capabilities.sequence_of(present)
    service.camera.validate(sequence)
    changes = wanted.reconstruction.model_dump(exclude_unset=True)
    settings = service.pipeline.reconstruction.settings.model_copy(update=changes)
    require_estimator(settings, sequence, field="estimator")
    return sequence, settings
