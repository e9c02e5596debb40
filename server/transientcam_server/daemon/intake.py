"""What clients send, in portions: a flood on one connection delays no other one.

Between the transport of a connection and its protocol stands an `Intake`. It reads no more than
`PORTION_BYTES` at once, and hands them over when `Turns` has time for them: handling what clients
send takes no more than `SHARE` of the event loop's thread, and each connection has its turn.
"""

import asyncio
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Final, cast

PORTION_BYTES: Final = 2048
"""Read of one connection at once: 340 of the smallest WebSocket frames, 1.5 ms of parsing."""
SHARE: Final = 0.3
"""Of the event loop's thread, for what clients send; the rest is for what they are sent."""
BURST_S: Final = 0.01
"""Processor time that may be spent at once where little was spent before."""
_LEAST_PAUSE_S: Final = 0.001


class Turns:
    """Shares the time of an event loop between the connections from which bytes have arrived.

    Parameters
    ----------
    loop
        Whose time is shared.
    clock
        Real time in s.
    spent
        Processor time of this thread in s.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        *,
        clock: Callable[[], float] = time.monotonic,
        spent: Callable[[], float] = time.thread_time,
    ) -> None:
        self.buffer = memoryview(bytearray(PORTION_BYTES))
        self._loop = loop
        self._clock = clock
        self._spent = spent
        self._waiting: deque[Callable[[], None]] = deque()
        self._left_s = BURST_S
        self._counted_s = clock()
        self._timer: asyncio.TimerHandle | None = None

    def run(self, work: Callable[[], None]) -> bool:
        """Run ``work`` now if there is time and no other waits, in its turn otherwise.

        Returns whether it has run.
        """
        if not self._waiting and self._has_time():
            self._do(work)
            return True
        self._waiting.append(work)
        self._go_on_later()
        return False

    def _serve(self) -> None:
        self._timer = None
        while self._waiting and self._has_time():
            self._do(self._waiting.popleft())
        if self._waiting:
            self._go_on_later()

    def _do(self, work: Callable[[], None]) -> None:
        begin_s = self._spent()
        try:
            work()
        finally:
            self._left_s -= self._spent() - begin_s

    def _has_time(self) -> bool:
        now_s = self._clock()
        self._left_s = min(BURST_S, self._left_s + SHARE * (now_s - self._counted_s))
        self._counted_s = now_s
        return self._left_s > 0.0

    def _go_on_later(self) -> None:
        if self._timer is None:
            pause_s = max(_LEAST_PAUSE_S, -self._left_s / SHARE)
            self._timer = self._loop.call_later(pause_s, self._serve)


class Intake(asyncio.BufferedProtocol):
    """Reads a connection for a protocol, portion by portion.

    Parameters
    ----------
    protocol
        An `asyncio.Protocol`; its transport is a `Valve`.
    turns
        Of the event loop that all this runs on.
    lost
        Called once when the connection has ended.
    """

    def __init__(
        self, protocol: asyncio.Protocol, turns: Turns, *, lost: Callable[[], None]
    ) -> None:
        self.protocol = protocol
        self.turns = turns
        self._lost = lost
        self._valve: Valve | None = None
        self._portion = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Hand the connection on."""
        self._valve = Valve(cast("asyncio.Transport", transport), self)
        self.protocol.connection_made(cast("asyncio.Transport", self._valve))

    def connection_lost(self, exc: Exception | None) -> None:
        """Hand the loss on, and forget what was not handed over."""
        self._portion = b""
        self._lost()
        self.protocol.connection_lost(exc)

    def get_buffer(self, sizehint: int) -> memoryview:
        """Return the buffer of all connections: it is emptied before another one reads."""
        return self.turns.buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Take a portion, and hand it over in turn."""
        assert self._valve is not None  # noqa: S101 - bytes come after the connection
        self._portion += bytes(self.turns.buffer[:nbytes])
        if not self.turns.run(self.hand_over):
            self._valve.shut("turn")

    def hand_over(self) -> None:
        """Hand the portion over, unless the protocol reads nothing for now."""
        valve = self._valve
        assert valve is not None  # noqa: S101 - bytes come after the connection
        if valve.held or not self._portion:
            return
        portion, self._portion = self._portion, b""
        if not valve.is_closing():
            self.protocol.data_received(portion)
        valve.open("turn")

    def eof_received(self) -> bool | None:
        """Hand it on."""
        return self.protocol.eof_received()

    def pause_writing(self) -> None:
        """Hand it on."""
        self.protocol.pause_writing()

    def resume_writing(self) -> None:
        """Hand it on."""
        self.protocol.resume_writing()

    @property
    def waits(self) -> bool:
        """Whether a portion was not handed over yet."""
        return bool(self._portion)


class Valve:
    """The transport that a protocol behind an `Intake` has: the real one, but for reading."""

    def __init__(self, transport: asyncio.Transport, intake: Intake) -> None:
        self._transport = transport
        self._intake = intake
        self._reasons: set[str] = set()
        self._shut = False
        self.write = transport.write
        self.writelines = transport.writelines
        self.is_closing = transport.is_closing

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    @property
    def held(self) -> bool:
        """Whether the protocol reads nothing for now."""
        return "protocol" in self._reasons or "work" in self._reasons

    def pause_reading(self) -> None:
        """Read nothing more for now."""
        self.shut("protocol")

    def resume_reading(self) -> None:
        """Read on."""
        self.open("protocol")
        self._hand_over()

    def hold(self) -> None:
        """Read nothing more until `release`, whatever `resume_reading` says."""
        self.shut("work")

    def release(self, work: Callable[[], None]) -> None:
        """Read on after ``work``, which has its turn like what arrives, and may `hold` again."""

        def go_on() -> None:
            self._reasons.discard("work")
            if not self.is_closing():
                work()
            self._settle()
            self._hand_over()

        self._intake.turns.run(go_on)

    def set_protocol(self, protocol: asyncio.Protocol) -> None:
        """Hand everything to another protocol from now on."""
        self._intake.protocol = protocol

    def get_protocol(self) -> asyncio.Protocol:
        """Return the protocol."""
        return self._intake.protocol

    def shut(self, reason: str) -> None:
        """Read nothing more while this reason lasts."""
        self._reasons.add(reason)
        self._settle()

    def open(self, reason: str) -> None:
        """Read on where no other reason is left."""
        if reason in self._reasons:
            self._reasons.discard(reason)
            self._settle()

    def _settle(self) -> None:
        shut = bool(self._reasons)
        if shut == self._shut or self.is_closing():
            return
        self._shut = shut
        if shut:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()

    def _hand_over(self) -> None:
        if self._intake.waits and not self.held:
            self._intake.turns.run(self._intake.hand_over)
