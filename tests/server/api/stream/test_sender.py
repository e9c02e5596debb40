"""The sending half of a stream with a socket and frames that are under the test's control."""

import asyncio
import time
from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any, cast

from tests.server.broadcast.outboxes import run, subscribed
from transientcam import wire
from transientcam_server.api.stream.sender import Sender
from transientcam_server.broadcast.outbox import Close, Outbox
from transientcam_server.imaging.frame import Frame

COMPUTED_S = 0.5
"""What a frame says that its reconstruction took: longer than these tests send for."""


class _Frame:
    """Leaves cores free when it is begun, and tells when; is computed at once where not held."""

    def __init__(self, number: int, *, reconstruct_s: float) -> None:
        self.number, self.reconstruct_s = number, reconstruct_s
        self.raw = SimpleNamespace(device_time_s=float(number), host_time_s=time.time())
        self.is_begun, self.may_end = asyncio.Event(), asyncio.Event()
        self.may_end.set()

    async def cores_free(self, products: Iterable[object]) -> None:
        assert list(products)
        self.is_begun.set()

    async def encoded(self, *_: object, **__: object) -> bytes:
        await self.may_end.wait()
        return self.number.to_bytes(1, "big")


class _Socket:
    """Takes a message where the test lets it."""

    def __init__(self) -> None:
        self.free = asyncio.Event()
        self.taken: list[int] = []
        self.notices: list[tuple[int, int]] = []
        self.closed: int | None = None

    async def send_bytes(self, data: bytes) -> None:
        await self.free.wait()
        if len(data) == 1:
            self.taken.append(data[0])
        else:  # how many were dropped, and before which frame that is said
            notice = cast("wire.Notice", wire.parse_server_message(data))
            self.notices.append((len(self.taken), notice.details["count"]))

    async def close(self, code: int, reason: str) -> None:
        self.closed = code


def _put(outbox: Outbox, number: int, *, reconstruct_s: float = COMPUTED_S) -> _Frame:
    frame = _Frame(number, reconstruct_s=reconstruct_s)
    outbox.put_frame(cast("Frame", frame))
    return frame


def _sending(outbox: Outbox, socket: _Socket) -> "asyncio.Task[None]":
    metrics: Any = SimpleNamespace(sent=lambda latency_s: None)
    return asyncio.ensure_future(Sender(cast("Any", socket), outbox, metrics).send_all())


async def _end(outbox: Outbox, sending: "asyncio.Task[None]") -> None:
    outbox.put(Close(wire.CloseCode.GOING_AWAY, "the test is over"))
    await sending


def test_the_next_frame_is_begun_while_one_is_sent() -> None:
    async def test() -> None:
        outbox, socket = subscribed(), _Socket()
        _put(outbox, 1)
        second = _put(outbox, 2)
        sending = _sending(outbox, socket)
        await second.is_begun.wait()

        assert socket.taken == []
        socket.free.set()
        await _end(outbox, sending)
        assert socket.taken == [1, 2]
        assert socket.closed == wire.CloseCode.GOING_AWAY

    run(test)


def test_the_next_frame_is_begun_when_the_one_before_leaves_cores_free() -> None:
    async def test() -> None:
        outbox, socket = subscribed(), _Socket()
        first = _put(outbox, 1)
        first.may_end.clear()
        second = _put(outbox, 2)
        sending = _sending(outbox, socket)
        socket.free.set()
        await second.is_begun.wait()

        assert socket.taken == []
        first.may_end.set()
        await _end(outbox, sending)
        assert socket.taken == [1, 2]

    run(test)


def test_a_client_that_takes_longer_to_receive_than_frames_to_compute_gets_the_newest() -> None:
    async def test() -> None:
        outbox, socket = subscribed(depth=1), _Socket()
        _put(outbox, 1, reconstruct_s=0.0)
        sending = _sending(outbox, socket)
        socket.free.set()
        while socket.taken != [1]:
            await asyncio.sleep(0)
        socket.free.clear()
        _put(outbox, 2)  # taken for the client that kept up so far
        for number in (3, 4, 5):
            await asyncio.sleep(0)
            skipped = _put(outbox, number)
            assert not skipped.is_begun.is_set()

        socket.free.set()
        while len(socket.taken) < 3:
            await asyncio.sleep(0)
        assert socket.taken == [1, 2, 5]
        assert socket.notices == [(2, 2)]  # frames 3 and 4, after the one that was taken ahead
        await _end(outbox, sending)

    run(test)


def test_nothing_of_a_stream_is_left_behind_when_its_client_is_gone() -> None:
    async def test() -> None:
        outbox, socket = subscribed(), _Socket()
        frame = _put(outbox, 1)
        sending = _sending(outbox, socket)
        await frame.is_begun.wait()

        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)
        assert asyncio.all_tasks() == {asyncio.current_task()}

    run(test)
