"""What a WebSocket may be sent: frames of every kind are counted, also before a token is known."""

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest

from tests.server.api.stream.test_fuzz import (
    BINARY,
    CLOSE,
    PING,
    PONG,
    SUBSCRIBE,
    closing,
    frame,
    opened,
)
from tests.serving import Served, serving
from transientcam import wire
from transientcam_server.daemon._read_limiter import PORTION_BYTES
from transientcam_server.daemon._streams import BoundedStream

RATE_HZ = 20.0
MANY = 100_000


@pytest.fixture(scope="module")
def daemon() -> Iterator[Served]:
    with serving("sim:wall?noise=off", stream={"max_messages_hz": RATE_HZ}) as served:
        served.start_all_workers()
        yield served


@pytest.fixture
def handled(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many frames were handled each time some were read."""
    counts: list[int] = []
    handle = BoundedStream.handle_events

    def noted(stream: BoundedStream) -> None:
        counts.append(len(stream.conn.events))
        handle(stream)

    monkeypatch.setattr(BoundedStream, "handle_events", noted)
    return counts


FLOODS = {
    "pongs": frame(PONG),
    "pings": frame(PING),
    "pings that carry something": frame(PING, b"x" * 125),
    "empty parts": frame(0, fin=False),
    "messages": frame(BINARY, wire.pack(wire.Ack(1).to_document())),
}


@pytest.mark.parametrize("name", FLOODS)
def test_a_flood_is_cut_after_the_first_portion_beyond_the_rate(
    daemon: Served, handled: list[int], name: str
) -> None:
    begin = frame(BINARY, fin=False) if name == "empty parts" else b""
    with opened(daemon.stream_url) as connection:
        connection.send(frame(BINARY, SUBSCRIBE))
        connection.until(BINARY)
        connection.send(begin + FLOODS[name] * MANY)
        code = connection.close_code()

    assert code in (wire.CloseCode.TOO_MANY_MESSAGES, 1006)
    assert sum(handled) < MANY // 100
    assert max(handled) <= PORTION_BYTES // len(frame(PONG)) + 1


def test_a_client_that_is_cut_off_receives_the_reason(daemon: Served) -> None:
    with opened(daemon.stream_url) as connection:
        connection.send(frame(BINARY, SUBSCRIBE))
        connection.until(BINARY)
        connection.send(frame(PING) * 60)
        while True:
            message = wire.parse_server_message(connection.until(BINARY))
            if isinstance(message, wire.ErrorMessage):
                break
        code = int.from_bytes(connection.until(CLOSE)[:2], "big")

    assert message.problem["type"] == "/problems/too-many-messages"
    assert (message.problem["limit"], code) == (RATE_HZ, wire.CloseCode.TOO_MANY_MESSAGES)


def test_before_it_has_subscribed_time_allows_no_more(
    daemon: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    streams: list[BoundedStream] = []
    made = BoundedStream.connection_made

    def noted(stream: BoundedStream, transport: asyncio.BaseTransport) -> None:
        streams.append(stream)
        made(stream, transport)

    monkeypatch.setattr(BoundedStream, "connection_made", noted)
    with opened(daemon.stream_url) as connection:
        (stream,) = streams
        clock: Any = stream._rate
        monkeypatch.setattr(clock, "_clock", lambda: 1e9)  # as if it had waited for long
        connection.send(frame(PING) * 60)

        assert connection.close_code() == wire.CloseCode.TOO_MANY_MESSAGES


def test_each_kib_counts_as_a_frame(daemon: Served) -> None:
    with opened(daemon.stream_url) as connection:
        connection.send(frame(BINARY, SUBSCRIBE))
        connection.until(BINARY)
        for _ in range(3):
            connection.send(frame(BINARY, b"x" * 60_000))

        assert connection.close_code() in (wire.CloseCode.TOO_MANY_MESSAGES, 1006)


def test_a_close_within_a_message_in_parts_is_a_close(daemon: Served) -> None:
    """RFC 6455, Sec. 7.1.5, and case 7.1.5 of Autobahn's suite."""
    with opened(daemon.stream_url) as connection:
        connection.send(frame(BINARY, SUBSCRIBE))
        connection.until(BINARY)
        connection.send(frame(BINARY, b"x", fin=False) + closing(1000) + frame(0, b"y"))

        assert connection.close_code() == 1000
