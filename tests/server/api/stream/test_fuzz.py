"""What no client should send: broken WebSocket frames, torn connections, messages of any content.

After the manner of the Autobahn test suite: each case states what RFC 6455 asks of a server.
"""

import asyncio
import random
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.client import ClientProtocol
from websockets.protocol import State
from websockets.uri import parse_uri

from tests.server.streaming import streaming
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import wire
from transientcam_server.daemon._streams import BoundedStream

PATIENCE_S = 60.0
TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
MASK = b"\x01\x02\x03\x04"
SUBSCRIBE = wire.pack(wire.Subscribe((wire.Subscription("flags"),)).to_document())
CLEAN = (1000, 1001)


def frame(
    opcode: int,
    payload: bytes = b"",
    *,
    fin: bool = True,
    rsv: int = 0,
    masked: bool = True,
    length: int | None = None,
) -> bytes:
    """A WebSocket frame as RFC 6455 draws it in Sec. 5.2, right or wrong."""
    size = len(payload) if length is None else length
    head = bytes((fin << 7 | rsv << 4 | opcode,))
    mask_bit = 128 if masked else 0
    if size < 126:
        head += bytes((mask_bit | size,))
    elif size < 1 << 16:
        head += bytes((mask_bit | 126,)) + size.to_bytes(2, "big")
    else:
        head += bytes((mask_bit | 127,)) + size.to_bytes(8, "big")
    if not masked:
        return head + payload
    return head + MASK + bytes(byte ^ MASK[index % 4] for index, byte in enumerate(payload))


def closing(code: int, reason: bytes = b"") -> bytes:
    return frame(CLOSE, code.to_bytes(2, "big") + reason)


class Connection:
    """A socket on which the handshake is done."""

    def __init__(self, connection: socket.socket) -> None:
        self.socket = connection
        self._received = b""

    def send(self, data: bytes) -> None:
        # it may have been sent away already
        with suppress(ConnectionError):
            self.socket.sendall(data)

    def next(self) -> tuple[int, bytes]:
        """Return opcode and payload of the next frame of the server."""
        first, size = self._take(2)
        if size > 125:
            size = int.from_bytes(self._take(2 if size == 126 else 8), "big")
        return first & 15, self._take(size)

    def until(self, opcode: int) -> bytes:
        """Return the payload of the next frame with an opcode."""
        while True:
            found, payload = self.next()
            if found == opcode:
                return payload

    def close_code(self) -> int:
        """Return the code the server closes with; 1006 where it just ends."""
        try:
            payload = self.until(CLOSE)
        except (ConnectionError, EOFError):
            return 1006
        return int.from_bytes(payload[:2], "big") if payload else 1005

    def _take(self, size: int) -> bytes:
        while len(self._received) < size:
            data = self.socket.recv(65536)
            if not data:
                raise EOFError
            self._received += data
        taken, self._received = self._received[:size], self._received[size:]
        return taken


@contextmanager
def opened(url: str) -> Iterator[Connection]:
    uri = parse_uri(url)
    protocol = ClientProtocol(uri, subprotocols=[wire.SUBPROTOCOL])  # type: ignore[list-item]
    with socket.create_connection((uri.host, uri.port), timeout=PATIENCE_S) as connection:
        protocol.send_request(protocol.connect())
        connection.sendall(b"".join(protocol.data_to_send()))
        answer = b""
        while b"\r\n\r\n" not in answer:
            answer += connection.recv(1)
        assert b" 101 " in answer
        yield Connection(connection)


