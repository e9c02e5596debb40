"""What clients send, in portions: a flood on one connection delays no other one.

Between the transport of a connection and its protocol stands a `ReadLimiter`. It reads no more
than `PORTION_BYTES` at once, and hands them over when `FairQueue` has time for its address. What
switches the light off waits for nothing but its like.
"""

import asyncio
import threading
from collections.abc import Callable
from typing import Any, Final, cast

from transientcam_server.daemon._fair_queue import Account
from transientcam_server.daemon._priority import switches_off

PORTION_BYTES: Final = 2048
"""Read of one connection at once: 340 of the smallest WebSocket frames, 1.5 ms of parsing."""


class _Portion(threading.local):
    """A buffer for all connections of one loop: it is emptied before another one reads."""

    def __init__(self) -> None:
        self.buffer = memoryview(bytearray(PORTION_BYTES))


_portion: Final = _Portion()
"""Of each thread: several services in one process have a loop each."""


class ReadLimiter(asyncio.BufferedProtocol):
    """Reads a connection for a protocol, portion by portion.

    ``protocol``: an `asyncio.Protocol`; its transport is a `Valve`.
    ``requests``, ``streams``: what the address of the client has of the time for requests, and for
    WebSockets.
    ``first``: what it has for requests that switch the light off.
    ``beyond``: how a connection beyond a limit is refused whose first request is another one; None
    within the limits.
    ``lost``: called once when the connection has ended.
    ``offs``, ``arrived``: how often the light was to go off; when the first request arrived, if any
    of it is here.
    """

    def __init__(
        self,
        protocol: asyncio.Protocol,
        *,
        requests: Account,
        streams: Account,
        first: Account,
        lost: Callable[[], None],
        beyond: bytes | None = None,
        offs: Callable[[], int] = lambda: 0,
        arrived: int | None = None,
    ) -> None:
        self.protocol = protocol
        self.account = requests
        self.beyond = beyond
        self._requests = requests
        self._streams = streams
        self._first = first
        self._lost = lost
        self._now = offs
        self._last_offs = self.offs = arrived
        self._refused = False
        self._begun: bytes | None = b""  # what may become a request that goes first
        self._valve: Valve | None = None
        self._portion = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Hand the connection on."""
        self._valve = Valve(cast("asyncio.Transport", transport), self)
        self.protocol.connection_made(cast("asyncio.Transport", self._valve))
        if self._refused:
            self.refuse()

    def connection_lost(self, exc: Exception | None) -> None:
        """Hand the loss on, and forget what was not handed over."""
        self._portion = b""
        self.account.done()
        self._lost()
        self.protocol.connection_lost(exc)

    def get_buffer(self, sizehint: int) -> memoryview:
        """Return the buffer."""
        return _portion.buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Take a portion, and hand it over in turn."""
        assert self._valve is not None  # noqa: S101 - bytes come after the connection
        portion = bytes(_portion.buffer[:nbytes])
        self._portion += portion
        self._last_offs = self._now()
        self.offs = self._last_offs if self.offs is None else self.offs
        goes_first = self._goes_first(portion)
        if self.beyond is not None and not goes_first:
            if goes_first is False:
                self.refuse()
            return
        if not self.account.run(self.hand_over) and goes_first is not None:
            self._valve.shut("turn")

    def _goes_first(self, portion: bytes) -> bool | None:
        """Return whether what arrived completes a request that goes first; None if it may yet."""
        if self._begun is None:
            return self.first
        self._begun += portion
        goes_first = switches_off(self._begun)
        if goes_first is not None:
            self._begun = None
        if goes_first:
            self.account = self._first
        return goes_first

    @property
    def first(self) -> bool:
        """Whether a request is under way that goes before all others."""
        return self.account is self._first

    def expect(self, *, more: bool) -> None:
        """Look at the next request; ``more`` if a part of it came with the last one."""
        self.account.done()
        self.account = self._requests
        here = more or bool(self._portion)
        self._begun, self.offs = (None, self._last_offs) if here else (b"", None)

    def refuse(self) -> None:
        """Answer with the refusal, and end the connection; as soon as there is one."""
        self._refused = True
        if self._valve is not None and not self._valve.is_closing():
            self._valve.write(self.beyond or b"")
            self._valve.close()

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

    def upgrade(self, protocol: asyncio.Protocol) -> None:
        """Hand everything to the protocol of a WebSocket from now on."""
        self.protocol = protocol
        self.account, self._begun = self._streams, None

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
    """The transport that a protocol behind a `ReadLimiter` has: the real one, but for reading."""

    def __init__(self, transport: asyncio.Transport, limiter: ReadLimiter) -> None:
        self._transport = transport
        self._limiter = limiter
        self._reasons: set[str] = set()
        self._shut = False
        self.write = transport.write
        self.writelines = transport.writelines
        self.is_closing = transport.is_closing

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    @property
    def account(self) -> Account:
        """What the address of the client has of the loop's time."""
        return self._limiter.account

    @property
    def beyond(self) -> bool:
        """Whether the connection is one beyond a limit, which has one request."""
        return self._limiter.beyond is not None

    def expect(self, *, more: bool) -> None:
        """Note that the next request is expected; ``more`` if a part of it is here."""
        self._limiter.expect(more=more)

    @property
    def offs(self) -> int | None:
        """How often the light was to go off when the request arrived."""
        return self._limiter.offs

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

        self._limiter.account.run(go_on)

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        """Hand everything to another protocol from now on; there is one, that of WebSockets."""
        self._limiter.upgrade(cast("asyncio.Protocol", protocol))

    def get_protocol(self) -> asyncio.Protocol:
        """Return the protocol."""
        return self._limiter.protocol

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
        if self._limiter.waits and not self.held:
            self._limiter.account.run(self._limiter.hand_over)
