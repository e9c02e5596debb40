"""What routes ask FastAPI for."""

from typing import Annotated

from fastapi import Depends, Request

from transientcam_server.service import Service


# async, or FastAPI takes a thread for it
async def _service(request: Request) -> Service:
    service: Service = request.app.state.service
    return service


ServiceOf = Annotated[Service, Depends(_service)]
"""The service that a route belongs to."""
