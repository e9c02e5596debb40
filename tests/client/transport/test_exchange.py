"""A server that lies: answers without end, that unpack to more than they are, that drip."""

import asyncio
import gzip
import itertools
import json
import socket
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import httpcore
import pytest

from transientcam import AsyncCamera, Camera, ProtocolError, ServerUnreachable
from transientcam.remote_file import RemoteFile
from transientcam.requests import MOST_DOCUMENT_BYTES
from transientcam.transport import Deadline, _exchange as exchange_module
from transientcam.transport._exchange import _left_s, within

JSON = "Content-Type: application/json"


@contextmanager
def lying(*pieces: bytes, again: bytes = b"") -> Iterator[str]:
    """Answer every connection with pieces, then with one again and again; yield the address."""
    stop = threading.Event()

    def answer(connection: socket.socket) -> None:
        with connection:
            try:
                connection.recv(65536)
                for piece in itertools.chain(pieces, itertools.repeat(again) if again else ()):
                    connection.sendall(piece)
                    if stop.wait(DRIP_S if len(piece) == 1 else 0.0):
                        return
                stop.wait(0.0 if not again else None)
            except OSError:
                pass  # the client has gone

    def accept() -> None:
        while not stop.is_set():
            try:
                connection, _ = server.accept()
            except OSError:
                return
            threads.append(threading.Thread(target=answer, args=(connection,)))
            threads[-1].start()

    with socket.create_server(("127.0.0.1", 0)) as server:
        threads = [threading.Thread(target=accept)]
        threads[0].start()
        try:
            yield f"http://127.0.0.1:{server.getsockname()[1]}"
        finally:
            stop.set()
            server.shutdown(socket.SHUT_RDWR)
            for each in threads:
                each.join()


DRIP_S = 0.02


def head(*lines: str, status: str = "200 OK") -> bytes:
    return "\r\n".join((f"HTTP/1.1 {status}", *lines, "", "")).encode()


def asked(url: str, **options: Any) -> Any:
    with Camera(url, **options) as camera:
        return camera.info


def asked_async(url: str, **options: Any) -> Any:
    async def ask() -> Any:
        async with AsyncCamera(url, **options) as camera:
            return await camera.info()

    return asyncio.run(ask())


both = pytest.mark.parametrize("ask", [asked, asked_async])
CHUNK = b"10000\r\n" + b" " * 65536 + b"\r\n"


@both
def test_a_document_without_end_is_left_at_its_limit(ask: Callable[..., Any]) -> None:
    with (
        lying(head(JSON, "Transfer-Encoding: chunked"), again=CHUNK) as url,
        pytest.raises(ProtocolError, match=f"at most {MOST_DOCUMENT_BYTES} bytes"),
    ):
        ask(url, timeout_s=60.0)


@both
def test_a_document_that_says_it_is_too_long_is_not_begun(ask: Callable[..., Any]) -> None:
    stated = MOST_DOCUMENT_BYTES + 1
    with (
        lying(head(JSON, f"Content-Length: {stated}")) as url,
        pytest.raises(ProtocolError, match=f"answer is '{stated} bytes'"),
    ):
        ask(url, timeout_s=60.0)


@both
@pytest.mark.parametrize("status", ["200 OK", "409 Conflict"])
@pytest.mark.parametrize("encoding", ["gzip", "deflate", "br", "zstd", "identity, gzip", "GZIP"])
def test_what_was_not_to_be_packed_is_not_unpacked(
    ask: Callable[..., Any], status: str, encoding: str
) -> None:
    body = gzip.compress(json.dumps({"a": "x" * 1000}).encode())
    headers = (JSON, f"Content-Encoding: {encoding}", f"Content-Length: {len(body)}")
    with (
        lying(head(*headers, status=status) + body) as url,
        pytest.raises(ProtocolError, match="identity, as requested"),
    ):
        ask(url, timeout_s=60.0)


DRIPS: Iterable[Any] = [
    pytest.param((head(JSON, "Content-Length: 100000"),), b" ", id="body"),
    pytest.param((b"HTTP/1.1 200 OK\r\nX: ",), b"x", id="head"),
    pytest.param((head(JSON, "Transfer-Encoding: chunked"),), b"0", id="length of a chunk"),
]


@both
@pytest.mark.parametrize(("pieces", "again"), DRIPS)
def test_a_byte_at_a_time_ends_with_the_time_of_the_whole(
    ask: Callable[..., Any], pieces: tuple[bytes, ...], again: bytes
) -> None:
    # each read alone is far within it
    with lying(*pieces, again=again) as url, pytest.raises(ServerUnreachable, match="in time"):
        ask(url, timeout_s=20 * DRIP_S)


def test_a_file_that_drips_ends_too() -> None:
    said = head("Content-Range: bytes 0-16383/99999", status="206 Partial Content")
    with lying(said, again=b"x") as url, pytest.raises(ServerUnreachable, match="in time"):
        RemoteFile(url, timeout_s=20 * DRIP_S)


@pytest.mark.parametrize("status", ["206 Partial Content", "404 Not Found"])
def test_of_a_file_no_more_is_read_than_was_asked(status: str) -> None:
    said = head("Content-Range: bytes 0-16383/99999", status=status)
    with lying(said, again=b"x" * 65536) as url, pytest.raises(ProtocolError, match="at most"):
        RemoteFile(url, timeout_s=60.0)


def test_a_file_that_is_packed_is_refused() -> None:
    said = head(
        "Content-Range: bytes 0-9/10", "Content-Encoding: gzip", status="206 Partial Content"
    )
    with lying(said + gzip.compress(bytes(10))) as url, pytest.raises(ProtocolError, match="ident"):
        RemoteFile(url, timeout_s=60.0)


def test_what_is_read_of_a_request_is_bounded_by_what_is_left_of_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now_s = iter([0.0, 1.0, 9.0, 11.0])
    monkeypatch.setattr(
        exchange_module, "Deadline", lambda s: Deadline(s, clock=lambda: next(now_s))
    )
    assert _left_s(5.0, httpcore.ReadTimeout) == 5.0
    with within(10.0):
        assert _left_s(5.0, httpcore.ReadTimeout) == 5.0
        assert _left_s(5.0, httpcore.ReadTimeout) == 1.0
        with pytest.raises(httpcore.ReadTimeout):
            _left_s(5.0, httpcore.ReadTimeout)


@pytest.mark.parametrize("token", ["", "a b", "tok\nen", "tok\r\nX: y", "t\xf6ken", "a\x00b"])
def test_a_token_that_is_none_is_refused_and_not_shown(token: str) -> None:
    for make in (Camera, AsyncCamera):
        with pytest.raises(ValueError, match="token is '…'") as refused:
            make("http://camera", token=token)
        assert not token or token not in str(refused.value)
