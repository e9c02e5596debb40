"""Recordings as Zarr stores: xarray and Dask read of one what they index, and download no more."""

from functools import partial
from typing import Annotated, Any, Final

from fastapi import APIRouter, Header, Path
from fastapi.responses import Response

from transientcam_server.api import _downloads as downloads, _etags as etags
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._problems import documented
from transientcam_server.api._routes.recordings import RecordingName
from transientcam_server.errors import DamagedFrame, Problem, kinds
from transientcam_server.recording import Find, ZarrKeys, is_of_chunk, open_found
from transientcam_server.service import Service

router = APIRouter(prefix="/recordings/{recording}/zarr", tags=["recordings"])

_JSON: Final = "application/json"
_BYTES: Final = "application/octet-stream"
IfRange = Annotated[
    str | None, Header(description="the `ETag` of what a range is of; all is sent of another")
]
ArrayName = Annotated[
    str, Path(description="name of an array", max_length=64, examples=["raw", "frame"])
]


_DOCUMENT: Final[dict[str, Any]] = {
    "schema": {"type": "object"},
    "examples": {"group": {"summary": ".zgroup", "value": {"zarr_format": 2}}},
}
_PROBLEMS: Final = documented(
    kinds.NOT_FOUND,
    kinds.STORE_GONE,
    kinds.DISK_STALLED,
    kinds.UNKNOWN_RECORDING,
    kinds.RECORDING_UNFINISHED,
    kinds.RECORDING_DAMAGED,
)


def _found(**content: dict[str, Any]) -> dict[int | str, dict[str, Any]]:
    """Return what the OpenAPI document says of what stands at a key."""
    described = {"description": "what stands at the key", "content": content}
    return {200: described | etags.READING[200], 304: etags.READING[304]}


@router.get(
    "/{document}",
    summary="What a recording holds, for Zarr",
    response_class=Response,
    responses=_found(**{_JSON: _DOCUMENT}) | _PROBLEMS,
)
async def read_document(
    service: ServiceOf,
    recording: RecordingName,
    document: Annotated[
        str,
        Path(
            description="`.zmetadata`, which has all others, `.zgroup` or `.zattrs`",
            max_length=64,
            examples=[".zmetadata"],
        ),
    ],
    if_none_match: etags.IfNoneMatch = None,
) -> Response:
    """Return the metadata of the Zarr store (version 2) that the recording is.

    `xarray.open_zarr(".../recordings/{id}/zarr")` opens it. While it is recorded it grows: open it
    again to see more frames.
    """
    return await _answer(service, recording, document, if_none_match)


@router.get(
    "/{array}/{part}",
    summary="An array of a recording, for Zarr",
    response_class=Response,
    responses=_found(**{_JSON: _DOCUMENT, _BYTES: {}})
    | {206: {"description": "the requested bytes of a chunk", "content": {_BYTES: {}}}}
    | _PROBLEMS
    | documented(kinds.RANGE_NOT_SATISFIABLE),
)
async def read_part(
    service: ServiceOf,
    recording: RecordingName,
    array: ArrayName,
    part: Annotated[
        str,
        Path(
            description="`.zarray`, `.zattrs`, or the numbers of a chunk",
            max_length=64,
            examples=[".zarray", "3.0.0.0"],
        ),
    ],
    wanted: downloads.Range = None,
    if_range: IfRange = None,
    if_none_match: etags.IfNoneMatch = None,
) -> Response:
    """Return the metadata of an array, or one of its chunks.

    Chunks of `raw` are those of the file, byte for byte: shuffled and deflated, a frame each.
    """
    return await _answer(service, recording, f"{array}/{part}", if_none_match, wanted, if_range)


async def _answer(
    service: Service,
    recording: str,
    key: str,
    if_none_match: str | None,
    wanted: str | None = None,
    if_range: str | None = None,
) -> Response:
    find = partial(service.recordings.find, recording)
    data, tag = await service.recordings.disk.run(_read, find, key)
    if etags.names(if_none_match, tag):
        return Response(status_code=304, headers={"ETag": tag})
    if key.rpartition("/")[2].startswith("."):
        return Response(data, media_type=_JSON, headers={"ETag": tag})
    whole = if_range is not None and if_range.strip() != tag
    return downloads.part(data, None if whole else wanted, media_type=_BYTES, tag=tag)


def _read(find: Find, key: str) -> tuple[bytes, str]:
    """Return what stands at a key, and its ETag."""
    try:
        with open_found(find) as recording:
            data = ZarrKeys(recording).value(key)
    except KeyError:
        raise _missing(f"The recording has no key {key!r}.", key) from None
    except DamagedFrame as error:
        detail = f"Frame {error.frame + 1} cannot be read: {error.reason}."
        raise Problem(kinds.RECORDING_DAMAGED, detail, field="key", value=key) from error
    except Problem as error:
        if error.kind is kinds.UNKNOWN_RECORDING and is_of_chunk(key):
            raise _missing(error.detail, key) from error
        raise
    return data, etags.of_bytes(data)


def _missing(detail: str, key: str) -> Problem:
    """Return the problem of a key at which nothing stands.

    Readers ask for some documents by trial, and for no chunk but those that the metadata name.
    """
    kind = kinds.STORE_GONE if is_of_chunk(key) else kinds.NOT_FOUND
    return Problem(kind, detail, field="key", value=key)
