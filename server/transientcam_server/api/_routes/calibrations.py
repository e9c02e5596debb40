"""Calibrations: measure, activate, import, download and delete them."""

import asyncio
import time
from typing import Annotated, Final

from fastapi import APIRouter, Path, Request, Response, status
from fastapi.responses import FileResponse

from transientcam_server.api import _downloads as downloads
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import needs
from transientcam_server.api._dependencies import OffsOf, ServiceOf
from transientcam_server.api._documents.calibration import (
    MAX_NAME,
    ActivationRequest,
    ActiveDocument,
    CalibrationDocument,
    CalibrationRequest,
    CalibrationsDocument,
    DeviceDocument,
    DriftDocument,
    HarmonicsDocument,
    VerdictDocument,
)
from transientcam_server.api._documents.job import JobDocument
from transientcam_server.api._job_answers import ACCEPTED, accepted
from transientcam_server.api._problems import documented
from transientcam_server.api._uploads import body_of, received
from transientcam_server.camera import CalibrationOptions, Drift, StoredCalibration
from transientcam_server.errors import kinds
from transientcam_server.imaging import to_document
from transientcam_server.service import Service

router = APIRouter(tags=["calibrations"])

IMPORT: Final = "/calibrations/import"
_CALIBRATED: Final = "Moments are calibrated"
NPZ: Final = "application/octet-stream"
_Calibration = Annotated[
    str,
    Path(
        description="its id, as the list has it",
        max_length=200,
        examples=["SIM-prototype-0-3f9c2a71b04e"],
    ),
]


@router.get("/calibrations", summary="All calibrations")
async def read_calibrations(service: ServiceOf) -> CalibrationsDocument:
    """List the calibrations, the newest first, with the active one and how it does."""
    desk = service.calibrations
    stored = await asyncio.to_thread(desk.store.all)
    drift = await desk.drift()
    return CalibrationsDocument(
        active=desk.active_id,
        former=desk.former_id,
        directory=str(desk.store.directory),
        calibrations=[_document(service, each, drift) for each in stored],
    )


@router.post(
    "/calibrations",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Measure a calibration",
    responses=ACCEPTED | documented(kinds.CAMERA_BUSY, kinds.RECORDING_RUNS, kinds.TOO_MANY_JOBS),
)
@needs(Role.OPERATOR, lease=True, light=True)
async def measure_calibration(
    service: ServiceOf, response: Response, wanted: CalibrationRequest, offs: OffsOf
) -> JobDocument:
    """Start a job that measures a calibration with the present sequence.

    Put filter and diffuser before the lens first, so that the light shines at the sensor
    (Sec. 4.2). The job has the camera for itself, so that no frames come meanwhile; switching the
    light off ends it, also while it waits. It takes the right `may_light`, and announces the light.
    Its result holds the id of the calibration, in `calibration`, and in `verdict` whether the
    images look like a diffuser's. If they don't, the calibration is kept, but not used without
    `force`: `activated` says whether it is. `harmonics` has those of the modulation, from a phase
    sweep, or `no_harmonics` why there are none.
    """
    service.require_no_recording("A calibration")
    order = CalibrationOptions(**wanted.model_dump())
    job = service.calibrations.measure(order, lambda: service.applied, offs=offs)
    return accepted(job, response)


@router.get("/calibrations/active", summary="The active calibration")
async def read_active_calibration(service: ServiceOf) -> ActiveDocument:
    """Return which calibration is active, and what frames are really calibrated by."""
    return _active(service)


@router.put(
    "/calibrations/active",
    summary="Use a calibration",
    responses=documented(
        kinds.UNKNOWN_CALIBRATION,
        kinds.CALIBRATION_MISFIT,
        kinds.CALIBRATION_DOUBTED,
        kinds.ONLY_MOMENTS,
        kinds.INVALID_CALIBRATION,
    ),
)
async def activate_calibration(service: ServiceOf, wanted: ActivationRequest) -> ActiveDocument:
    """Calibrate frames from the next one on, and after the next start, by this.

    One that is not good for this camera and its present sequence is refused, and so is one that was
    not measured on a diffuser, unless `force` is set. Streams are sent a
    `calibration-changed` notice, and each frame carries the id of its calibration.
    """
    service.require_images(_CALIBRATED)
    await service.calibrations.activate(wanted.id, lambda: service.applied, force=wanted.force)
    return _active(service)


