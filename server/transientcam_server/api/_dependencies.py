"""What routes depend on: the service, its metrics, and who may use it."""

from typing import Annotated

from fastapi import Depends, Request

from transientcam_server.api._metrics import Metrics
from transientcam_server.service import Service


# async, or FastAPI takes a thread for it
async def _service(request: Request) -> Service:
    service: Service = request.app.state.service
    return service


ServiceOf = Annotated[Service, Depends(_service)]
"""The service that a route belongs to."""


async def _offs(request: Request, service: ServiceOf) -> int:
    # set where the first byte was read; without a connection of the service's own it is now
    offs: int | None = request.scope.get("state", {}).get("offs")
    return service.acquisition.offs if offs is None else offs


OffsOf = Annotated[int, Depends(_offs)]
"""What `Acquisition.offs` was when a request arrived."""


async def _metrics(request: Request) -> Metrics:
    metrics: Metrics = request.app.state.metrics
    return metrics


MetricsOf = Annotated[Metrics, Depends(_metrics)]
"""The metrics of that service."""
