"""The one place where errors of the network libraries become errors of this package.

Those of msgpack become `ProtocolError` where msgpack is used, in `wire.codec`.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import httpx
from websockets import exceptions as ws

from transientcam.errors import (
    ParameterError,
    ProtocolError,
    ServerUnreachable,
    StreamClosed,
    TransientcamError,
)
from transientcam.requests import Answer, problem
from transientcam.transport._address import without_secrets
from transientcam.wire import CloseCode

FOREIGN = (
    httpx.HTTPError,
    httpx.InvalidURL,
    httpx.CookieConflict,
    httpx.StreamError,
    ws.WebSocketException,
    OSError,
    ImportError,
    UnicodeError,
)
"""Roots of everything that httpx, websockets and the operating system raise; the last two of a
proxy that needs another package, and of half a character in an address."""


@contextmanager
def translated(url: str) -> Iterator[None]:
    """Turn any foreign error in the block into one of ours, the foreign one as its cause."""
    try:
        yield
    except FOREIGN as error:
        raise translate(error, url) from error


def translate(error: Exception, url: str) -> TransientcamError:
    """Return our error for a foreign one; the most specific match wins."""
    url = without_secrets(url)
    match error:
        case ws.ConnectionClosed():
            close = error.rcvd or error.sent  # the latter if this end found the fault
            if close is None:
                return StreamClosed(CloseCode.ABNORMAL, "the connection broke")
            return StreamClosed(close.code, close.reason)
        case ws.InvalidStatus():
            response = error.response
            return problem(
                Answer(
                    response.status_code,
                    media_type(response.headers.get("content-type", "")),
                    bytes(response.body or b""),
                    response.reason_phrase,
                )
            )
        case ws.PayloadTooBig():
            return StreamClosed(CloseCode.TOO_BIG, str(error))
        case httpx.InvalidURL() | httpx.UnsupportedProtocol() | ws.InvalidURI() | UnicodeError():
            return ParameterError("url", url, f"an address of a camera ({type(error).__name__})")
        case httpx.RemoteProtocolError() | ws.InvalidMessage():
            return ServerUnreachable(url, f"what answers there does not speak HTTP ({error})")
        case httpx.TimeoutException() | TimeoutError():
            return ServerUnreachable(url, "no answer in time")
        case ws.InvalidProxy():  # its sentence has the proxy's address, maybe with a password
            return ServerUnreachable(url, f"the proxy failed ({error.msg})")
        case ws.ProxyError() | ImportError():
            return ServerUnreachable(url, f"the proxy failed ({error})")
        case httpx.TransportError() | OSError():
            return ServerUnreachable(url, _reason(error))
        case _:
            return ProtocolError("answer", f"{type(error).__name__}: {error}", "as documented")


def _reason(error: BaseException) -> str:
    """Return the first message of the operating system, without its error number."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.strerror:
            return cause.strerror
        cause = cause.__cause__ or cause.__context__
    return str(error) or type(error).__name__


def media_type(header: str) -> str:
    """Return the media type of a Content-Type header, without its parameters."""
    return header.partition(";")[0].strip().lower()
