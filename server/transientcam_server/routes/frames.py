"""Frames: what is known of the latest, its products, and everything about one pixel."""

import json
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import FiniteFloat

from transientcam_server import problem_kinds as kinds
from transientcam_server.encoding import COLOUR_PNG, MSGPACK, NPY, PNG, Encoding, negotiate
from transientcam_server.errors import Problem
from transientcam_server.pipeline import Frame
from transientcam_server.pixel import pixel_json
from transientcam_server.problems import documented
from transientcam_server.products import Product, View
from transientcam_server.routes.models import FrameDocument, PixelDocument
from transientcam_server.service import ServiceOf

router = APIRouter(tags=["frames"])

MAX_BINS: Final = 4096
DEFAULT_BINS: Final = 64
MAX_WAIT_S: Final = 10.0

_Wait = Annotated[
    float,
    Query(
        ge=0.0,
        le=MAX_WAIT_S,
        allow_inf_nan=False,
        description="seconds to wait for such a frame where there is none yet",
    ),
]
_After = Annotated[
    int, Query(ge=0, le=2**53 - 1, description="only a frame with a greater number will do")
]
_Bins = Annotated[
    int | None,
    Query(ge=1, le=MAX_BINS, description="evenly spaced times from 0 to one modulation period"),
]
_Times = Annotated[
    list[FiniteFloat] | None,
    Query(max_length=MAX_BINS, description="times of flight in seconds; may be repeated"),
]


@router.get(
    "/frames/latest",
    summary="The latest frame",
    responses=documented(kinds.INVALID_REQUEST, kinds.NO_FRAME_YET, kinds.SHUTTING_DOWN),
)
async def read_latest(service: ServiceOf, wait_s: _Wait = 0.0, after: _After = 0) -> FrameDocument:
    """Say what is known of the latest frame."""
    frame = await service.hub.newest(after=after, wait_s=wait_s)
    return FrameDocument.model_validate(frame.meta())


@router.get(
    "/frames/latest/pixel",
    summary="Everything about one pixel",
    response_model=PixelDocument,
    responses=documented(
        kinds.INVALID_REQUEST, kinds.PRODUCT_FAILED, kinds.NO_FRAME_YET, kinds.SHUTTING_DOWN
    ),
)
async def read_pixel(
    service: ServiceOf,
    x: Annotated[int, Query(ge=0, description="column", examples=[80])],
    y: Annotated[int, Query(ge=0, description="row", examples=[60])],
    bins: Annotated[int, Query(ge=1, le=MAX_BINS, description="times of flight")] = 256,
    wait_s: _Wait = 0.0,
    after: _After = 0,
) -> Response:
    """Return range, returns, moments and the whole estimated impulse response of one pixel."""
    frame = await service.hub.newest(after=after, wait_s=wait_s)
    for field, value, length in (("x", x, frame.shape[1]), ("y", y, frame.shape[0])):
        if value >= length:
            limit = f"from 0 to {length - 1}"
            raise _invalid(field, value, limit)
    truth = await frame.stage("truth") if service.camera.simulation is not None else None
    body = await frame.with_moments(pixel_json, truth, x, y, bins)
    return Response(body, media_type="application/json", headers={"Cache-Control": "no-store"})


_HEADERS = {
    "Transientcam-Frame": {
        "description": "number of the frame (not with msgpack, which says so inside)",
        "schema": {"type": "integer"},
    },
    "Transientcam-Unit": {"description": "of one step", "schema": {"type": "string"}},
    "Transientcam-Meta": {
        "description": "what is known of the frame, as compact JSON",
        "schema": {"type": "string"},
    },
}
_BINARY: dict[str, Any] = {"schema": {"type": "string", "format": "binary"}}


_PRODUCT: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The product, in the format that suffix or Accept header name",
        "content": {each.media_type: _BINARY for each in (MSGPACK, NPY, PNG)},
        "headers": _HEADERS,
    }
}


@router.get(
    "/frames/latest/{product}",
    summary="A product of the latest frame",
    response_class=Response,
    responses=_PRODUCT
    | documented(
        kinds.UNKNOWN_PRODUCT,
        kinds.NOT_ACCEPTABLE,
        kinds.INVALID_REQUEST,
        kinds.ANSWER_TOO_LARGE,
        kinds.PRODUCT_FAILED,
        kinds.NO_FRAME_YET,
        kinds.SHUTTING_DOWN,
    ),
)
async def read_product(
    request: Request,
    service: ServiceOf,
    product: Annotated[
        str,
        Path(
            description="name of the product, with `.msgpack`, `.npy` or `.png` or without",
            examples=["range", "range.npy", "transient.msgpack"],
        ),
    ],
    time_s: _Times = None,
    bins: _Bins = None,
    view: Annotated[
        Literal["colour"] | None,
        Query(description="a PNG for eyes: 8 bits, coloured, without values"),
    ] = None,
    wait_s: _Wait = 0.0,
    after: _After = 0,
) -> Response:
    """Return a product of the latest frame as msgpack, npy or PNG.

    `transient` and `cumulative` are evaluated at `time_s`, or at `bins` times (64 without either).
    A 16-bit PNG holds range in mm and everything else in DN; 0 is no value.
    """
    name, dot, suffix = product.partition(".")
    wanted = service.pipeline.product(name)
    encoding = negotiate(
        wanted, suffix=suffix if dot else None, accept=request.headers.get("accept")
    )
    if view is not None and encoding is PNG:
        encoding = COLOUR_PNG
    if not wanted.over_time and (time_s is not None or bins is not None):
        field = "bins" if bins is not None else "time_s"
        raise _invalid(field, bins or time_s, "left out: this product has no times of flight")
    if time_s is not None and bins is not None:
        raise _invalid("bins", bins, "left out where time_s is given")
    frame = await service.hub.newest(after=after, wait_s=wait_s)
    times_s = _times_s(frame, time_s, bins) if wanted.over_time else ()
    data = await frame.encoded(wanted, encoding, View(times_s))
    return Response(data, media_type=encoding.media_type, headers=_headers(frame, wanted, encoding))


def _times_s(frame: Frame, time_s: list[float] | None, bins: int | None) -> tuple[float, ...]:
    if time_s is not None:
        return tuple(time_s)
    count = bins or DEFAULT_BINS
    period_s = 1.0 / frame.recipe.base_frequency_hz
    return tuple(period_s * index / count for index in range(count))


def _headers(frame: Frame, product: Product, encoding: Encoding) -> dict[str, str]:
    headers = {"Cache-Control": "no-store", "Vary": "Accept"}
    if encoding is MSGPACK:
        return headers
    unit = product.png_unit if encoding is PNG else product.description.unit
    return headers | {
        "Transientcam-Frame": str(frame.number),
        "Transientcam-Unit": unit,
        "Transientcam-Meta": json.dumps(frame.meta(), separators=(",", ":")),
    }


def _invalid(field: str, value: object, limit: str) -> Problem:
    return Problem(
        kinds.INVALID_REQUEST,
        f"{field} must be {limit}.",
        field=field,
        value=value,
        limit=limit,
    )
