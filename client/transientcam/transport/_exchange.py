"""One request and its whole answer: bounded in bytes and in time, whatever the server sends.

httpx bounds each read alone, so that a byte a second would take as long as it likes. A task of
asyncio is cancelled at its end; a thread that waits in a socket is not, and so the streams of a
synchronous client ask how much is left of the request that they are read for.
"""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Final

import httpcore
import httpx

from transientcam.errors import ProtocolError
from transientcam.requests import Answer, Request
from transientcam.transport._deadline import Deadline
from transientcam.transport._errors import media_type
from transientcam.transport._options import request_options

_DEADLINE: Final[ContextVar[Deadline | None]] = ContextVar("deadline", default=None)


def bounded(client: httpx.Client) -> httpx.Client:
    """Return a client whose connections keep to the deadline of the request they are used for."""
    # the pools of httpx take a backend of their own, but only where they are made
    for transport in (client._transport, *client._mounts.values()):  # noqa: SLF001
        pool = getattr(transport, "_pool", None)
        if pool is not None:  # none in a transport of a test
            pool._network_backend = _Backend(pool._network_backend)  # noqa: SLF001
    return client


@contextmanager
def within(timeout_s: float) -> Iterator[Deadline]:
    """Give all that clients made `bounded` do in this block so much time together."""
    deadline = Deadline(timeout_s)
    token = _DEADLINE.set(deadline)
    try:
        yield deadline
    finally:
        _DEADLINE.reset(token)


def exchange(client: httpx.Client, url: str, request: Request[Any], *, timeout_s: float) -> Answer:
    """Return the answer to a request.

    Raises httpx.HTTPError if there is none, or none in time; ProtocolError if it is longer than
    such an answer may be, or encoded, which was not requested.
    """
    options = request_options(request, timeout_s=timeout_s)
    with within(options["timeout"]), client.stream(request.method, url, **options) as response:
        return read(response, most_bytes=request.most_bytes)


async def exchange_async(
    client: httpx.AsyncClient, url: str, request: Request[Any], *, timeout_s: float
) -> Answer:
    """Return the answer to a request; raises what `exchange` raises, or `TimeoutError`."""
    options = request_options(request, timeout_s=timeout_s)
    async with (
        asyncio.timeout(options["timeout"]),
        client.stream(request.method, url, **options) as response,
    ):
        return await read_async(response, most_bytes=request.most_bytes)


def read(response: httpx.Response, *, most_bytes: int) -> Answer:
    """Return an answer that was not read yet; raises what `exchange` raises."""
    body = _Body(response, most_bytes=most_bytes)
    for piece in response.iter_bytes():
        body.add(piece)
    return body.answer()


async def read_async(response: httpx.Response, *, most_bytes: int) -> Answer:
    """Return an answer that was not read yet; raises what `exchange` raises."""
    body = _Body(response, most_bytes=most_bytes)
    async for piece in response.aiter_bytes():
        body.add(piece)
    return body.answer()


def require_plain(response: httpx.Response) -> None:
    """Refuse an answer whose length says nothing of what it unpacks to.

    Raises ProtocolError if it is encoded, which was not requested.
    """
    encoding = response.headers.get("content-encoding", "identity").strip().lower()
    if encoding != "identity":
        raise ProtocolError("content-encoding", encoding, "identity, as requested")


def answer_of(response: httpx.Response) -> Answer:
    """Return the answer in a response that was read to its end."""
    return _answer(response, response.content)


def _answer(response: httpx.Response, body: bytes) -> Answer:
    kind = media_type(response.headers.get("content-type", ""))
    return Answer(response.status_code, kind, body, response.reason_phrase)


class _Body:
    """The body of an answer, as far as it has arrived.

    Raises ProtocolError: wherever it turns out to be encoded, or too long.
    """

    def __init__(self, response: httpx.Response, *, most_bytes: int) -> None:
        require_plain(response)
        self._response = response
        self._most_bytes = most_bytes
        self._pieces: list[bytes] = []
        self._length = 0
        stated = response.headers.get("content-length", "")
        if stated.isdecimal() and int(stated[:20]) > most_bytes:
            self._refuse(stated[:20])

    def add(self, piece: bytes) -> None:
        """Add what came next."""
        self._length += len(piece)
        if self._length > self._most_bytes:
            self._refuse("more")
        self._pieces.append(piece)

    def answer(self) -> Answer:
        """Return the answer, now that all of it is there."""
        return _answer(self._response, b"".join(self._pieces))

    def _refuse(self, length: str) -> None:
        raise ProtocolError("answer", f"{length} bytes", f"at most {self._most_bytes} bytes")


class _Stream(httpcore.NetworkStream):
    """A stream that waits no longer than the request that it is used for may take."""

    def __init__(self, stream: httpcore.NetworkStream) -> None:
        self._stream = stream

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        left_s = _left_s(timeout, httpcore.ReadTimeout)
        return self._stream.read(max_bytes, left_s)

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        left_s = _left_s(timeout, httpcore.WriteTimeout)
        self._stream.write(buffer, left_s)

    def close(self) -> None:
        self._stream.close()

    def start_tls(self, *arguments: Any, **options: Any) -> httpcore.NetworkStream:
        return _Stream(self._stream.start_tls(*arguments, **options))

    def get_extra_info(self, info: str) -> Any:
        return self._stream.get_extra_info(info)


class _Backend(httpcore.NetworkBackend):
    """Makes streams that keep to the deadline."""

    def __init__(self, backend: httpcore.NetworkBackend) -> None:
        self._backend = backend

    def connect_tcp(self, *arguments: Any, **options: Any) -> httpcore.NetworkStream:
        return _Stream(self._backend.connect_tcp(*arguments, **options))

    def sleep(self, seconds: float) -> None:
        self._backend.sleep(seconds)


def _left_s(timeout_s: float | None, error: type[httpcore.TimeoutException]) -> float | None:
    deadline = _DEADLINE.get()
    left_s = None if deadline is None else deadline.left_s()
    if left_s is None:
        return timeout_s
    if left_s <= 0.0:
        raise error("the whole answer took too long")
    return left_s if timeout_s is None else min(timeout_s, left_s)
