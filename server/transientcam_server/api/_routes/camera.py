"""The camera: what it can do, and how it is."""

import asyncio
import contextlib
from dataclasses import asdict
from typing import Any

from fastapi import APIRouter

from transientcam_driver import CameraError, Status
from transientcam_driver.camera import light_warning
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.camera import CameraDocument
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
