"""The service as one ASGI application."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from typing import Final

from fastapi import APIRouter, Depends, FastAPI

from transientcam_driver import Camera
from transientcam_server.api import _problems as problems, _query as query
from transientcam_server.api._auth import permissions
from transientcam_server.api._auth.guard import Authentication, Guard
from transientcam_server.api._docs import openapi, pages
from transientcam_server.api._metrics import Metrics
from transientcam_server.api._middleware.answers import AnswerLimit
from transientcam_server.api._middleware.requests import RequestLog
from transientcam_server.api._middleware.security import (
    BodyLimit,
    OriginCheck,
    RootPath,
    SecurityHeaders,
)
from transientcam_server.api._neighbours import NeighbourSearch
from transientcam_server.api._routes import (
    acquisition,
    calibrations,
    camera,
    frames,
    health,
    info,
    jobs,
    lease,
    metrics as metrics_route,
    neighbours,
    parameters,
    plan,
    preview,
    products,
    reconstruction,
    recording_frames,
    recording_zarr,
    recordings,
    sequence,
    series,
    simulation,
    tradeoff,
)
from transientcam_server.api._routes.camera import choices
from transientcam_server.api._shared_answer import SharedAnswer
from transientcam_server.api._stream import websocket
from transientcam_server.service import VERSION, Service
from transientcam_server.settings import Settings

API: Final = "/api/v1"
_RESOURCES = (
    info, neighbours, camera, lease, sequence, reconstruction, calibrations, acquisition, frames,
    preview, recordings, recording_frames, recording_zarr, products, simulation, plan, tradeoff,
    series, parameters, jobs,
)  # fmt: skip


def build_app(camera: Camera, settings: Settings) -> FastAPI:
    """Return the application that serves ``camera``; it captures while its lifespan lasts.

    The camera stays the caller's: it is neither opened nor closed here.
    """
    service = Service(camera, settings)
    metrics = Metrics(service)
    service.observers.append(metrics)
    guard = Guard(settings)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with service.running(), websocket.watching_tokens(service.hub, guard):
            yield

    app = FastAPI(
        title="transientcam",
        version=VERSION,
        summary="A networked camera for transient imaging",
        description=pages.DESCRIPTION,
        license_info={"name": "BSD-3-Clause", "identifier": "BSD-3-Clause"},
        lifespan=lifespan,
        openapi_url=None,  # openapi.router has one that is not made on the event loop
        docs_url=None,  # pages.router has one that needs no other host
        redoc_url=None,
        swagger_ui_oauth2_redirect_url=None,
        servers=[{"url": "."}],  # relative to the document: below the path of any proxy
    )
    app.state.service = service
    app.state.metrics = metrics
    app.state.guard = guard
    app.state.neighbours = NeighbourSearch.of(settings)
    app.state.choices = SharedAnswer(partial(choices, settings))
    api = APIRouter()
    admitted = [Depends(permissions.admit), Depends(query.require_known)]
    for resource in _RESOURCES:
        api.include_router(resource.router, dependencies=admitted)
    api.include_router(websocket.router)
    app.include_router(api, prefix=API)  # with a prefix of its own FastAPI analyses it twice
    for outside in (info.versions, health.router, metrics_route.router):
        app.include_router(outside)
    for documents in (openapi.router, pages.router):
        app.include_router(documents)
    pages.add_dashboard(app)
    problems.install(app, prefix=API)
    permissions.describe(app, [resource.router for resource in _RESOURCES], prefix=API)
    openapi.describe_limits(app, camera.capabilities, prefix=API)
    # the last one added is the first to see a request
    files = frozenset(f"{API}{each}" for each in (calibrations.IMPORT, recordings.IMPORT))
    app.add_middleware(BodyLimit, counted_elsewhere=files)
    app.add_middleware(AnswerLimit, limits=settings.limits)
    app.add_middleware(Authentication, guard=guard)
    app.add_middleware(OriginCheck, settings=settings)
    app.add_middleware(RequestLog, metrics=metrics)
    app.add_middleware(SecurityHeaders, framed_by=settings.allowed_origins)
    app.add_middleware(RootPath, root_path=settings.root_path)
    _analyse_routes(app)
    return app


def _analyse_routes(app: FastAPI) -> None:
    """Have FastAPI analyse all routes now, which it leaves to the first request.

    The threads of two services in one process may not do so at the same time: pydantic then warns
    of aliases that it takes from the other's parameters.
    """
    scope = {"type": "http", "method": "GET", "path": "/.", "root_path": "", "headers": []}
    for route in app.routes:
        route.matches(dict(scope))
