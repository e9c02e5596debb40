"""Products of whole recordings as Zarr stores, as `transientcam reconstruct` wrote them."""

import pathlib
from typing import Annotated, Any, Final

from fastapi import APIRouter, Path
from fastapi.responses import Response

from transientcam_server.api import _downloads as downloads, _etags as etags
from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._documents.recording import ProductStoresDocument
from transientcam_server.api._problems import documented
from transientcam_server.errors import Problem, kinds
from transientcam_server.recording import METADATA, ProductStores, is_of_chunk
from transientcam_server.service import Service

router = APIRouter(prefix="/products", tags=["recordings"])

_JSON: Final = "application/json"
_BYTES: Final = "application/octet-stream"
StoreName = Annotated[
    str, Path(description="its id, as the list has it", max_length=200, examples=["corner"])
]
ArrayName = Annotated[
    str, Path(description="name of an array", max_length=64, examples=["range", "frame"])
]
_DOCUMENT: Final[dict[str, Any]] = {
    "schema": {"type": "object"},
    "examples": {"group": {"summary": METADATA, "value": {"zarr_format": 3, "node_type": "group"}}},
}
_PROBLEMS: Final = documented(
    kinds.NOT_FOUND,
    kinds.STORE_GONE,
    kinds.DISK_STALLED,
    kinds.UNKNOWN_PRODUCT_STORE,
    kinds.PRODUCT_STORE_UNFINISHED,
)


def _found(media_type: str, content: dict[str, Any]) -> dict[int | str, dict[str, Any]]:
    """Return what the OpenAPI document says of what stands at a key."""
    whole = {"description": "what stands at the key", "content": {media_type: content}}
    return {200: whole | etags.READING[200], 304: etags.READING[304]} | _PROBLEMS


@router.get("", summary="All stores of products", responses=documented(kinds.DISK_STALLED))
async def read_product_stores(service: ServiceOf) -> ProductStoresDocument:
    """List the Zarr stores of products that lie beside the recordings.

    `transientcam reconstruct corner.h5 -o corner.zarr` writes one; the service reads them alone.
    """
    directory = service.recordings.directory
    found = await service.recordings.disk.run(ProductStores(directory).all)
    return ProductStoresDocument.model_validate({"directory": str(directory), "stores": found})


@router.get(
    "/{store}/zarr/{document}",
    summary="What a store of products holds, for Zarr",
    response_class=Response,
    responses=_found(_JSON, _DOCUMENT),
)
async def read_product_metadata(
    service: ServiceOf,
    store: StoreName,
    document: Annotated[
        str,
        Path(
            description="`zarr.json`, which has the metadata of all arrays",
            max_length=64,
            examples=[METADATA],
        ),
    ],
    if_none_match: etags.IfNoneMatch = None,
) -> Response:
    """Return the metadata of a Zarr store (version 3).

    `xarray.open_zarr(".../products/{id}/zarr")` opens it.
    """
    return await _answer(service, store, document, None, if_none_match)


@router.get(
    "/{store}/zarr/{array}/{document}",
    summary="An array of products, for Zarr",
    response_class=Response,
    responses=_found(_JSON, _DOCUMENT),
)
async def read_product_array(
    service: ServiceOf,
    store: StoreName,
    array: ArrayName,
    document: Annotated[str, Path(description="`zarr.json`", max_length=64, examples=[METADATA])],
    if_none_match: etags.IfNoneMatch = None,
) -> Response:
    """Return the metadata of an array."""
    return await _answer(service, store, f"{array}/{document}", None, if_none_match)


@router.get(
    "/{store}/zarr/{array}/c/{chunk:path}",
    summary="A chunk of products, for Zarr",
    response_class=Response,
    responses=_found(_BYTES, {})
    | {206: {"description": "the requested bytes of a chunk", "content": {_BYTES: {}}}}
    | documented(kinds.RANGE_NOT_SATISFIABLE),
)
async def read_product_chunk(
    service: ServiceOf,
    store: StoreName,
    array: ArrayName,
    chunk: Annotated[
        str,
        Path(
            description="its numbers, with slashes between them", max_length=128, examples=["3/0/0"]
        ),
    ],
    wanted: downloads.Range = None,
    if_none_match: etags.IfNoneMatch = None,
) -> Response:
    """Return a chunk, byte for byte as it was written.

    One that is not found (404) has the array's fill value in all places, by Zarr's rules. One
    that is not there any more is 410.
    """
    return await _answer(service, store, f"{array}/c/{chunk}", wanted, if_none_match)


async def _answer(
    service: Service, store: str, key: str, wanted: str | None, if_none_match: str | None
) -> Response:
    disk = service.recordings.disk
    path, tag = await disk.run(_find, ProductStores(service.recordings.directory), store, key)
    if etags.names(if_none_match, tag):
        return Response(status_code=304, headers={"ETag": tag})
    media_type = _JSON if key.endswith(METADATA) else _BYTES
    return await downloads.answer(
        path,
        wanted,
        disk=disk,
        gone=kinds.STORE_GONE if is_of_chunk(key) else kinds.NOT_FOUND,
        media_type=media_type,
        tag=tag,
    )


def _find(stores: ProductStores, store_id: str, key: str) -> tuple[pathlib.Path, str]:
    """Return the file that stands at a key, and its ETag."""
    store = stores.find(store_id)
    if store is None:
        shown = store_id[:64]
        raise Problem(
            kinds.STORE_GONE if is_of_chunk(key) else kinds.UNKNOWN_PRODUCT_STORE,
            f"There is no store of products {shown!r}.",
            field="store",
            value=shown,
        )
    if not store.complete:
        raise Problem(
            kinds.PRODUCT_STORE_UNFINISHED, f"{store.id} is not finished.", store=store.id
        )
    try:
        path = store.file(key)
        if path is not None:
            return path, etags.of_file(path)
    except OSError:
        pass  # it was deleted meanwhile
    gone = is_of_chunk(key) and not store.may_be_left_out(key)
    kind = kinds.STORE_GONE if gone else kinds.NOT_FOUND
    raise Problem(kind, f"The store has no key {key!r}.", field="key", value=key)
