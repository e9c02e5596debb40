"""The reconstruction: how images become moments, and moments become returns."""

from typing import Any, Final

from fastapi import APIRouter, Response
from pydantic import ConfigDict, JsonValue

from transientcam_server.api import _etags as etags
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.document import EXAMPLES
from transientcam_server.api._problems import documented
from transientcam_server.errors import kinds
from transientcam_server.imaging import SettingsVersion
from transientcam_server.settings import ReconstructionSettings

router = APIRouter(tags=["reconstruction"])
_EXAMPLE: Final[dict[str, JsonValue]] = {"examples": [EXAMPLES["ReconstructionDocument"]]}


class ReconstructionRequest(ReconstructionSettings):
    """How frames should be computed; what is absent takes the paper's value."""

    model_config = ConfigDict(strict=True, json_schema_extra=_EXAMPLE)

    reconstruction_id: int | None = None
    """Ignored, so that a document that was read can be sent back."""


class ReconstructionDocument(ReconstructionSettings):
    """How frames are computed."""

    model_config = ConfigDict(json_schema_extra=_EXAMPLE)

    reconstruction_id: int
    """Counts the settings from 1; frames carry it in their metadata."""


@router.get(
    "/reconstruction",
    summary="How frames are computed",
    response_model=ReconstructionDocument,
    responses=etags.READING,
)
async def read_reconstruction(
    service: ServiceOf, response: Response, if_none_match: etags.IfNoneMatch = None
) -> Any:
    """Return the settings that frames are computed with from now on."""
    tag = _tag(service.pipeline.reconstruction)
    if etags.names(if_none_match, tag):
        return Response(status_code=304, headers={"ETag": tag})
    response.headers["ETag"] = tag
    return service.pipeline.reconstruction.to_document()


@router.put(
    "/reconstruction",
    summary="Change how frames are computed",
    responses=documented(kinds.ESTIMATOR_MISFIT, kinds.ONLY_MOMENTS, kinds.RECONSTRUCTION_CHANGED)
    | etags.CHANGING,
)
async def change_reconstruction(
    service: ServiceOf,
    response: Response,
    wanted: ReconstructionRequest,
    if_match: etags.IfMatch = None,
) -> ReconstructionDocument:
    """Compute frames from the next one on with these settings.

    The camera goes on as it is. Streams are sent a `reconstruction-changed` notice, and each
    frame carries the `reconstruction_id` of its settings.
    """
    tag = _tag(service.pipeline.reconstruction)
    etags.require(if_match, tag, otherwise=kinds.RECONSTRUCTION_CHANGED)
    settings = ReconstructionSettings(**wanted.model_dump(exclude={"reconstruction_id"}))
    now = service.reconstruct_with(settings)
    response.headers["ETag"] = _tag(now)
    return ReconstructionDocument(**now.to_document())


def _tag(reconstruction: SettingsVersion) -> str:
    return etags.etag(reconstruction.to_document())
