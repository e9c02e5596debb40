"""Portions and turns: what arrives is handed over in turn, for so much of the loop's time."""

import asyncio
import threading
from typing import Any, cast

from tests.server.daemon.loops import SHARE, Loop
from transientcam_server.daemon._fair_queue import BURST_S, FairQueue
from transientcam_server.daemon._read_limiter import PORTION_BYTES, ReadLimiter


class Transport:
    """Counts how often it is paused, and refuses what a transport refuses."""

    def __init__(self) -> None:
        self.reading = True
        self.closing = False

    def pause_reading(self) -> None:
        assert self.reading
        self.reading = False

    def resume_reading(self) -> None:
        assert not self.reading
        self.reading = True

    def is_closing(self) -> bool:
        return self.closing

    def write(self, data: bytes) -> None: ...

    def writelines(self, data: list[bytes]) -> None: ...


class Protocol(asyncio.Protocol):
    """Takes its time, and notes what it was handed."""

    def __init__(self, loop: Loop, *, costs_s: float = 0.0) -> None:
        self.loop = loop
        self.costs_s = costs_s
        self.received: list[bytes] = []
        self.transport: Any = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport

    def data_received(self, data: bytes) -> None:
        self.received.append(data)
        self.loop.spent_s += self.costs_s


class Connection:
    """A client's end of a limiter."""

    def __init__(
        self,
        loop: Loop,
        turns: FairQueue,
        *,
        costs_s: float = 0.0,
        first: FairQueue | None = None,
        arrived: int | None = None,
    ) -> None:
        self.offs = 0
        self.protocol = Protocol(loop, costs_s=costs_s)
        self.transport = Transport()
        self.lost = 0
        self.limiter = ReadLimiter(
            self.protocol,
            requests=turns.account("client"),
            streams=loop.turns().account("client"),
            first=(first or loop.turns()).account("client"),
            lost=self._count,
            offs=lambda: self.offs,
            arrived=arrived,
        )
        self.limiter.connection_made(cast("asyncio.Transport", self.transport))

    def _count(self) -> None:
        self.lost += 1

    def send(self, data: bytes) -> None:
        """Send as much as is read."""
        while data and self.transport.reading:
            buffer = self.limiter.get_buffer(-1)
            portion, data = data[: len(buffer)], data[len(buffer) :]
            buffer[: len(portion)] = portion
            self.limiter.buffer_updated(len(portion))


def test_what_arrives_is_handed_over_at_once_in_portions() -> None:
    loop = Loop()
    connection = Connection(loop, loop.turns())

    connection.send(b"x" * (2 * PORTION_BYTES + 10))

    assert [len(each) for each in connection.protocol.received] == [PORTION_BYTES] * 2 + [10]
    assert connection.transport.reading


def test_a_request_has_the_count_of_when_its_first_byte_was_read() -> None:
    loop = Loop()
    connection = Connection(loop, loop.turns())
    limiter = connection.limiter

    connection.send(b"GET /")
    connection.offs = 1
    connection.send(b"livez HTTP/1.1\r\n\r\nGET")
    assert limiter.offs == 0
    connection.offs = 2
    limiter.expect(more=True)  # the second one began with what came last
    assert limiter.offs == 1
    limiter.expect(more=False)
    connection.send(b"GET")
    assert limiter.offs == 2


def test_what_had_arrived_before_a_connection_is_read_has_the_count_of_then() -> None:
    loop = Loop()
    connection = Connection(loop, loop.turns(), arrived=0)
    connection.offs = 1
    connection.send(b"GET")

    assert connection.limiter.offs == 0


def test_a_flood_is_read_for_its_share_of_the_time_and_no_more() -> None:
    loop = Loop()
    cost_s = 0.003
    flooding = Connection(loop, loop.turns(), costs_s=cost_s)
    flood = b"x" * (1000 * PORTION_BYTES)
    for _ in range(1000):
        flooding.send(flood)
        loop.pass_s(0.001)

    allowed_s = BURST_S + SHARE * loop.now_s
    assert allowed_s - 2 * cost_s <= loop.spent_s <= allowed_s + cost_s
    assert not flooding.transport.reading


def test_beside_a_flood_each_connection_has_its_turn() -> None:
    loop = Loop()
    turns = loop.turns()
    flooding = [Connection(loop, turns, costs_s=0.003) for _ in range(16)]
    healthy = Connection(loop, turns)
    flood = b"x" * (1000 * PORTION_BYTES)
    for each in flooding:
        each.send(flood)
    healthy.send(b"GET")
    before = [len(each.protocol.received) for each in flooding]
    while not healthy.protocol.received:
        for each in flooding:
            each.send(flood)
        loop.pass_s(0.001)

    beside = [len(each.protocol.received) for each in flooding]
    assert all(now - then <= 2 for now, then in zip(beside, before, strict=True))
    assert healthy.protocol.received == [b"GET"]


