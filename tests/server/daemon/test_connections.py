"""Clients that send slowly, half, too much or nothing at all, and the others beside them."""

import asyncio
import json
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any, cast
from urllib.parse import urlsplit

import httpx
import pytest

from tests.server.streaming import streaming
from tests.serving import Served, serving
from transientcam_server.api import SECURITY_HEADERS
from transientcam_server.daemon._connections import BoundedConnection
from transientcam_server.daemon._read_limiter import PORTION_BYTES
from transientcam_server.daemon._stalls import CutWhereStalled
from transientcam_server.settings import LimitSettings

PATIENCE_S = 60.0
LIMIT_S = 20.0
LATE_S = 3.0
"""A request that is whole has begun to be sent by then, on a laden machine too."""


@contextmanager
def limited(**limits: Any) -> Iterator[Served]:
    with serving("sim:mirrors?noise=off", limits=LimitSettings(**limits)) as served:
        yield served


@contextmanager
def raw(served: Served, data: bytes = b"") -> Iterator[socket.socket]:
    """Connect and send bytes, and no more."""
    split = urlsplit(served.url)
    assert split.port is not None
    with socket.create_connection(("127.0.0.1", split.port), timeout=PATIENCE_S) as connection:
        connection.sendall(data)
        yield connection


def rest_of(connection: socket.socket) -> bytes:
    """Read until the other end closes; a reset is an end too."""
    received = b""
    try:
        while data := connection.recv(65536):
            received += data
    except ConnectionResetError:
        pass
    return received


def problem(answer: bytes) -> tuple[int, dict[str, Any]]:
    head, _, body = answer.partition(b"\r\n\r\n")
    assert b"content-type: application/problem+json" in head.lower()
    assert b"connection: close" in head.lower()
    return int(head.split(b" ")[1]), json.loads(body)


