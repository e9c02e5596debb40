"""Health, for orchestrators and load balancers."""

from fastapi import APIRouter

from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.service import LivenessDocument, ReadinessDocument
from transientcam_server.api._problems import documented
from transientcam_server.errors import Problem, kinds

router = APIRouter(tags=["health"])


@router.get("/livez", summary="The process answers")
async def livez() -> LivenessDocument:
    """Answer. An unplugged camera is no reason to restart the process: see `/readyz`."""
    return LivenessDocument()


@router.get("/readyz", summary="Frames can be had", responses=documented(kinds.NOT_READY))
async def readyz(service: ServiceOf) -> ReadinessDocument:
    """Answer 200 while the camera delivers frames or was stopped on request, else why not."""
    reasons = service.not_ready()
    if reasons:
        raise Problem(kinds.NOT_READY, "; ".join(reasons), reasons=reasons)
    return ReadinessDocument()
