"""Files that clients send as the body of a request."""

from collections.abc import AsyncIterator
from typing import Any, Final

from fastapi import Request
from starlette.requests import ClientDisconnect

from transientcam_server.errors import Problem, kinds

_PIECE_BYTES: Final = 1024**2


def body_of(media_type: str, begin: str) -> dict[str, Any]:
    """Return what OpenAPI says of such a body; ``begin`` is how one begins."""
    example = {"file": {"summary": "How a file begins", "value": begin}}
    schema = {"type": "string", "format": "binary"}
    content = {media_type: {"schema": schema, "examples": example}}
    return {"requestBody": {"required": True, "content": content}}


async def received(request: Request, *, limit: int) -> AsyncIterator[bytes]:
    """Yield the body in pieces of about 1 MiB.

    Raises Problem ``too-large`` for one of more than ``limit`` bytes, ``bad-request`` where the
    client goes away.
    """
    count, waiting = 0, bytearray()
    try:
        async for piece in request.stream():
            count += len(piece)
            if count > limit:
                detail = f"The body is longer than {limit} bytes."
                raise Problem(kinds.TOO_LARGE, detail, field="body", limit=limit)
            waiting += piece
            if len(waiting) >= _PIECE_BYTES:
                yield bytes(waiting)
                waiting.clear()
    except ClientDisconnect as error:
        raise Problem(kinds.BAD_REQUEST, "The body ended early.") from error
    yield bytes(waiting)
