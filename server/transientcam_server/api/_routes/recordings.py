"""Recordings: start one, stop it, look through them, take them home."""

import asyncio
from typing import Annotated, Final

from fastapi import APIRouter, Path, Query, Request, status
from fastapi.responses import FileResponse

from transientcam_server.api import _downloads as downloads
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.permissions import needs
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.recording import (
    RecordingChange,
    RecordingDocument,
    RecordingLimitsDocument,
    RecordingRequest,
    RecordingsDocument,
    document,
)
from transientcam_server.api._planned import for_request
from transientcam_server.api._problems import documented
from transientcam_server.api._uploads import body_of, received
from transientcam_server.errors import kinds
from transientcam_server.planning import Progress
from transientcam_server.recording import Limits, Order, RecordingOptions, select

router = APIRouter(tags=["recordings"])

IMPORT: Final = "/recordings/import"
HDF5: Final = "application/x-hdf5"
_OF_ONE: Final = (kinds.UNKNOWN_RECORDING, kinds.DISK_STALLED)
_CHANGED: Final = (*_OF_ONE, kinds.RECORDING_UNFINISHED, kinds.RECORDING_NOT_STORED)
RecordingName = Annotated[
    str,
    Path(
        description="its id, as the list has it",
        max_length=200,
        examples=["20261120T081500Z-3f9c2a"],
    ),
]


@router.get(
    "/recordings", summary="Recordings, a page at a time", responses=documented(kinds.DISK_STALLED)
)
async def read_recordings(
    service: ServiceOf,
    search: Annotated[
        str, Query(max_length=200, description="words of id, name, camera or annotations")
    ] = "",
    tag: Annotated[str | None, Query(max_length=200, description="one of the `tags`")] = None,
    sort: Annotated[Order, Query(description="by this field; with `-` downwards")] = "-started_s",
    offset: Annotated[int, Query(ge=0, le=2**31, description="how many are left out before")] = 0,
    limit: Annotated[int, Query(ge=1, le=1000, description="how many there are on a page")] = 100,
) -> RecordingsDocument:
    """List recordings, by default the newest 100, and sum up all that match."""
    library = service.recordings
    described = await library.disk.run(library.describe_all)
    found = select(described, search=search, tag=tag, order=sort, offset=offset, limit=limit)
    return RecordingsDocument(
        directory=str(library.directory),
        free_bytes=await library.disk.run(library.free_bytes),
        active=library.active_id,
        limits=RecordingLimitsDocument.model_validate(service.settings.recordings),
        recordings=[document(each) for each in found.pop("recordings")],
        **found,
    )


@router.post(
    "/recordings",
    status_code=status.HTTP_201_CREATED,
    summary="Start a recording",
    responses=documented(
        kinds.RECORDING_RUNS,
        kinds.CAMERA_BUSY,
        kinds.ONLY_MOMENTS,
        kinds.RECORDING_NOT_STORED,
        kinds.DISK_STALLED,
        kinds.FRAME_GONE,
        kinds.UNKNOWN_FRAME,
    ),
)
@needs(Role.OPERATOR, lease=False)  # it does not disturb the client that controls the camera
async def start_recording(service: ServiceOf, wanted: RecordingRequest) -> RecordingDocument:
    """Record every frame from now on, raw, until it is stopped or a limit is reached.

    With `history_s` it begins with the frames of the last seconds, as far as they are kept and of
    the same sequence; with `frame` it is one of these alone. One recording runs at a time. A change
    of the sequence ends it.
    """
    service.acquisition.require_free()  # what a calibration captures is not recorded
    count = wanted.frames if wanted.frame is None else 1
    limits = Limits(duration_s=wanted.duration_s, size_bytes=wanted.max_bytes, frames=count)
    order = RecordingOptions(name=wanted.name, limits=limits, annotations=wanted.annotations)
    return document(await service.record(order, history_s=wanted.history_s, frame=wanted.frame))


