"""The sending half of a stream with a socket and frames that are under the test's control."""

import asyncio
import time
from collections.abc import Iterable
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, cast

from tests.server.broadcast.outboxes import run, subscribed
from transientcam import wire
from transientcam_server.api._stream.sender import Sender
from transientcam_server.broadcast import Close, Outbox
from transientcam_server.imaging import Frame

COMPUTED_S = 0.5
"""What a frame says that its reconstruction took: longer than these tests send for."""


class _Frame:
    """Is computed when the test lets it, and reports that it was begun."""

    def __init__(self, number: int, *, reconstruct_s: float) -> None:
        self.number, self.reconstruct_s = number, reconstruct_s
        self.raw = SimpleNamespace(device_time_s=float(number), host_time_s=time.time())
        self.is_begun, self.may_end = asyncio.Event(), asyncio.Event()
        self.may_end.set()

    async def computed(self, products: Iterable[object]) -> None:
        assert list(products)
        self.is_begun.set()
        await self.may_end.wait()

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


async def _idle() -> None:
    """Let everything run that can."""
    for _ in range(50):
        await asyncio.sleep(0)


def test_frames_are_computed_while_one_is_sent_and_sent_in_order() -> None:
    async def test() -> None:
        outbox, socket = subscribed(depth=3), _Socket()
        frames = [_put(outbox, number) for number in (1, 2, 3)]
        frames[1].may_end.clear()
        sending = _sending(outbox, socket)
        await frames[2].is_begun.wait()

        assert socket.taken == []
        socket.free.set()
        await _idle()
        assert socket.taken == [1]
        frames[1].may_end.set()
        await _end(outbox, sending)
        assert socket.taken == [1, 2, 3]
        assert socket.closed == wire.CloseCode.GOING_AWAY

    run(test)


def test_two_frames_are_computed_at_once_and_a_third_when_one_of_them_is() -> None:
    async def test() -> None:
        outbox, socket = subscribed(depth=3), _Socket()
        frames = [_put(outbox, number) for number in (1, 2, 3)]
        for frame in frames:
            frame.may_end.clear()
        sending = _sending(outbox, socket)
        await frames[1].is_begun.wait()
        await _idle()
        assert not frames[2].is_begun.is_set()

        frames[1].may_end.set()  # whichever it is
        await frames[2].is_begun.wait()
        socket.free.set()
        for frame in frames:
            frame.may_end.set()
        await _end(outbox, sending)
        assert socket.taken == [1, 2, 3]

    run(test)


def test_frames_that_take_long_are_computed_one_after_another() -> None:
    async def test() -> None:
        outbox, socket = subscribed(depth=3), _Socket()
        _put(outbox, 1, reconstruct_s=COMPUTED_S)
        sending = _sending(outbox, socket)
        socket.free.set()
        while socket.taken != [1]:
            await asyncio.sleep(0)
        await _idle()
        frames = [_put(outbox, number) for number in (2, 3, 4)]
        for frame in frames:
            frame.may_end.clear()
        for frame, following in pairwise(frames):
            await frame.is_begun.wait()
            await _idle()
            assert not following.is_begun.is_set()
            frame.may_end.set()
        frames[-1].may_end.set()
        await _end(outbox, sending)
        assert socket.taken == [1, 2, 3, 4]

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
        for number in (2, 3):  # taken for the client that kept up so far
            await _put(outbox, number).is_begun.wait()
        for number in (4, 5, 6):
            skipped = _put(outbox, number)
            await _idle()
            assert not skipped.is_begun.is_set()

        socket.free.set()
        while len(socket.taken) < 4:
            await asyncio.sleep(0)
        assert socket.taken == [1, 2, 3, 6]
        assert socket.notices == [(3, 2)]  # frames 4 and 5, after those that were taken ahead
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