@router.post(
    "/calibrations/active/undo",
    summary="Return to the former calibration",
    responses=documented(
        kinds.UNKNOWN_CALIBRATION,
        kinds.CALIBRATION_MISFIT,
        kinds.INVALID_CALIBRATION,
        kinds.NO_FORMER_CALIBRATION,
        kinds.ONLY_MOMENTS,
    ),
)
async def restore_calibration(service: ServiceOf) -> ActiveDocument:
    """Calibrate frames by what was active before the present calibration; again, and it returns."""
    service.require_images(_CALIBRATED)
    await service.calibrations.restore(lambda: service.applied)
    return _active(service)


@router.post(
    IMPORT,
    status_code=status.HTTP_201_CREATED,
    summary="Take a calibration in",
    openapi_extra=body_of(NPZ, "PK\u0003\u0004"),
    responses=documented(kinds.TOO_LARGE, kinds.INVALID_CALIBRATION, kinds.CALIBRATION_NOT_STORED),
)
@needs(Role.OPERATOR, lease=False)  # no frame is calibrated by it yet
async def import_calibration(service: ServiceOf, request: Request) -> CalibrationDocument:
    """Keep the file that is sent as body; one that is here already stays as it is.

    It may be of another camera or for another sequence; `fits` states whether it can be used.
    """
    store = service.calibrations.store
    part = await asyncio.to_thread(store.new_part)
    try:
        with part.open("wb") as file:
            async for piece in received(request, limit=service.settings.calibrations.max_bytes):
                await asyncio.to_thread(file.write, piece)
        stored = await asyncio.to_thread(store.import_file, part)
    except OSError as error:
        raise store.not_stored(error) from error
    finally:
        await asyncio.to_thread(part.unlink, missing_ok=True)
    return _document(service, stored, None)


@router.get(
    "/calibrations/{calibration}",
    summary="A calibration",
    responses=documented(kinds.UNKNOWN_CALIBRATION),
)
async def read_calibration(service: ServiceOf, calibration: _Calibration) -> CalibrationDocument:
    """Describe a calibration."""
    stored = await asyncio.to_thread(service.calibrations.store.get, calibration)
    return _document(service, stored, await service.calibrations.drift())


@router.delete(
    "/calibrations/{calibration}",
    summary="Delete a calibration",
    responses=documented(
        kinds.UNKNOWN_CALIBRATION, kinds.CALIBRATION_IN_USE, kinds.CALIBRATION_NOT_STORED
    ),
)
@needs(Role.ADMIN, lease=False)
async def delete_calibration(service: ServiceOf, calibration: _Calibration) -> CalibrationDocument:
    """Delete a calibration for good; the answer says what it was."""
    return _document(service, await service.calibrations.delete(calibration), None)


@router.get(
    "/calibrations/{calibration}/file",
    summary="The file of a calibration",
    response_class=FileResponse,
    responses=downloads.documented_file(NPZ)
    | documented(kinds.UNKNOWN_CALIBRATION, kinds.RANGE_NOT_SATISFIABLE),
)
async def read_calibration_file(
    service: ServiceOf, calibration: _Calibration, wanted: downloads.Range = None
) -> FileResponse:
    """Download a calibration as .npz: to `import` it elsewhere, or for `serve --calibration`."""
    stored = await asyncio.to_thread(service.calibrations.store.get, calibration)
    return await downloads.answer(
        stored.path,
        wanted,
        disk=service.recordings.disk,
        gone=kinds.UNKNOWN_CALIBRATION,
        media_type=NPZ,
        filename=f"{stored.id}.npz",
    )


def _active(service: Service) -> ActiveDocument:
    notice = service.calibrations.notice(service.applied)
    desk = service.calibrations
    return ActiveDocument(id=desk.active_id, former=desk.former_id, **notice)


def _document(
    service: Service, stored: StoredCalibration, drift: Drift | None
) -> CalibrationDocument:
    subject, waveform = stored.subject, to_document(stored.waveform)
    misfit = service.calibrations.misfit(stored, service.applied)
    active = stored.id == service.calibrations.active_id
    return CalibrationDocument(
        id=stored.id,
        name=str(stored.notes.get("name", ""))[:MAX_NAME],
        created_at=stored.captured_unix_s,
        age_s=max(0.0, time.time() - stored.captured_unix_s),
        device=DeviceDocument(
            model=stored.model, serial=subject.serial, width=subject.width, height=subject.height
        ),
        sequence=subject.sequence.to_document(),
        exposure_s=subject.sequence.exposure_s,
        temperature_c=stored.temperature_c,
        bytes=stored.size_bytes,
        fits=misfit is None,
        reason=None if misfit is None else str(misfit),
        active=active,
        verdict=VerdictDocument.model_validate(stored.verdict.to_document()),
        forced=stored.notes.get("forced") is True,
        harmonics=None if waveform is None else HarmonicsDocument(**waveform),
        drift=DriftDocument.model_validate(drift) if active and drift else None,
    )
