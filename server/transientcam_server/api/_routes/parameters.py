"""The parameters: everything that can be set or limits something, described by itself."""

from fastapi import APIRouter

from transientcam_server.api import _parameters as parameters
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.parameters import ParametersDocument
from transientcam_server.recording import ReplayCamera

router = APIRouter(tags=["parameters"])


@router.get("/parameters", summary="What can be set, and within which limits")
async def read_parameters(service: ServiceOf) -> ParametersDocument:
    """Describe everything that can be set, with its present value and the limits of validation."""
    fixed = isinstance(service.camera, ReplayCamera)
    sequence, settings = service.applied.sequence, service.pipeline.reconstruction.settings
    found = [
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
    ]
    return ParametersDocument(parameters=found)
