"""Queries of a frame and their answers, whether it is the latest, a former or a recorded one."""

import json
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Final, Literal

from fastapi import Depends, Path, Query, Request, Response
from fastapi.responses import StreamingResponse
from pydantic import FiniteFloat

from transientcam import wire
from transientcam_server.api._middleware.answers import expect_bytes
from transientcam_server.api._middleware.requests import asks_for_head
from transientcam_server.errors import Problem, invalid, kinds
from transientcam_server.imaging import (
    COLOUR_PNG,
    DEFAULT_BINS,
    ENCODINGS,
    MSGPACK,
    PNG,
    STREAMED_BYTES,
    TIFF,
    Crop,
    Encoding,
    Frame,
    Product,
    View,
    banded,
    evenly,
    pixel_csv,
    pixel_json,
    product_names,
    size_of,
)

MAX_BINS: Final = 4096
MAX_NUMBER: Final = 2**53 - 1
LATEST: Final = "latest"


def _named(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


FrameName = Annotated[
    str,
    Path(
        description="number of the frame, or `latest`",
        pattern="^(latest|[1-9][0-9]{0,14})$",
        examples=["latest", "1204"],
    ),
]
ProductName = Annotated[
    str,
    Path(
        description=f"one of {_named(product_names())}, without or with one of the suffixes "
        + _named(f".{name}" for name in ENCODINGS),
        examples=["range", "range.npy", "transient.npz", "pointcloud.ply"],
    ),
]
X = Annotated[int, Query(ge=0, description="column", examples=[80])]
Y = Annotated[int, Query(ge=0, description="row", examples=[60])]
PixelBins = Annotated[int, Query(ge=1, le=MAX_BINS, description="times of flight")]


@dataclass(frozen=True, slots=True)
class FrameQuery:
    """What a request states about the product it is for."""

    time_s: list[float] | None
    bins: int | None
    y: int | None
    region: str | None
    decimation: int | None
    view: Literal["colour"] | None
    accept: str | None
    head_alone: bool
    expect_bytes: Callable[[int], None]

    def view_of(self, product: Product, frame: Frame) -> View:
        """Return which part of the frame's product that is.

        Raises Problem ``invalid-request`` for what this product does not have or this frame cannot
        give.
        """
        self._require_meaning(product)
        height, width = frame.shape
        crop = Crop.parse(self.region, self.decimation, height=height, width=width)
        times_s = tuple(self.time_s or ())
        if product.over_time and self.time_s is None:
            times_s = evenly(frame.recipe.base_frequency_hz, self.bins or DEFAULT_BINS)
        y = self._row(crop, height) if product.of_row else None
        return View(times_s, crop, y)

    def _require_meaning(self, product: Product) -> None:
        if not product.over_time and (self.time_s is not None or self.bins is not None):
            field = "bins" if self.bins is not None else "time_s"
            limit = "left out: this product has no times of flight"
            raise invalid(field, self.bins or self.time_s, limit)
        if self.time_s is not None and self.bins is not None:
            raise invalid("bins", self.bins, "left out where time_s is given")
        if self.y is not None and not product.of_row:
            raise invalid("y", self.y, "left out: this product has more than one row")

    def _row(self, crop: Crop, height: int) -> int:
        _, first, _, rows = crop.region or (0, 0, 0, height)
        if self.y is None:
            return first + rows // 2
        if not first <= self.y < first + rows:
            raise invalid("y", self.y, f"from {first} to {first + rows - 1}")
        return self.y


# async, or FastAPI takes a thread for it
async def _frame_query(
    request: Request,
    time_s: Annotated[
        list[FiniteFloat] | None,
        Query(max_length=MAX_BINS, description="times of flight in seconds; may be repeated"),
    ] = None,
    bins: Annotated[
        int | None, Query(ge=1, le=MAX_BINS, description="evenly spaced times from 0 to one period")
    ] = None,
    y: Annotated[
        int | None, Query(ge=0, description="row of a streak; the middle one without it")
    ] = None,
    region: Annotated[
        str | None,
        Query(
            max_length=64,
            description="`x,y,width,height` of the part, in pixels of the frame",
            examples=["40,30,64,48"],
        ),
    ] = None,
    decimation: Annotated[
        int | None, Query(ge=1, description="every so many pixels of it, both ways")
    ] = None,
    view: Annotated[
        Literal["colour"] | None,
        Query(description="a PNG for eyes: 8 bits, coloured, without values"),
    ] = None,
) -> FrameQuery:
    accept = request.headers.get("accept")
    head_alone = asks_for_head(request.scope)
    expect = partial(expect_bytes, request.scope)
    return FrameQuery(time_s, bins, y, region, decimation, view, accept, head_alone, expect)


FrameQueryOf = Annotated[FrameQuery, Depends(_frame_query)]
"""The query for a product of the request."""


def choose(product: Product, suffix: str | None, query: FrameQuery) -> Encoding:
    """Return the format that a request selects for a product. Raises Problem ``not-acceptable``."""
    encoding = negotiate(product, suffix=suffix, accept=query.accept)
    return COLOUR_PNG if query.view is not None and encoding is PNG else encoding


async def product_answer(
    name: str,
    query: FrameQuery,
    *,
    product: Callable[[str], Product],
    frame: Callable[[], Awaitable[Frame]],
) -> Response:
    """Answer with a product; the frame is looked up once the request is known to be valid."""
    stem, dot, suffix = name.partition(".")
    chosen = product(stem)
    encoding = choose(chosen, suffix if dot else None, query)
    found = await frame()
    view = query.view_of(chosen, found)
    height, width = found.shape
    applied = found.recipe.applied
    planned = banded(chosen, encoding, view, applied=applied, height=height, width=width)
    if planned is None:
        size_bytes = size_of(chosen, view, applied=applied, height=height, width=width)
        if size_bytes > STREAMED_BYTES:  # the array, and the file that it is written to
            query.expect_bytes(2 * size_bytes)
        data = await found.encoded(chosen, encoding, view)
        headers = _headers(chosen, encoding, view, found)
        return Response(data, media_type=encoding.media_type, headers=headers)
    bands = await found.bands(planned)
    head = await anext(bands)
    headers = _headers(chosen, encoding, view, found)
    headers["Content-Length"] = str(len(head) + planned.data_bytes)
    whole = _one_after_another(head, None if query.head_alone else bands)
    return StreamingResponse(whole, media_type=encoding.media_type, headers=headers)


def _headers(product: Product, encoding: Encoding, view: View, frame: Frame) -> dict[str, str]:
    """Return the headers of a product that has been computed, with what is known of its frame."""
    headers = {"Cache-Control": "no-store", "Vary": "Accept"}
    if encoding is not MSGPACK:  # which holds it
        meta, steps = view.crop.with_meta(frame.meta()), product.png_steps
        unit = steps.unit if steps is not None and encoding is PNG else product.description.unit
        headers |= {
            "Transientcam-Frame": str(frame.number),
            "Transientcam-Unit": unit,
            "Transientcam-Meta": json.dumps(meta, separators=(",", ":")),
        }
    return headers


async def _one_after_another(
    head: bytes, rest: AsyncIterator[bytes] | None
) -> AsyncIterator[bytes]:
    if rest is None:
        yield head
        return
    async for each in rest:
        yield head + each  # together, so that the first part is as large as the others
        head = b""


async def pixel_answer(
    frame: Frame, x: int, y: int, bins: int, *, simulated: bool = False, as_csv: bool = False
) -> Response:
    """Answer with everything about one pixel, or with its values over time of flight as CSV."""
    for field, value, length in (("x", x, frame.shape[1]), ("y", y, frame.shape[0])):
        if value >= length:
            raise invalid(field, value, f"from 0 to {length - 1}")
    truth = await frame.truth() if simulated and not as_csv else None
    body = await frame.with_moments(pixel_csv if as_csv else pixel_json, truth, x, y, bins)
    media_type = "text/csv" if as_csv else "application/json"
    return Response(body, media_type=media_type, headers={"Cache-Control": "no-store"})


_BINARY: Final[dict[str, Any]] = {"schema": {"type": "string", "format": "binary"}}
_HEADERS: Final = {
    "Transientcam-Frame": {
        "description": "number of the frame (not with msgpack, which holds it)",
        "schema": {"type": "integer"},
    },
    "Transientcam-Unit": {"description": "of one step", "schema": {"type": "string"}},
    "Transientcam-Meta": {
        "description": "what is known of the frame, as compact JSON",
        "schema": {"type": "string"},
    },
}
PRODUCT_RESPONSES: Final[dict[int | str, dict[str, Any]]] = {
    200: {
        "description": "The product, in the format that suffix or Accept header name",
        "content": {each.media_type: _BINARY for each in ENCODINGS.values()},
        "headers": _HEADERS,
    }
}
"""How a product is documented to be answered."""
CSV_RESPONSES: Final[dict[int | str, dict[str, Any]]] = {
    200: {
        "description": "A line for each time of flight, under a line with names",
        "content": {"text/csv": {"schema": {"type": "string"}}},
    }
}
"""How a pixel is documented to be answered as CSV."""
PRODUCT_PROBLEMS: Final = (
    kinds.UNKNOWN_PRODUCT,
    kinds.NOT_ACCEPTABLE,
    kinds.ANSWER_TOO_LARGE,
    kinds.PRODUCT_FAILED,
    kinds.TOO_MANY_ANSWERS,
)
"""What can be wrong with a request for a product, whatever its frame."""


_BY_MEDIA_TYPE = {encoding.media_type: encoding for encoding in ENCODINGS.values()} | dict.fromkeys(
    wire.MEDIA_TYPE_ALIASES, MSGPACK
)


def negotiate(product: Product, *, suffix: str | None, accept: str | None) -> Encoding:
    """Return the encoding that a suffix names, else the one an Accept header prefers.

    Raises Problem ``not-acceptable``, with the list of those the product has.
    """
    supported = [encoding for encoding in ENCODINGS.values() if encoding.fits(product)]
    if suffix is not None:
        for encoding in supported:
            if encoding.name == suffix:
                return encoding
        raise _not_acceptable(product, supported, field="suffix", value=suffix)
    for media_type in _preferences(accept or "*/*"):
        preferred = _matching(media_type, supported)
        if preferred is not None:
            return preferred
    raise _not_acceptable(product, supported, field="Accept", value=accept)


def _matching(media_type: str, supported: list[Encoding]) -> Encoding | None:
    if media_type in ("*/*", "application/*"):
        return MSGPACK
    if media_type == "image/*":
        return next((each for each in (PNG, TIFF) if each in supported), None)
    encoding = _BY_MEDIA_TYPE.get(media_type)
    return encoding if encoding in supported else None


def _preferences(accept: str) -> list[str]:
    """Return the media types of an Accept header, best first (RFC 9110, Sec. 12.5.1)."""
    weighted = []
    for item in accept.lower().split(","):
        media_type, *parameters = (part.strip() for part in item.split(";"))
        quality = 1.0
        for parameter in parameters:
            if parameter.startswith("q="):
                try:
                    quality = float(parameter[2:])
                except ValueError:
                    quality = 0.0
        if media_type and quality > 0.0:
            weighted.append((quality, media_type))
    return [media_type for _, media_type in sorted(weighted, key=lambda each: -each[0])]


def _not_acceptable(
    product: Product, supported: list[Encoding], *, field: str, value: object
) -> Problem:
    names = [encoding.name for encoding in supported]
    return Problem(
        kinds.NOT_ACCEPTABLE,
        f"{product.name} is not available in this format, but as {', '.join(names)}.",
        field=field,
        value=value,
        supported=names,
        media_types=[encoding.media_type for encoding in supported],
    )
