"""The camera: what it can do, and how it is."""

import asyncio
import contextlib
from dataclasses import asdict
from typing import Any

from fastapi import APIRouter, Request, status

from transientcam.cli.devices import cameras_here
from transientcam.cli.findings import guarded
from transientcam_driver import CameraError, Status
from transientcam_driver.camera import light_warning
from transientcam_driver.cli.doctor import checks
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import needs
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.camera import (
    CameraChangeDocument,
    CameraChoicesDocument,
    CameraDocument,
)
from transientcam_server.api._problems import documented
from transientcam_server.api._shared_answer import SharedAnswer
from transientcam_server.errors import kinds
from transientcam_server.relay import RelayCamera
from transientcam_server.settings import Settings

router = APIRouter(tags=["camera"])


@router.get("/camera", summary="The camera")
async def read_camera(service: ServiceOf) -> CameraDocument:
    """Return what the camera can do and its state, with its status as the camera reports it."""
    camera = service.camera
    status = None
    if service.acquisition.status().state != "lost":
        with contextlib.suppress(CameraError):  # `state` and `reason` then report it
            status = _document(await asyncio.wrap_future(service.acquisition.device_status()))
    acquisition, sensor = service.acquisition.status(), service.sensor
    return CameraDocument(
        state=acquisition.state,
        reason=acquisition.reason,
        simulated=camera.simulation is not None,
        light_warning=light_warning(camera),
        capabilities=asdict(camera.capabilities),
        intrinsics=CameraDocument.IntrinsicsDocument(**asdict(service.intrinsics)),
        sensor=None if sensor is None else CameraDocument.SensorDocument(**asdict(sensor)),
        origin=_origin(service.relay),
        status=status,
        counters=asdict(camera.counters),
    )


def choices(settings: Settings) -> CameraChoicesDocument:
    """Look for cameras; also on the network, unless the settings keep away from that."""
    checked = guarded("USB", checks)
    return CameraChoicesDocument(
        current=settings.camera,
        missing=[each.to_document() for each in checked if each.level != "ok"],
        **cameras_here(network=settings.announce != "off"),
    )


@router.get("/camera/choices", summary="Cameras to choose from")
async def read_choices(request: Request) -> CameraChoicesDocument:
    """Look for cameras at this machine and on the network, which takes about a second.

    Requests that come meanwhile get the same answer. Services of other cameras are in `GET
    /cameras`.
    """
    shared: SharedAnswer[CameraChoicesDocument] = request.app.state.choices
    return await shared.get()


@router.put(
    "/camera",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Serve another camera",
    responses=documented(kinds.CAMERA_FAILED, kinds.CAMERA_BUSY),
)
@needs(Role.ADMIN, lease=True, light=True)
async def change_camera(service: ServiceOf, wanted: CameraChangeDocument) -> CameraChangeDocument:
    """Open another camera; once that is done end with the present one, its light first.

    Its jobs, recording, streams and lease end with it; where the other one cannot be opened it goes
    on. Within a second or two a service with another `service_id` answers. Settings of the first
    camera (calibration, sequence, sensor, lens) do not hold for another. It takes an admin, as a
    name may be a file or an address, with the right `may_light`.
    """
    await service.change_camera(wanted.camera)
    return wanted


def _origin(relay: RelayCamera | None) -> CameraDocument.OriginDocument | None:
    if relay is None:
        return None
    found = relay.origin
    return CameraDocument.OriginDocument.model_validate(
        {
            "url": relay.url,
            "service_id": found.service_id,
            "version": found.version,
            "role": found.role,
            "product": relay.product,
            **asdict(relay.relayed),
        }
    )


def _document(status: Status) -> dict[str, Any]:
    document = asdict(status)
    del document["flags"]
    return document | {
        "state": status.state.name.lower(),
        "light_on": status.light_on,
        "interlock_closed": status.interlock_closed,
        "watchdog_tripped": status.watchdog_tripped,
    }