@router.post(
    IMPORT,
    status_code=status.HTTP_201_CREATED,
    summary="Take a recording in",
    openapi_extra=body_of(HDF5, "\x89HDF\r\n\x1a\n"),
    responses=documented(
        kinds.TOO_LARGE, kinds.INVALID_RECORDING, kinds.RECORDING_NOT_STORED, kinds.DISK_STALLED
    ),
)
@needs(Role.OPERATOR, lease=False)
async def import_recording(service: ServiceOf, request: Request) -> RecordingDocument:
    """Keep the recording that is sent as body, under its id, or a new one where that is taken.

    One that is here already stays as it is. A process of its own reads it and writes it anew, with
    all its frames as they were captured. A client that leaves before the answer ends it, and
    nothing is kept.
    """
    library = service.recordings
    length = request.headers.get("content-length", "")
    upload = await library.disk.run(library.receive, int(length) if length.isdecimal() else 0)

    async def take_in(progress: Progress) -> RecordingDocument:
        async with service.taking_in:
            # not on a thread of the disk, which would be stalled
            return document(await asyncio.to_thread(library.take_in, upload, progress))

    try:
        async for piece in received(request, limit=service.settings.recordings.max_upload_bytes):
            await library.disk.run(upload.write, piece)
        return await for_request(request, take_in)
    finally:
        closed = asyncio.wrap_future(library.disk.submit(upload.close))
        await asyncio.wait((closed,), timeout=service.settings.recordings.stalled_s)


@router.get("/recordings/{recording}", summary="A recording", responses=documented(*_OF_ONE))
async def read_recording(service: ServiceOf, recording: RecordingName) -> RecordingDocument:
    """Describe a recording."""
    return document(await service.recordings.disk.run(service.recordings.describe, recording))


@router.patch(
    "/recordings/{recording}", summary="Annotate a recording", responses=documented(*_CHANGED)
)
@needs(Role.OPERATOR, lease=False)
async def annotate_recording(
    service: ServiceOf, recording: RecordingName, change: RecordingChange
) -> RecordingDocument:
    """Replace what is written about a recording, also while it runs."""
    annotate = service.recordings.annotate
    return document(await service.recordings.disk.run(annotate, recording, change.annotations))


@router.post(
    "/recordings/{recording}/stop", summary="Stop a recording", responses=documented(*_OF_ONE)
)
@needs(Role.OPERATOR, lease=False)
async def stop_recording(service: ServiceOf, recording: RecordingName) -> RecordingDocument:
    """End a recording and wait until it is on the disk; one that has ended stays as it is."""
    return document(await service.recordings.disk.run(service.recordings.stop, recording))


@router.delete(
    "/recordings/{recording}", summary="Delete a recording", responses=documented(*_CHANGED)
)
@needs(Role.ADMIN, lease=False)
async def delete_recording(service: ServiceOf, recording: RecordingName) -> RecordingDocument:
    """Delete a recording for good; the answer says what it was."""
    return document(await service.recordings.disk.run(service.recordings.delete, recording))


@router.get(
    "/recordings/{recording}/file",
    summary="The file of a recording",
    response_class=FileResponse,
    responses=downloads.documented_file(HDF5)
    | documented(*_OF_ONE, kinds.RECORDING_UNFINISHED, kinds.RANGE_NOT_SATISFIABLE),
)
async def read_recording_file(
    service: ServiceOf, recording: RecordingName, wanted: downloads.Range = None
) -> FileResponse:
    """Download a recording as HDF5; h5py, xarray and MATLAB open it."""
    path = await service.recordings.disk.run(service.recordings.path, recording)
    name = await service.recordings.disk.run(service.recordings.download_name, recording)
    return await downloads.answer(
        path,
        wanted,
        disk=service.recordings.disk,
        gone=kinds.UNKNOWN_RECORDING,
        media_type=HDF5,
        filename=name,
    )