@pytest.mark.parametrize(
    "begun", [b"", b"GET", b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: ", b"\r\n\r\n"]
)
def test_a_head_that_does_not_end_is_given_up(begun: bytes) -> None:
    with limited(head_s=0.2) as served, raw(served, begun) as connection:
        status, document = problem(rest_of(connection))

    assert (status, document["type"]) == (408, "/problems/request-late")
    assert document["limit"] == 0.2


def test_one_byte_now_and_then_does_not_buy_more_time() -> None:
    with limited(head_s=0.3) as served, raw(served, b"GET / HTTP/1.1\r\nX: ") as connection:
        connection.settimeout(0.05)
        received = b""
        for _ in range(1000):  # 50 s and more, if it did
            try:
                connection.sendall(b"x")
                received = connection.recv(65536)
                break
            except TimeoutError:
                continue
            except (BrokenPipeError, ConnectionResetError):
                break
        else:
            pytest.fail("the connection stayed open")

    assert not received or problem(received)[0] == 408


def test_a_second_request_has_a_deadline_of_its_own() -> None:
    get = b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    with limited(head_s=LATE_S) as served, raw(served, get) as connection:
        assert connection.recv(65536).startswith(b"HTTP/1.1 200")
        connection.sendall(b"GET /livez HTTP/1.1\r\n")
        answer = rest_of(connection)

    status, _ = problem(answer[answer.index(b"HTTP/1.1 408") :])
    assert status == 408


def test_a_body_that_does_not_come_is_given_up_and_changes_nothing() -> None:
    head = (
        b"PUT /api/v1/sequence HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
        b"Content-Length: 20\r\n\r\n{"
    )
    with limited(body_s=0.2) as served, raw(served, head) as connection:
        status, document = problem(rest_of(connection))
        before = httpx.get(f"{served.url}/api/v1/sequence").json()

    assert (status, document["type"], document["limit"]) == (408, "/problems/request-late", 0.2)
    assert before["harmonics"] == 3


def test_a_head_without_end_is_cut_short() -> None:
    line = b"X-Long: " + b"x" * 1000 + b"\r\n"
    with limited(head_bytes=4096) as served, raw(served, b"GET / HTTP/1.1\r\n") as connection:
        try:
            for _ in range(1000):
                connection.sendall(line)
        except (BrokenPipeError, ConnectionResetError):
            pass
        assert httpx.get(f"{served.url}/livez").status_code == 200

    with limited(head_bytes=4096) as served, raw(served, b"GET /" + b"a" * 5000) as connection:
        status, document = problem(rest_of(connection))
    assert (status, document["type"], document["limit"]) == (431, "/problems/head-too-large", 4096)


def test_thousands_of_times_of_flight_fit_into_a_head() -> None:
    times = "&".join(f"time_s={i * 1.000000001e-11 + 1e-13!r}" for i in range(1500))
    head = f"GET /api/v1/frames/latest/flags.npy?{times} HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    request = head.encode() + b"Connection: close\r\n\r\n"
    with limited() as served, raw(served, request) as connection:
        answer = rest_of(connection)

    assert len(head) > 32 * 1024
    assert b"/problems/head-too-large" not in answer
    assert answer.split(b" ")[1] in (b"200", b"422", b"503")  # of the route, not of the connection


def test_what_is_no_http_is_a_problem_too() -> None:
    with limited() as served, raw(served, b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n") as connection:
        status, document = problem(rest_of(connection))

    assert (status, document["type"]) == (400, "/problems/bad-request")


def test_silent_connections_do_not_stop_the_service() -> None:
    with limited(head_s=30.0) as served, ExitStack() as stack:
        for index in range(100):
            stack.enter_context(raw(served, b"GET / HTTP/1.1\r\n" if index % 2 else b""))
        assert httpx.get(f"{served.url}/livez").status_code == 200
        with streaming(served.stream_url) as client:
            client.subscribe("flags")
            assert client.frame().product == "flags"


def test_one_connection_too_many_is_refused_and_one_that_ends_makes_room() -> None:
    with limited(max_connections=3) as served, ExitStack() as stack:
        silent = [stack.enter_context(raw(served)) for _ in range(3)]
        with raw(served) as refused:
            status, document = problem(rest_of(refused))
        assert (status, document["type"]) == (503, "/problems/too-many-connections")

        silent[0].close()
        with httpx.Client(base_url=served.url) as client:
            # the service sees the end a moment later
            statuses = iter(lambda: client.get("/livez").status_code, 200)
            assert set(statuses) <= {503}


def test_one_address_does_not_take_all_of_them() -> None:
    # streams count as well
    with (
        limited(max_connections_per_address=2) as served,
        streaming(served.stream_url) as client,
        raw(served),
    ):
        client.subscribe("flags")
        with raw(served) as refused:
            status, document = problem(rest_of(refused))
        # a client that has sent something already may see a reset before the answer
        with raw(served) as refused_stream:
            with suppress(OSError):
                refused_stream.sendall(UPGRADE)
            assert b" 101 " not in rest_of(refused_stream)
        assert client.frame().product == "flags"

    assert (status, document["type"]) == (429, "/problems/too-many-from-one-address")


def test_a_stream_outlives_the_deadlines_of_requests() -> None:
    limits = {"head_s": LATE_S, "body_s": LATE_S}
    with limited(**limits) as served, streaming(served.stream_url) as client:
        client.subscribe("flags")
        begin_s = client.frame().meta["device_time_s"]
        while client.frame().meta["device_time_s"] - begin_s < 1.2 * LATE_S:
            pass


def test_a_long_poll_outlives_the_deadlines_of_requests() -> None:
    with (
        limited(head_s=LATE_S, body_s=LATE_S) as served,
        httpx.Client(base_url=served.url, timeout=PATIENCE_S) as client,
    ):
        client.put("/api/v1/acquisition", json={"running": False})
        params = {"wait_s": 1.2 * LATE_S, "after": 2**50}
        answer = client.get("/api/v1/frames/latest", params=params)

    assert answer.json()["type"] == "/problems/no-frame-yet"


UPGRADE = (
    b"GET /api/v1/stream HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\n"
    b"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
    b"Sec-WebSocket-Protocol: transientcam.v1.msgpack\r\n\r\n"
)
GET = b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
POST = (
    b"POST /api/v1/lease HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    b"Transfer-Encoding: chunked\r\n\r\n"
)
MOST_BYTES = 64 * 1024 * 1024
LAST = b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"


@pytest.fixture(scope="module")
def plain() -> Iterator[Served]:
    """A daemon whose heads may be short."""
    with limited(head_bytes=4096) as served:
        yield served


@pytest.fixture
def works(plain: Served, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many requests of one connection were in the works whenever one was begun."""
    counts: list[int] = []
    begin = BoundedConnection.on_headers_complete

    def noted(connection: BoundedConnection) -> None:
        unanswered = connection.cycle is not None and not connection.cycle.response_complete
        counts.append(len(connection.pipeline) + unanswered)
        begin(connection)

    monkeypatch.setattr(BoundedConnection, "on_headers_complete", noted)
    return counts


def statuses(answers: bytes) -> list[int]:
    return [int(each[:3]) for each in answers.split(b"HTTP/1.1 ")[1:]]


def test_requests_sent_together_are_answered_one_after_the_other(
    plain: Served, works: list[int]
) -> None:
    with raw(plain, 200 * GET + LAST) as connection:
        answers = rest_of(connection)

    assert statuses(answers) == [200] * 201
    assert works == [0] * 201


@pytest.mark.parametrize("size", [1, 3, 7, 64])
def test_requests_are_separated_wherever_packets_end(
    plain: Served, works: list[int], size: int
) -> None:
    body = b'{"holder": "x", "on_lapse": "\r\n\r\n"}'
    with_length = (
        b"POST /api/v1/lease HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json"
    )
    with_length += b"\r\nContent-Length: %d\r\n\r\n" % len(body) + body
    chunked = POST + b"4\r\n\r\n\r\n\r\n%x\r\n" % len(body) + body + b"\r\n0\r\n\r\n"
    requests = GET + with_length + GET + chunked + LAST
    with raw(plain) as connection:
        for begin in range(0, len(requests), size):
            connection.sendall(requests[begin : begin + size])
        answers = rest_of(connection)

    assert statuses(answers) == [200, 422, 200, 422, 200]
    assert works == [0] * 5


def test_what_is_pipelined_and_not_answered_stays_in_the_sockets(
    plain: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    connections: list[BoundedConnection] = []
    made = BoundedConnection.connection_made

    def noted(connection: BoundedConnection, transport: asyncio.BaseTransport) -> None:
        connections.append(connection)
        made(connection, transport)

    monkeypatch.setattr(BoundedConnection, "connection_made", noted)
    wait = GET.replace(b"/livez", b"/api/v1/frames/latest?wait_s=10&after=%d" % 2**50)
    with raw(plain, wait) as connection:
        connection.setblocking(False)
        sent = 0
        while sent < MOST_BYTES:
            try:
                sent += connection.send(GET * 1000)
            except BlockingIOError:
                if connections and connections[0]._unparsed:
                    break  # the sockets are full, and nothing more is read
                time.sleep(0.01)
        (held,) = connections

        assert sent < MOST_BYTES
        assert len(held._unparsed) <= PORTION_BYTES
        assert not held.pipeline


@pytest.mark.parametrize(
    "endless",
    [b"a: b\r\n", b"x", b"\r\n"],
    ids=["trailers", "an endless trailer", "empty lines before a head"],
)
def test_what_is_beside_the_body_is_counted_with_the_head(plain: Served, endless: bytes) -> None:
    begun = b"" if endless == b"\r\n" else POST + b"0\r\n" + (b"a: " if endless == b"x" else b"")
    with raw(plain, begun) as connection:
        try:
            for _ in range(1000):
                connection.sendall(endless * 65536)
        except (BrokenPipeError, ConnectionResetError):
            pass
        else:
            pytest.fail("the connection took it all")


def test_the_sizes_of_chunks_may_be_as_long_as_the_body_and_a_head(plain: Served) -> None:
    # 5 of 6 bytes are beside the body, so that 4 more of each chunk are than the body has
    allowed, refused = 4096 // 4 - 20, 4096 // 4 + 20
    chunk = b"1\r\n \r\n"
    with raw(plain, POST + allowed * chunk + b"0\r\n\r\n" + LAST) as connection:
        assert statuses(rest_of(connection)) == [422, 200]
    with raw(plain, POST + refused * chunk) as connection:
        status, document = problem(rest_of(connection))
    assert (status, document["type"]) == (431, "/problems/head-too-large")


def test_trailers_are_no_headers(plain: Served) -> None:
    token = POST + b"2\r\n{}\r\n0\r\nX-Request-ID: smuggled\r\n\r\n" + LAST
    with raw(plain, token) as connection:
        answers = rest_of(connection)

    assert statuses(answers) == [422, 200]
    assert b"smuggled" not in answers


HANDSHAKE = (
    b"GET %s HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: %s\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
)


@pytest.mark.parametrize(
    ("request_bytes", "line"),
    [
        (b"\x16\x03\x01\r\n\r\n", b"HTTP/1.1 400 Bad Request"),
        (b"GET /" + b"a" * 5000, b"HTTP/1.1 431 Request Header Fields Too Large"),
        (HANDSHAKE % (b"/api/v1/stream", b"99"), b"HTTP/1.1 400 Bad Request"),
        (HANDSHAKE % (b"/nothing", b"13"), b"HTTP/1.1 403 Forbidden"),
        (
            b"GET /livez HTTP/1.1\r\nHost: localhost\r\nHost: a\r\nConnection: close\r\n\r\n",
            b"HTTP/1.1 400 Bad Request",
        ),
    ],
)
def test_refusals_of_the_connection_are_like_any_other_answer(
    plain: Served, request_bytes: bytes, line: bytes
) -> None:
    with raw(plain, request_bytes) as connection:
        answer = rest_of(connection)

    head = answer.partition(b"\r\n\r\n")[0].lower()
    assert answer.split(b"\r\n")[0] == line
    for name, value in SECURITY_HEADERS.items():
        assert f"{name}: {value}".lower().encode() in head


class Timer:
    """One that rings when the test calls it."""

    def __init__(self, delay_s: float, ring: Any) -> None:
        self.delay_s = delay_s
        self.ring = ring
        self.cancelled = False

    def cancel(self) -> None:
        self.cancelled = True


class Connection:
    """A loop and a transport with so many bytes left to write."""

    def __init__(self, left_bytes: int) -> None:
        self.left_bytes = left_bytes
        self.aborted = False
        self.timers: list[Timer] = []

    def call_later(self, delay_s: float, ring: Any) -> Timer:
        self.timers.append(Timer(delay_s, ring))
        return self.timers[-1]

    def get_write_buffer_size(self) -> int:
        return self.left_bytes

    def abort(self) -> None:
        self.aborted = True

    def wait(self) -> None:
        """Let the time of the last timer pass."""
        assert not self.timers[-1].cancelled
        assert self.timers[-1].delay_s == LIMIT_S
        self.timers[-1].ring()


class Writing(CutWhereStalled):
    def __init__(self, connection: Connection) -> None:
        self.loop = self.transport = cast("Any", connection)
        self._limits = LimitSettings(stalled_s=LIMIT_S)


def test_a_connection_that_takes_nothing_is_cut() -> None:
    connection = Connection(100_000)
    Writing(connection).pause_writing()
    connection.wait()

    assert connection.aborted


def test_one_that_takes_a_little_is_waited_for_until_it_takes_nothing() -> None:
    connection = Connection(100_000)
    Writing(connection).pause_writing()
    for left_bytes in (99_999, 50_000, 10):
        connection.left_bytes = left_bytes
        connection.wait()
        assert not connection.aborted
    connection.wait()

    assert connection.aborted


def test_one_to_which_only_more_was_added_took_nothing() -> None:
    connection = Connection(100_000)
    Writing(connection).pause_writing()
    connection.left_bytes += 6  # a ping
    connection.wait()

    assert connection.aborted


def test_nothing_happens_once_everything_is_taken() -> None:
    connection = Connection(100_000)
    writing = Writing(connection)
    writing.pause_writing()
    writing.resume_writing()
    writing.resume_writing()

    assert connection.timers[0].cancelled
    assert not connection.aborted


def test_each_time_counts_for_itself() -> None:
    connection = Connection(100_000)
    writing = Writing(connection)
    writing.pause_writing()
    writing.pause_writing()

    assert [timer.cancelled for timer in connection.timers] == [True, False]


def test_each_mebibyte_of_a_file_has_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[float | None] = []
    expect_within = BoundedConnection._expect_within

    def counted(connection: BoundedConnection, duration_s: float | None) -> None:
        given.append(duration_s)
        expect_within(connection, duration_s)

    monkeypatch.setattr(BoundedConnection, "_expect_within", counted)
    body_s = 77.0
    with limited(body_s=body_s) as served:
        answer = httpx.post(
            f"{served.url}/api/v1/calibrations/import", content=bytes(7 * 2**19), timeout=PATIENCE_S
        )

    assert answer.status_code == 422
    assert given.count(body_s) == 1 + 3
