"""A file behind HTTP, read in pieces."""

import io
from collections.abc import Callable, Iterator

import httpx
import numpy as np
import pytest

from transientcam import ProblemError, ProtocolError, ServerUnreachable
from transientcam.remote_file import RemoteFile

CONTENT = np.random.default_rng(0).integers(0, 256, 1_000_000, np.uint8).tobytes()
Handler = Callable[[httpx.Request], httpx.Response]


class Server:
    """Answers with ranges, as the daemon does, and counts the requests."""

    def __init__(self) -> None:
        self.content, self.tag, self.requests, self.sent_bytes = CONTENT, '"1"', 0, 0

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.requests += 1
        assert request.headers["accept-encoding"] == "identity"
        if request.headers.get("if-range", self.tag) != self.tag:
            return httpx.Response(200, content=self.content)
        first, last = map(int, request.headers["range"].removeprefix("bytes=").split("-"))
        part = self.content[first : last + 1]
        self.sent_bytes += len(part)
        where = f"bytes {first}-{first + len(part) - 1}/{len(self.content)}"
        headers = {"content-range": where, "etag": self.tag}
        return httpx.Response(206, content=part, headers=headers)


def opened(handler: Handler) -> RemoteFile:
    return RemoteFile("http://camera/file", transport=httpx.MockTransport(handler))


@pytest.fixture
def server() -> Server:
    return Server()


@pytest.fixture
def file(server: Server) -> Iterator[RemoteFile]:
    with opened(server) as found:
        yield found


def test_it_reads_as_the_file_does(file: RemoteFile) -> None:
    local = io.BytesIO(CONTENT)
    random = np.random.default_rng(1)
    for _ in range(50):
        place, count = (int(each) for each in random.integers(0, 1_100_000, 2))
        assert file.seek(place) == local.seek(place)
        assert file.read(count) == local.read(count)
    assert file.size_bytes == file.seek(0, io.SEEK_END) == len(CONTENT)
    assert file.seek(-3, io.SEEK_CUR) == len(CONTENT) - 3
    assert file.read() == CONTENT[-3:]


def test_what_was_read_is_not_requested_again(file: RemoteFile, server: Server) -> None:
    for _ in range(3):
        file.seek(300_000)
        file.read(1000)

    assert server.requests == 2  # the beginning, and one block


def test_of_a_long_piece_no_byte_beside_travels_and_what_did_is_kept(
    file: RemoteFile, server: Server
) -> None:
    before, requests = server.sent_bytes, server.requests

    file.seek(300_001)
    assert file.read(400_000) == CONTENT[300_001:700_001]
    assert (server.sent_bytes - before, server.requests - requests) == (400_000, 1)

    file.seek(400_000)  # within it
    assert file.read(10) == CONTENT[400_000:400_010]
    assert server.requests - requests == 1


def test_a_file_that_changed_meanwhile_is_not_read_on(file: RemoteFile, server: Server) -> None:
    server.tag = '"2"'

    file.seek(600_000)
    with pytest.raises(ProtocolError, match="the file that was opened"):
        file.read(10)


def test_a_server_without_ranges_is_refused() -> None:
    with pytest.raises(ProtocolError, match="the part requested"):
        opened(lambda _: httpx.Response(200, content=CONTENT))


def test_a_part_that_is_too_short_is_no_part() -> None:
    headers = {"content-range": "bytes 0-99/1000000"}
    with pytest.raises(ProtocolError, match="100 bytes"):
        opened(lambda _: httpx.Response(206, content=bytes(100), headers=headers))


def test_refusals_and_failures_are_those_of_the_package() -> None:
    with pytest.raises(ProblemError):
        opened(lambda _: httpx.Response(404))

    def fail(request: httpx.Request) -> httpx.Response:
        raise httpx.ConnectError("refused")

    with pytest.raises(ServerUnreachable):
        opened(fail)
