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


async def _metrics(request: Request) -> Metrics:
    metrics: Metrics = request.app.state.metrics
    return metrics


MetricsOf = Annotated[Metrics, Depends(_metrics)]
"""The metrics of that service."""
