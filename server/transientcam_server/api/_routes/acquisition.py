"""The acquisition: whether frames are captured."""

import asyncio

from fastapi import APIRouter, Request

from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import TO_LIGHT, needs, require
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.camera import AcquisitionDocument, AcquisitionRequest
from transientcam_server.api._problems import documented
from transientcam_server.errors import kinds
from transientcam_server.service import Service

router = APIRouter(tags=["acquisition"])


@router.get("/acquisition", summary="Whether frames are captured")
async def read_acquisition(service: ServiceOf) -> AcquisitionDocument:
    """Return whether frames are captured, and how fast."""
    return _document(service)


@router.put(
    "/acquisition",
    summary="Start or stop capturing",
    responses=documented(
        kinds.BAD_REQUEST,
        kinds.INVALID_REQUEST,
        kinds.MAY_NOT_LIGHT,
        kinds.CAMERA_BUSY,
        kinds.CAMERA_FAILED,
        kinds.CAMERA_LOST,
    ),
)
async def change_acquisition(
    service: ServiceOf, wanted: AcquisitionRequest, http: Request
) -> AcquisitionDocument:
    """Start or stop capturing; the camera's light is off while it does not.

    Starting takes the right `may_light`. The light goes on once it was announced for the setting
    `light.delay_s`: `state` is `arming` until then. Stopping ends calibrations that are measured or
    wait for that, and holds over a restart of the service.
    """
    if wanted.running:
        require(http, service, TO_LIGHT)
        await asyncio.wrap_future(service.acquisition.set_running(True))
    else:
        await service.off(service.acquisition.set_running(False))
    return _document(service)


@router.post(
    "/acquisition/safe-off",
    summary="Switch the light off, now",
    responses=documented(kinds.CAMERA_FAILED, kinds.CAMERA_LOST),
)
@needs(Role.VIEWER, lease=False)
async def switch_off(service: ServiceOf) -> AcquisitionDocument:
    """Stop capturing and switch the light off, whichever client holds the lease.

    It stays off, also over a restart of the service or of the camera, until somebody starts the
    capture. Where the camera cannot be reached its own watchdog switches the light off as soon as
    it receives nothing from here.
    """
    await service.off(service.acquisition.safe_off())
    return _document(service)


def _document(service: Service) -> AcquisitionDocument:
    return AcquisitionDocument.model_validate(service.acquisition.status())