def test_a_protocol_that_pauses_is_handed_nothing_until_it_resumes() -> None:
    loop = Loop()
    connection = Connection(loop, loop.turns())
    connection.protocol.transport.pause_reading()
    connection.protocol.transport.pause_reading()  # as often as it likes
    assert not connection.transport.reading

    # of TLS, a portion may be on its way already
    connection.transport.reading = True
    connection.send(b"late")
    connection.transport.reading = False
    assert connection.protocol.received == []

    connection.protocol.transport.resume_reading()
    assert connection.protocol.received == [b"late"]
    assert connection.transport.reading


def test_what_is_held_is_read_on_after_the_work_that_it_waited_for() -> None:
    loop = Loop()
    connection = Connection(loop, loop.turns())
    valve = connection.protocol.transport
    valve.hold()
    valve.resume_reading()  # which does not release it
    assert not connection.transport.reading

    rounds = []

    def work() -> None:
        rounds.append(connection.transport.reading)
        if len(rounds) == 1:
            valve.hold()  # there is more of it

    valve.release(work)
    assert (rounds, connection.transport.reading) == ([False], False)
    valve.release(work)
    assert (rounds, connection.transport.reading) == ([False, False], True)


def test_a_connection_that_is_closing_is_handed_nothing_more() -> None:
    loop = Loop()
    turns = loop.turns()
    busy = Connection(loop, turns, costs_s=1.0)
    waiting = Connection(loop, turns)
    busy.send(b"x")
    waiting.send(b"too late")
    waiting.transport.closing = True
    loop.pass_s(10.0)

    assert waiting.protocol.received == []
    waiting.limiter.connection_lost(None)
    assert waiting.lost == 1


def test_another_protocol_takes_over_what_arrives_from_then_on() -> None:
    loop = Loop()
    connection = Connection(loop, loop.turns())
    other = Protocol(loop)
    connection.send(b"head")
    connection.protocol.transport.set_protocol(other)
    connection.send(b"frames")

    assert (connection.protocol.received, other.received) == ([b"head"], [b"frames"])
    assert connection.protocol.transport.get_protocol() is other


def test_each_thread_reads_into_a_buffer_of_its_own() -> None:
    """Several services in one process have a loop each, and each loop a thread."""

    def buffer() -> memoryview:
        nothing = cast("Any", None)
        limiter = ReadLimiter(
            nothing, requests=nothing, streams=nothing, first=nothing, lost=lambda: None
        )
        return limiter.get_buffer(0)

    here, there = buffer(), []
    thread = threading.Thread(target=lambda: there.append(buffer()))
    thread.start()
    thread.join()
    assert buffer().obj is here.obj
    assert there[0].obj is not here.obj


SAFE_OFF = b"POST /api/v1/acquisition/safe-off HTTP/1.1\r\nHost: lab\r\n\r\n"
STOP = (b"PUT /api/v1/acquisition HTTP/1.1\r\nContent-Length: 18\r\n\r\n", b'{"running": false}')
READ = b"GET /livez HTTP/1.1\r\n\r\n"


def without_time(loop: Loop) -> FairQueue:
    """Turns that are all had."""
    turns = loop.turns()
    turns.account("client").charge(1e6)
    turns.count(turns.account("client"), lambda: loop.work(1e6))
    return turns


def test_what_switches_the_light_off_waits_for_no_turn() -> None:
    loop = Loop()
    turns = without_time(loop)
    others = [Connection(loop, turns) for _ in range(3)]
    for each in others:
        each.send(READ)
    whole, in_parts = Connection(loop, turns), Connection(loop, turns)
    whole.send(SAFE_OFF)
    for part in STOP:
        in_parts.send(part)

    assert whole.protocol.received == [SAFE_OFF]
    assert in_parts.protocol.received == [b"".join(STOP)]
    assert [each.protocol.received for each in others] == [[]] * 3


def test_it_has_a_share_of_its_own_and_no_more() -> None:
    loop = Loop()
    first = without_time(loop)
    flooding = Connection(loop, loop.turns(), first=first)
    flooding.send(SAFE_OFF)

    assert flooding.protocol.received == []


def test_after_it_a_connection_has_turns_like_any_other() -> None:
    loop = Loop()
    turns = without_time(loop)
    connection = Connection(loop, turns)
    connection.send(SAFE_OFF)
    connection.limiter.expect(more=False)
    connection.send(READ)
    assert connection.protocol.received == [SAFE_OFF]

    again = Connection(loop, turns)
    again.limiter.expect(more=False)  # the answer to an earlier request was complete
    again.send(SAFE_OFF)
    assert again.protocol.received == [SAFE_OFF]


def test_behind_another_request_it_has_that_ones_turn() -> None:
    loop = Loop()
    connection = Connection(loop, without_time(loop))
    connection.send(READ + SAFE_OFF)

    assert connection.protocol.received == []
