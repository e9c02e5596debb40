"""The camera: what it can do, and how it is."""

import asyncio
import contextlib
from dataclasses import asdict
from typing import Any

from fastapi import APIRouter, status

from transientcam.cli.devices import cameras_here
from transientcam.cli.findings import guarded
from transientcam_driver import CameraError, Status
from transientcam_driver.camera import light_warning
from transientcam_driver.cli.doctor import checks
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import PrincipalOf, needs
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.camera import CameraDocument
from transientcam_server.api._documents.choices import (
    CameraChangeDocument,
    CameraChoicesDocument,
    CameraRequest,
)
from transientcam_server.api._problems import documented
from transientcam_server.camera import NO_CAMERA
from transientcam_server.errors import Problem, kinds
from transientcam_server.relay import RelayCamera

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


@router.get("/camera/choices", summary="Cameras to choose from")
async def read_choices(service: ServiceOf) -> CameraChoicesDocument:
    """Look for cameras at this machine and on the network, and for what they lack.

    It takes about a second. Services of other cameras are in `GET /cameras`.
    """
    found, missing = await asyncio.to_thread(_looked)
    return CameraChoicesDocument(current=service.settings.camera, missing=missing, **found)


@router.put(
    "/camera",
    status_code=status.HTTP_202_ACCEPTED,
    summary="Serve another camera",
    responses=documented(kinds.CAMERA_FAILED, kinds.CAMERA_BUSY),
)
@needs(Role.OPERATOR, lease=True, light=True)
async def change_camera(
    service: ServiceOf, wanted: CameraRequest, principal: PrincipalOf
) -> CameraChangeDocument:
    """Open another camera; once that is done end with the present one, its light first.

    Jobs, recordings, streams and the lease end with it. It goes on where the other one cannot be
    opened. Settings of the first camera (calibration, sequence, sensor, lens) are not applied to
    another. It takes the right `may_light`; only an admin may name what is not among the choices,
    as a name can be a file or an address.
    """
    if principal.role < Role.ADMIN and wanted.camera != NO_CAMERA:
        found, _ = await asyncio.to_thread(_looked)
        listed = [*found["simulated"], *(each["spec"] for each in found["cameras"])]
        if wanted.camera not in listed:
            limit = "one of GET /camera/choices, unless an admin asks"
            raise Problem(
                kinds.INVALID_REQUEST,
                f"camera = {wanted.camera[:200]!r}: must be {limit}",
                field="camera",
                value=wanted.camera[:200],
                limit=limit,
            )
    await service.change_camera(wanted.camera)
    return CameraChangeDocument(camera=wanted.camera)


def _looked() -> tuple[dict[str, Any], list[dict[str, Any]]]:
    found = cameras_here(network=True)
    missing = [each.to_document() for each in guarded("USB", checks) if each.level != "ok"]
    return found, missing


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
