"""The parameters: everything that can be set or limits something, described by itself."""

from typing import Any, Literal

from fastapi import APIRouter

from transientcam_server.api import _parameters as parameters
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents import Document
from transientcam_server.recording import ReplayCamera

router = APIRouter(tags=["parameters"])


class ParameterDocument(Document):
    """One value, and what it may be while the others stay as they are."""

    name: str
    resource: str
    """Whose document it stands in: `PUT` that, changed, to set it."""
    pointer: str
    """Where in that document: a JSON pointer (RFC 6901)."""
    value: Any = None
    type: Literal["number", "integer", "boolean", "string"]
    unit: str | None = None
    min: int | float | None = None
    """The least that is accepted; null without such a limit."""
    max: int | float | None = None
    """The most that is accepted; null without such a limit."""
    allowed: list[Any] | None = None
    """Every value that is accepted; null where they are not counted."""
    access: Literal["read-write", "read-only"]
    """What is `read-only` is set when the service starts, or not at all."""
    description: str


class ParametersDocument(Document):
    """All parameters."""

    parameters: list[ParameterDocument]


@router.get("/parameters", summary="What can be set, and within which limits")
async def read_parameters(service: ServiceOf) -> ParametersDocument:
    """Describe everything that can be set, with its present value and the limits of validation."""
    fixed = isinstance(service.camera, ReplayCamera)
    sequence, settings = service.applied.sequence, service.pipeline.reconstruction.settings
    found = (
        *parameters.of_sequence(
            sequence,
            service.camera.capabilities,
            least_harmonics=settings.least_harmonics,
            access="read-only" if fixed else "read-write",
        ),
        *parameters.of_reconstruction(settings, sequence),
        *parameters.of_acquisition(running=service.acquisition.status().running),
        *parameters.of_history(service.settings.history),
        *parameters.of_recordings(service.settings.recordings),
    )
    return ParametersDocument(
        parameters=[ParameterDocument(**each.to_document()) for each in found]
    )