BROKEN: dict[str, tuple[bytes, int]] = {
    "not masked": (frame(BINARY, SUBSCRIBE, masked=False), 1002),
    "a ping that is not masked": (frame(PING, masked=False), 1002),
    **{f"reserved bit {bit}": (frame(BINARY, b"x", rsv=bit), 1002) for bit in (1, 2, 4, 7)},
    **{f"opcode {code}": (frame(code, b"x"), 1002) for code in (3, 4, 5, 6, 7, 11, 12, 15)},
    "a ping in parts": (frame(PING, b"x", fin=False), 1002),
    "a close in parts": (frame(CLOSE, fin=False), 1002),
    "a ping too long": (frame(PING, b"x" * 126), 1002),
    "a close too long": (frame(CLOSE, b"x" * 126), 1002),
    "a part of nothing": (frame(0, b"x"), 1002),
    "a last part of nothing": (frame(0, b"x", fin=True), 1002),
    "a message within another": (frame(BINARY, b"x", fin=False) + frame(BINARY, b"y"), 1002),
    "a text within binary": (frame(BINARY, b"x", fin=False) + frame(TEXT, b"y"), 1002),
    "text that is no UTF-8": (frame(TEXT, b"\xff\xfe"), 1007),
    "text cut within a character": (frame(TEXT, b"\xe2\x82"), 1007),
    "half a close code": (frame(CLOSE, b"\x03"), 1002),
    **{
        f"close code {code}": (closing(code), 1002)
        for code in (0, 999, 1004, 1005, 1006, 1015, 1016, 2999, 5000, 65535)
    },
    "a reason that is no UTF-8": (closing(1000, b"\xff"), 1007),
    "a message too long": (frame(BINARY, b"x" * (wire.MAX_CLIENT_MESSAGE_BYTES + 1)), 1009),
    "parts too long together": (
        frame(BINARY, b"x" * 40_000, fin=False) + frame(0, b"x" * 40_000),
        1009,
    ),
    "a length that is announced and too long": (frame(BINARY, length=2**40), 1009),
    "a length beyond 63 bits": (frame(BINARY, length=2**63 + 5), 1009),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_frame_ends_that_connection_with_the_code_that_says_why(
    steady_stream: str, name: str
) -> None:
    data, code = BROKEN[name]
    with opened(steady_stream) as connection:
        connection.send(frame(BINARY, SUBSCRIBE))
        connection.until(BINARY)
        connection.send(data)

        assert connection.close_code() == code


@pytest.mark.parametrize("name", sorted(BROKEN)[::4])
def test_a_broken_first_frame_is_no_better(steady_stream: str, name: str) -> None:
    with opened(steady_stream) as connection:
        connection.send(BROKEN[name][0])

        assert connection.close_code() not in CLEAN


def in_parts(message: bytes, size: int) -> bytes:
    parts = [message[begin : begin + size] for begin in range(0, len(message), size)]
    return b"".join(
        frame(0 if index else BINARY, part, fin=index == len(parts) - 1)
        + frame(PING, b"%d" % index)
        for index, part in enumerate(parts)
    )


@pytest.mark.parametrize("size", [2, 7, 1000])
def test_a_message_in_parts_with_pings_between_them_is_a_message(
    steady_stream: str, size: int
) -> None:
    with opened(steady_stream) as connection:
        connection.send(in_parts(SUBSCRIBE, size))

        hello = wire.parse_server_message(connection.until(BINARY))

    assert isinstance(hello, wire.Hello)


def test_bytes_that_come_one_by_one_are_a_message(steady_stream: str) -> None:
    with opened(steady_stream) as connection:
        for byte in frame(BINARY, SUBSCRIBE):
            connection.send(bytes((byte,)))

        assert isinstance(wire.parse_server_message(connection.until(BINARY)), wire.Hello)


@pytest.mark.parametrize("payload", [b"", b"hello", bytes(range(125))])
def test_every_ping_is_answered_with_what_it_carried(steady_stream: str, payload: bytes) -> None:
    with opened(steady_stream) as connection:
        connection.send(frame(PONG, b"unsolicited"))
        connection.send(frame(PING, payload) * 10)

        assert [connection.until(PONG) for _ in range(10)] == [payload] * 10


@pytest.mark.parametrize("code", [1000, 1001, 1003, 1007, 1011, 3000, 4999])
def test_a_close_is_answered_with_its_code(steady_stream: str, code: int) -> None:
    with opened(steady_stream) as connection:
        connection.send(closing(code, "grüße".encode()))
        connection.send(frame(BINARY, SUBSCRIBE))  # too late, and passed over

        assert connection.close_code() == code


def test_a_close_without_a_code_is_one(steady_stream: str) -> None:
    with opened(steady_stream) as connection:
        connection.send(frame(CLOSE))

        assert connection.close_code() in (1000, 1005)


def garbage(draw: random.Random) -> bytes:
    """Something between nonsense and a WebSocket frame."""
    payload = draw.randbytes(draw.choice((0, 1, 3, 100, 126, 3000)))
    match draw.randrange(6):
        case 0:
            return payload
        case 1:
            return frame(draw.randrange(16), payload, fin=draw.random() < 0.8)
        case 2:
            return frame(BINARY, payload, masked=draw.random() < 0.5, rsv=draw.randrange(8))
        case 3:
            return frame(BINARY, payload, length=draw.choice((1, 200, 70_000, 2**40)))
        case 4:
            whole = bytearray(frame(BINARY, SUBSCRIBE))
            for _ in range(draw.randrange(1, 6)):
                whole[draw.randrange(len(whole))] = draw.randrange(256)
            return bytes(whole)
        case _:
            return frame(BINARY, SUBSCRIBE)[: draw.randrange(1, 40)]


def anything(draw: random.Random, depth: int = 0) -> Any:
    """Any value msgpack can hold, seldom a sensible one."""
    simple: list[Any] = [
        None, True, -1, 0, 1, 2**53, 2**64 - 1, -0.0, float("nan"), float("inf"), "", "range",
        "x" * 300, b"", b"\xff" * 9, "\ud7ff", [], {},
    ]  # fmt: skip
    choice = draw.randrange(len(simple) + (4 if depth < 3 else 0))
    if choice < len(simple):
        return simple[choice]
    values = [anything(draw, depth + 1) for _ in range(draw.randrange(4))]
    return values if choice % 2 else {draw.choice(KEYS): each for each in values}


KEYS = ("type", "v", "subscriptions", "product", "max_rate_hz", "encoding", "region", "decimation",
        "token", "credits", "start", "frame", "x")  # fmt: skip


def message(draw: random.Random) -> bytes:
    """A message of the protocol of which some parts are something else."""
    subscription: dict[str, Any] = {"product": draw.choice(sorted(wire.PRODUCTS))}
    document: dict[str, Any] = {"type": "subscribe", "v": 1, "subscriptions": [subscription]}
    if draw.random() < 0.2:
        document = {"type": "ack", "frame": 1}
    for _ in range(draw.randrange(1, 4)):
        target = draw.choice((document, subscription))
        target[draw.choice(KEYS)] = anything(draw)
    return wire.pack(document)


class Inside:
    """What a daemon holds for its clients; it should be the same after them as before."""

    def __init__(self, served: Served) -> None:
        self._served = served

    def counts(self) -> dict[str, int]:
        service = self._served.service
        assert service._loop is not None
        tasks = asyncio.run_coroutine_threadsafe(self._tasks(), service._loop).result(PATIENCE_S)
        return {
            "clients": service.hub.clients,
            "channel numbers": len(service.hub._numbers),
            "tasks": tasks,
            "sockets": sum(self._sockets()),
        }

    def as_before(self, before: dict[str, int]) -> bool:
        """Whether no more is held; something else may have been under way before."""
        now = self.counts()
        return all(now[name] <= count for name, count in before.items())

    @staticmethod
    def _sockets() -> Iterator[bool]:
        """Of each open descriptor, whether it is a socket; files and pipes are no client's."""
        for each in Path("/proc/self/fd").iterdir():
            with suppress(FileNotFoundError):  # closed meanwhile
                yield str(each.readlink()).startswith("socket:")

    @staticmethod
    async def _tasks() -> int:
        """Tasks but those of a frame that is being computed."""
        names = [str(task.get_coro()) for task in asyncio.all_tasks()]
        return sum("Frame." not in name for name in names)


def failures(caplog: pytest.LogCaptureFixture) -> list[str]:
    """What the log calls an error, but for the one that uvicorn makes of a client's bad text."""
    messages = [each.getMessage() for each in caplog.records if each.levelname == "ERROR"]
    return [each for each in messages if "Invalid UTF-8" not in each]


def test_nothing_that_clients_send_or_break_off_hurts_others_or_leaves_anything(
    served: Served, caplog: pytest.LogCaptureFixture
) -> None:
    draw = random.Random(20151)
    inside = Inside(served)
    with streaming(served.stream_url) as healthy:
        healthy.subscribe("flags")
        healthy.frame()
        before = inside.counts()

        for _ in range(60):
            with opened(served.stream_url) as connection:
                if draw.random() < 0.5:
                    connection.send(frame(BINARY, SUBSCRIBE))
                for _ in range(draw.randrange(1, 5)):
                    connection.send(garbage(draw))
                if draw.random() < 0.3:
                    reset = b"\x01\0\0\0\0\0\0\0"  # on, and without lingering
                    connection.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, reset)

        wait_until(lambda: healthy.frame() is not None and inside.as_before(before))
        numbers = [healthy.frame().meta["frame"] for _ in range(3)]

    assert numbers == sorted(numbers)
    assert not failures(caplog)


