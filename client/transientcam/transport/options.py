"""What the synchronous and the asynchronous client tell httpx and websockets, said once."""

from collections.abc import Callable
from importlib.metadata import version
from typing import Any, Final

import httpx
from websockets.typing import Subprotocol

from transientcam.requests.request import Answer, Request
from transientcam.transport.errors import media_type
from transientcam.transport.tls import shared_context
from transientcam.wire import MAX_SERVER_MESSAGE_BYTES, SUBPROTOCOL

USER_AGENT: Final = f"transientcam/{version('transientcam')}"
_CLOSE_WITHIN_S = 1.0
_QUEUED_MESSAGES = 256


def http_options(*, token: str | None, timeout_s: float) -> dict[str, Any]:
    """Return what an httpx client is made with."""
    headers = {"user-agent": USER_AGENT}
    if token is not None:
        headers["authorization"] = f"Bearer {token}"
    return {"headers": headers, "timeout": timeout_s}


def request_options(request: Request[Any], *, timeout_s: float) -> dict[str, Any]:
    """Return what an httpx client sends for a request."""
    return {
        "params": list(request.params),
        "content": request.body,
        "headers": request.headers,
        "timeout": timeout_s + request.patience_s,
    }


def answer(response: httpx.Response) -> Answer:
    """Return the answer in a response that was read to its end."""
    return Answer(
        response.status_code,
        media_type(response.headers.get("content-type", "")),
        response.content,
        response.reason_phrase,
    )


Progress = Callable[[int, int | None], object]
"""Takes the bytes that came, and how many there are; None where that is not known."""


class Told:
    """How far a download has come, told to whoever wants to know."""

    def __init__(self, response: httpx.Response, progress: Progress | None) -> None:
        length = response.headers.get("content-length", "")
        # what was packed for the way has another length here
        plain = length.isdecimal() and "content-encoding" not in response.headers
        self._total = int(length) if plain else None
        self._progress = progress
        self._done = 0

    def wrote(self, count: int) -> None:
        """Tell of some more bytes."""
        self._done += count
        if self._progress is not None:
            self._progress(self._done, self._total)


def stream_options(*, timeout_s: float) -> dict[str, Any]:
    """Return what a websockets client is made with."""
    return {
        "subprotocols": [Subprotocol(SUBPROTOCOL)],
        "user_agent_header": USER_AGENT,
        "open_timeout": timeout_s,
        "close_timeout": _CLOSE_WITHIN_S,
        "max_size": MAX_SERVER_MESSAGE_BYTES,  # the default of 1 MiB is less than many a frame
        # Deflating a frame takes longer than sending it, and floats hardly shrink.
        "compression": None,
        # Credits bound the frames on their way, so this bounds only notices. A full queue stops
        # the reading of pongs, and the connection of a reader that thinks for long would be cut.
        "max_queue": _QUEUED_MESSAGES,
    }


def threaded_stream_options(url: str, *, timeout_s: float) -> dict[str, Any]:
    """Return the same for a client that reads on a thread of its own."""
    options = stream_options(timeout_s=timeout_s)
    return options | {"ssl": shared_context()} if url.startswith("wss:") else options
