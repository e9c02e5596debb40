"""The preview as MJPEG: coloured pictures of a product, until the client disconnects."""

from collections.abc import AsyncGenerator
from typing import Annotated, Any, Final

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from transientcam_server.api._dependencies import ServiceOf
from transientcam_server.api._middleware.requests import asks_for_head
from transientcam_server.api._problems import documented
from transientcam_server.broadcast import Channel
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import COLOUR_JPEG, Frame
from transientcam_server.service import Service

router = APIRouter(tags=["frames"])

_BOUNDARY: Final = "frame"
MEDIA_TYPE: Final = "multipart/x-mixed-replace"
_MEDIA_TYPE_WITH_BOUNDARY: Final = f"{MEDIA_TYPE}; boundary={_BOUNDARY}"
_WAIT_S: Final = 10.0
MAX_FRAMES: Final = 2**31
_RESPONSES: Final[dict[int | str, dict[str, Any]]] = {
    200: {
        "description": "JPEG pictures without an end",
        "content": {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}},
    }
}


@router.get(
    "/preview.mjpeg",
    summary="A product as MJPEG",
    response_class=StreamingResponse,
    responses=_RESPONSES
    | documented(kinds.UNKNOWN_PRODUCT, kinds.NOT_ACCEPTABLE, kinds.TOO_MANY_CLIENTS),
    openapi_extra={"x-endless": True},
)
async def read_preview(
    request: Request,
    service: ServiceOf,
    product: Annotated[
        str, Query(max_length=64, description="name of an image, as `range`", examples=["range"])
    ] = "range",
    max_rate_hz: Annotated[
        float | None,
        Query(gt=0, allow_inf_nan=False, description="no more pictures a second than this"),
    ] = None,
    frames: Annotated[
        int | None,
        Query(
            ge=1,
            le=MAX_FRAMES,
            description="end after so many; without it when the client disconnects",
        ),
    ] = None,
) -> Response:
    """Show an image in colours as motion JPEG, for browsers and players; it holds no values.

    A slow client receives fewer pictures, always the newest, and delays no other. It ends when the
    client goes or the service does.
    """
    wanted = service.pipeline.product(product)
    if wanted.over_time or not COLOUR_JPEG.fits(wanted):
        raise Problem(
            kinds.NOT_ACCEPTABLE,
            f"{product} is no image.",
            field="product",
            value=product,
            supported=sorted(
                name
                for name, each in service.pipeline.products.items()
                if COLOUR_JPEG.fits(each) and not each.over_time
            ),
        )
    limit = service.settings.stream.max_clients
    if service.hub.clients + service.mjpeg_clients >= limit:
        raise Problem(kinds.TOO_MANY_CLIENTS, f"{limit} clients are connected.", limit=limit)
    headers = {"Cache-Control": "no-store"}
    if asks_for_head(request.scope):
        return Response(media_type=_MEDIA_TYPE_WITH_BOUNDARY, headers=headers)
    pictures = _pictures(service, Channel(0, wanted, max_rate_hz), frames)
    return _Mjpeg(service, pictures, media_type=_MEDIA_TYPE_WITH_BOUNDARY, headers=headers)


class _Mjpeg(StreamingResponse):
    """Pictures for one client, which counts among those of the stream while it is connected."""

    def __init__(self, service: Service, pictures: AsyncGenerator[bytes], **options: Any) -> None:
        super().__init__(pictures, **options)
        self._service = service
        self._pictures = pictures

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._service.mjpeg_clients += 1
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._service.mjpeg_clients -= 1
            await self._pictures.aclose()


async def _pictures(
    service: Service, channel: Channel, frames: int | None
) -> AsyncGenerator[bytes]:
    """Yield the parts of the response; nothing is made ahead of the client."""
    yield f"--{_BOUNDARY}\r\n".encode()
    number = shown = 0
    while shown != frames:
        frame = await _after(service, number)
        if frame is None:
            return
        number = frame.number
        if not channel.take(frame.raw.device_time_s):
            continue
        try:
            picture = await frame.encoded(channel.product, COLOUR_JPEG)
        except Problem:  # it is logged; the next frame may succeed
            continue
        shown += 1
        yield _part(number, picture)


def _part(number: int, picture: bytes) -> bytes:
    head = (
        "Content-Type: image/jpeg",
        f"Content-Length: {len(picture)}",
        f"Transientcam-Frame: {number}",
    )
    # the next boundary at once, or browsers show a picture only when the next one begins
    return "\r\n".join((*head, "", "")).encode() + picture + f"\r\n--{_BOUNDARY}\r\n".encode()


async def _after(service: Service, number: int) -> Frame | None:
    """Return the next frame, however long it takes; None when the service shuts down."""
    while True:
        try:
            return await service.hub.newest(after=number, wait_s=_WAIT_S)
        except Problem as problem:
            if problem.kind is kinds.SHUTTING_DOWN:
                return None