def test_messages_of_any_content_are_answered_and_the_stream_goes_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    draw = random.Random(42)
    with serving("sim:mirrors?noise=off", stream={"max_messages_hz": 10_000.0}) as served:
        inside = Inside(served)
        with streaming(served.stream_url) as client:
            client.subscribe("flags")
            client.frame()
        wait_until(lambda: not inside.counts()["clients"])
        before = inside.counts()
        refused = 0
        with streaming(served.stream_url) as client:
            client.subscribe("flags")
            for number in range(80):
                client.connection.send(message(draw))
                client.send({"type": f"probe {number}"})
                while (problem := client.error()).get("value") != f"probe {number}":
                    refused += 1
                    assert problem["status"] in (404, 422)
                    assert problem["field"]
            client.subscribe("flags")
            while client.frame().product != "flags":
                pass
        wait_until(lambda: inside.as_before(before))

    assert refused > 40
    assert not failures(caplog)


def test_the_service_ends_while_a_client_that_reads_nothing_closes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    streams: list[BoundedStream] = []
    made = BoundedStream.connection_made

    def noted(stream: BoundedStream, transport: asyncio.BaseTransport) -> None:
        streams.append(stream)
        made(stream, transport)

    monkeypatch.setattr(BoundedStream, "connection_made", noted)
    # a thread that fails fails the test: that of the service would
    everything = wire.pack(wire.Subscribe((wire.Subscription("raw"),)).to_document())
    with ExitStack() as stack:
        service = stack.enter_context(ExitStack())
        served = service.enter_context(serving("sim:mirrors?noise=off"))
        client = stack.enter_context(opened(served.stream_url))
        client.send(frame(BINARY, everything))
        (stream,) = streams
        wait_until(lambda: not stream.writable.is_set())  # nothing more fits on the way to it
        client.send(closing(1000))
        wait_until(lambda: stream.conn.state is not State.OPEN)
        service.close()
