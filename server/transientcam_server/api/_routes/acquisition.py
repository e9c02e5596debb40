"""The acquisition: whether frames are captured."""

import asyncio
import re
from concurrent.futures import Future
from typing import Annotated, Final

from fastapi import APIRouter, Header, Request

from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import TO_LIGHT, needs, require
from transientcam_server.api._dependencies import OffsOf, ServiceOf
from transientcam_server.api._documents.camera import AcquisitionDocument, AcquisitionRequest
from transientcam_server.api._problems import documented
from transientcam_server.camera import outdated
from transientcam_server.errors import Problem, kinds
from transientcam_server.service import Service

router = APIRouter(tags=["acquisition"])
CONFIRMED_S: Final = 5.0
"""Time to wait until it is confirmed that the light is off."""
MOST_WAIT_S: Final = 60.0
"""The same where a client prefers to wait longer: a relay."""
_WAIT: Final = re.compile(r"(?:^|[,;\s])wait=(\d{1,4})")

_Prefer = Annotated[
    str | None,
    Header(
        alias="Prefer",
        description="`wait=SECONDS` (RFC 7240): how long to wait until it is confirmed that the "
        f"light is off, {MOST_WAIT_S:g} at most",
    ),
]


@router.get("/acquisition", summary="Whether frames are captured")
async def read_acquisition(service: ServiceOf) -> AcquisitionDocument:
    """Return whether frames are captured, and how fast."""
    return _document(service)


@router.put(
    "/acquisition",
    summary="Start or stop capturing",
    responses=documented(
        kinds.MAY_NOT_LIGHT,
        kinds.CAMERA_BUSY,
        kinds.START_OUTDATED,
        kinds.CAMERA_FAILED,
        kinds.CAMERA_LOST,
        kinds.LIGHT_UNCONFIRMED,
    ),
)
async def change_acquisition(
    service: ServiceOf,
    wanted: AcquisitionRequest,
    http: Request,
    offs: OffsOf,
    prefer: _Prefer = None,
) -> AcquisitionDocument:
    """Start or stop capturing; the camera's light is off while it does not.

    Starting takes the right `may_light`. The light goes on once it was announced for the setting
    `light.delay_s`: `state` is `arming` until then. A start that arrived before the light was to go
    off, and is handled afterwards, is refused. Stopping ends calibrations that are measured or
    wait for that, and holds over a restart of the service.
    """
    if wanted.running:
        require(http, service, TO_LIGHT)
        if wanted.offs not in (None, offs):
            raise outdated()
        await asyncio.wrap_future(service.acquisition.set_running(True, offs=offs))
    else:
        await _confirmed(service, service.acquisition.set_running(False), prefer)
    return _document(service)


@router.post(
    "/acquisition/safe-off",
    summary="Switch the light off, now",
    responses=documented(kinds.CAMERA_FAILED, kinds.CAMERA_LOST, kinds.LIGHT_UNCONFIRMED),
)
@needs(Role.VIEWER, lease=False)
async def switch_off(service: ServiceOf, prefer: _Prefer = None) -> AcquisitionDocument:
    """Stop capturing and switch the light off, whichever client holds the lease.

    It stays off, also over a restart of the service or of the camera, until somebody starts the
    capture. Where the camera cannot be reached its own watchdog switches the light off as soon as
    it receives nothing from here. A relay sends it to its origin again and again until that
    confirms it, also after it has answered `light-unconfirmed`.
    """
    await _confirmed(service, service.acquisition.safe_off(), prefer)
    return _document(service)


async def _confirmed(service: Service, off: "Future[None]", prefer: str | None) -> None:
    """Wait until the light is off, and a moment until that is kept.

    Raises Problem ``light-unconfirmed`` where that takes too long; what is under way goes on.
    """
    asked = _WAIT.search(prefer or "")
    wait_s = CONFIRMED_S if asked is None else min(float(asked[1]), MOST_WAIT_S)
    confirmed = asyncio.wrap_future(off)
    confirmed.add_done_callback(lambda done: done.cancelled() or done.exception())
    await asyncio.wait((confirmed,), timeout=wait_s)
    await service.off_kept()
    if not confirmed.done():
        detail = f"The light may be on: it was not confirmed within {wait_s:g} s that it is off."
        raise Problem(kinds.LIGHT_UNCONFIRMED, detail, limit=wait_s)
    await confirmed


def _document(service: Service) -> AcquisitionDocument:
    return AcquisitionDocument.model_validate(service.acquisition.status())
