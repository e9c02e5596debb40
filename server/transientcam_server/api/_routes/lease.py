"""The lease: who controls the camera while others watch."""

from typing import Annotated, Final

from fastapi import APIRouter, Header, Response

from transientcam.wire import LEASE_HEADER
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import PrincipalOf, needs
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.lease import (
    GrantedLeaseDocument,
    LeaseDocument,
    LeaseRenewal,
    LeaseRequest,
)
from transientcam_server.api._problems import documented
from transientcam_server.camera import lease as leases
from transientcam_server.errors import kinds
from transientcam_server.service import Service

router = APIRouter(tags=["lease"])
_THE_SAME: Final = LeaseRenewal()

_LeaseId = Annotated[str | None, Header(alias=LEASE_HEADER, description="`lease_id` of the lease")]


@router.get("/lease", summary="Who controls the camera")
async def read_lease(service: ServiceOf) -> LeaseDocument:
    """Return who controls the camera, and until when."""
    lease = service.lease.current
    return LeaseDocument(held=False) if lease is None else _document(service, lease)


@router.post(
    "/lease",
    status_code=201,
    summary="Take control of the camera",
    responses=documented(kinds.LEASE_HELD, kinds.CAMERA_FAILED, kinds.CAMERA_LOST),
)
@needs(Role.OPERATOR, lease=False)
async def take_lease(
    service: ServiceOf, principal: PrincipalOf, response: Response, wanted: LeaseRequest
) -> GrantedLeaseDocument:
    """Let only requests with this lease's id change anything, until it is given back or lapses.

    Renew it well before it expires. Without a lease every client may change anything as long as no
    other holds one.
    """
    lease = service.lease.grant(
        holder=wanted.holder,
        rank=principal.role,
        by=principal.name,
        duration_s=wanted.duration_s,
        on_lapse=wanted.on_lapse,
        takeover=wanted.takeover,
    )
    if service.origin_lease is not None:
        try:
            await service.origin_lease.take(lease, takeover=wanted.takeover)
        except BaseException:
            service.lease.release(lease.id)
            raise
    return _granted(service, response, lease)


@router.put("/lease", summary="Renew the lease", responses=documented(kinds.LEASE_LOST))
@needs(Role.OPERATOR, lease=False)
async def renew_lease(
    service: ServiceOf,
    response: Response,
    terms: LeaseRenewal = _THE_SAME,
    lease_id: _LeaseId = None,
) -> GrantedLeaseDocument:
    """Let the lease last for its duration from now on; a body may change its terms."""
    lease = service.lease.renew(lease_id, duration_s=terms.duration_s, on_lapse=terms.on_lapse)
    return _granted(service, response, lease)


@router.delete("/lease", summary="Give the lease back", responses=documented(kinds.LEASE_LOST))
@needs(Role.OPERATOR, lease=False)
async def give_lease_back(service: ServiceOf, lease_id: _LeaseId = None) -> LeaseDocument:
    """Allow changes by every client again; the camera goes on as it is."""
    service.lease.release(lease_id)
    if service.origin_lease is not None:
        await service.origin_lease.released()
    return LeaseDocument(held=False)


def _granted(service: Service, response: Response, lease: leases.Lease) -> GrantedLeaseDocument:
    response.headers["Cache-Control"] = "no-store"
    fields = _document(service, lease).model_dump()
    return GrantedLeaseDocument(lease_id=lease.id, **fields)


def _document(service: Service, lease: leases.Lease) -> LeaseDocument:
    return LeaseDocument(
        held=True,
        holder=lease.holder,
        expires_in_s=service.lease.remaining_s(lease),
        duration_s=lease.duration_s,
        on_lapse=lease.on_lapse,
    )
