"""The acquisition: whether frames are captured."""

import asyncio

from fastapi import APIRouter

from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import needs
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
        kinds.CAMERA_BUSY,
        kinds.CAMERA_FAILED,
        kinds.CAMERA_LOST,
    ),
)
async def change_acquisition(service: ServiceOf, wanted: AcquisitionRequest) -> AcquisitionDocument:
    """Start or stop capturing; the camera's light is off while it does not.

    A calibration that is being measured is ended by stopping.
    """
    await asyncio.wrap_future(service.acquisition.set_running(wanted.running))
    return _document(service)


@router.post(
    "/acquisition/safe-off",
    summary="Switch the light off, now",
    responses=documented(kinds.CAMERA_FAILED, kinds.CAMERA_LOST),
)
@needs(Role.VIEWER, lease=False)
async def switch_off(service: ServiceOf) -> AcquisitionDocument:
    """Stop capturing and switch the light off, whichever client holds the lease.

    Where the camera cannot be reached it is not started again when it is back; its own watchdog
    switches the light off as soon as it receives nothing from here.
    """
    await asyncio.wrap_future(service.acquisition.safe_off())
    return _document(service)


def _document(service: Service) -> AcquisitionDocument:
    return AcquisitionDocument.model_validate(service.acquisition.status())
