"""Metrics, for Prometheus."""

import contextlib
from typing import Any, Final

from fastapi import APIRouter, Response

from transientcam_server.api._dependencies import MetricsOf, ServiceOf
from transientcam_server.api._metrics import CONTENT_TYPE
from transientcam_server.api._problems import documented
from transientcam_server.errors import Problem, kinds

router = APIRouter(tags=["health"])

_TEXT: Final[dict[int | str, dict[str, Any]]] = {
    200: {
        "description": "The text format of Prometheus",
        "content": {"text/plain": {"schema": {"type": "string"}}},
    }
}


@router.get(
    "/metrics",
    summary="Metrics",
    response_class=Response,
    responses=_TEXT | documented(kinds.TOKEN_REQUIRED, kinds.TOKEN_REFUSED),
)
async def read_metrics(service: ServiceOf, metrics: MetricsOf) -> Response:
    """Return what Prometheus scrapes; where tokens are required, one of a viewer is enough."""
    await service.calibrations.drift()  # counted anew every few seconds at most
    with contextlib.suppress(Problem):  # a disk that does not answer says so itself
        await service.recordings.disk.run(service.recordings.free_bytes)
    return Response(metrics.exposition(), media_type=CONTENT_TYPE)
