"""The sequence: what the camera captures for one transient image."""

import asyncio
from typing import Annotated, Any

from fastapi import APIRouter, Body, Response
from pydantic import WithJsonSchema

from transientcam_driver import AppliedSequence, Sequence
from transientcam_server.api import _etags as etags
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import needs
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.sequence import AppliedDocument, SequenceDocument
from transientcam_server.api._problems import documented
from transientcam_server.errors import SequenceConflict, kinds
from transientcam_server.imaging import require_estimator
from transientcam_server.service import Service

router = APIRouter(tags=["sequence"])


def _schema() -> dict[str, Any]:
    schema = SequenceDocument.model_json_schema()
    # one document by itself: what it refers to stands inside
    definitions = schema.pop("$defs")
    schema["properties"]["sub_phases"] = definitions["SubPhasesDocument"]
    return schema


# The driver checks a sequence against the limits of its camera; the schema is documentation.
_Sequence = Annotated[
    dict[str, Any],
    WithJsonSchema(_schema()),
    Body(
        openapi_examples={
            "video": {
                "summary": "The paper's video setting: 18.6 frames/s",
                "value": {"harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005},
            },
            "still": {
                "summary": "Four harmonics, four takes",
                "value": {"harmonics": 4, "takes": 4, "exposure_s": 0.00192},
            },
        }
    ),
]


@router.get(
    "/sequence",
    summary="The running sequence",
    response_model=AppliedDocument,
    responses=etags.READING,
)
async def read_sequence(
    service: ServiceOf, response: Response, if_none_match: etags.IfNoneMatch = None
) -> Any:
    """Return the sequence as the camera really set it, and what follows from it."""
    tag = _tag(service.applied)
    if etags.names(if_none_match, tag):
        return Response(status_code=304, headers={"ETag": tag})
    response.headers["ETag"] = tag
    return AppliedDocument.model_validate(service.applied.to_document())


@router.put(
    "/sequence",
    summary="Change the sequence",
    responses=documented(
        kinds.INVALID_SEQUENCE,
        kinds.SEQUENCE_CHANGED,
        kinds.ESTIMATOR_MISFIT,
        kinds.CAMERA_BUSY,
        kinds.CAMERA_FAILED,
        kinds.CAMERA_LOST,
    )
    | etags.CHANGING,
)
async def change_sequence(
    service: ServiceOf, response: Response, sequence: _Sequence, if_match: etags.IfMatch = None
) -> AppliedDocument:
    """Set the camera to a sequence, between two frames; what is absent takes its default, or where
    the camera cannot do that what is nearest.

    A document read from here may be changed and sent back: what only the camera can state
    is ignored. Streams are sent a `sequence-changed` notice.
    """
    wanted = service.camera.capabilities.sequence_of(sequence)
    applied = await _configure(service, wanted, if_match)
    response.headers["ETag"] = _tag(applied)
    return AppliedDocument.model_validate(applied.to_document())


@router.post(
    "/sequence/validate", summary="Check a sequence", responses=documented(kinds.INVALID_SEQUENCE)
)
@needs(Role.VIEWER, lease=False)
async def validate_sequence(service: ServiceOf, sequence: _Sequence) -> AppliedDocument:
    """Return what the camera would make of a sequence, without touching it."""
    applied = service.camera.validate(service.camera.capabilities.sequence_of(sequence))
    return AppliedDocument.model_validate(applied.to_document())


async def _configure(service: Service, wanted: Sequence, if_match: str | None) -> AppliedSequence:
    """Change the sequence if If-Match names the one that the camera runs at that moment."""
    service.acquisition.require_free()
    running = service.applied
    while True:
        etags.require(if_match, _tag(running), otherwise=kinds.SEQUENCE_CHANGED)
        settings = service.pipeline.reconstruction.settings
        require_estimator(settings, wanted, field="harmonics")
        expected = None if if_match is None else running.epoch
        try:
            return await asyncio.wrap_future(
                service.acquisition.configure(wanted, expected=expected)
            )
        except SequenceConflict as conflict:
            running = conflict.running


def _tag(applied: AppliedSequence) -> str:
    return etags.etag(applied.to_document())
