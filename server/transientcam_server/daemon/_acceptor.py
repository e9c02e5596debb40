"""Accepts connections, and counts them from there on: how many, and how fast they come.

Those beyond a limit are refused unless they switch the light off
(`transientcam_server.daemon._reserve`).
"""

import asyncio
import contextlib
import logging
import socket
import ssl
import time
from collections import Counter
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any, Final

from transientcam_server.daemon._fair_queue import Account, FairQueue
from transientcam_server.daemon._metering import metered
from transientcam_server.daemon._priority import switches_off
from transientcam_server.daemon._rate_limit import RateLimiter
from transientcam_server.daemon._read_limiter import PORTION_BYTES, ReadLimiter
from transientcam_server.daemon._refusals import refusal
from transientcam_server.daemon._reserve import LOOK_S, Candidate, Reserve, arrived
from transientcam_server.errors import Problem, kinds
from transientcam_server.settings import LimitSettings

_log = logging.getLogger("transientcam_server.daemon.acceptor")
AT_ONCE: Final = 16
"""Connections accepted before other tasks run; more where that takes less than `ACCEPT_S`."""
ACCEPT_S: Final = 0.004
"""One that switches the light off waits behind a flood of others until all are accepted."""
PAUSE_S: Final = 0.5
"""Before the next one is accepted where the system has no descriptors left."""
REQUESTS_SHARE: Final = 0.4
"""Of the event loop's thread, for requests and their answers, as far as they are made there."""
UNWATCHED_SHARE: Final = 0.9
"""The same while no frames are sent or recorded."""
STREAMS_SHARE: Final = 0.2
"""Of it, for what the clients of streams send. The rest is for what these are sent."""
PRIORITY_SHARE: Final = 0.2
"""Of it, for requests that switch the light off; they wait for nothing else."""
_REMEMBERED_ADDRESSES: Final = 1024


def turns_of_requests(
    loop: asyncio.AbstractEventLoop,
    *,
    limits: LimitSettings,
    watched: Callable[[], bool],
    clock: Callable[[], float] = time.monotonic,
    spent: Callable[[], float] = time.thread_time,
) -> FairQueue:
    """Return what shares a loop's time between requests: nearly all of it while none watches."""
    return FairQueue(
        loop,
        share=lambda: REQUESTS_SHARE if watched() else UNWATCHED_SHARE,
        share_of_one=lambda: limits.address_share if watched() else UNWATCHED_SHARE,
        clock=clock,
        spent=spent,
    )


class Admission:
    """Decides which connections are accepted.

    ``limits``: how many there may be, together and of one address, and how fast new ones may come.
    ``clock``: time in s.
    """

    def __init__(self, limits: LimitSettings, *, clock: Callable[[], float]) -> None:
        self._limits = limits
        self._clock = clock
        self._open: Counter[str] = Counter()
        self._rates: dict[str, RateLimiter] = {}

    @property
    def open(self) -> int:
        """How many are open."""
        return self._open.total()

    def admit(self, host: str) -> Problem | None:
        """Count a connection from an address, or return why it is refused."""
        most, most_of_one = self._limits.max_connections, self._limits.max_connections_per_address
        rate_hz = self._limits.max_connects_hz
        if not self._rate(host).allow():
            detail = f"More than {rate_hz:g} connections a second came from {host}."
            return Problem(kinds.TOO_MANY_FROM_ONE_ADDRESS, detail, limit=rate_hz)
        if self.open >= most:
            return Problem(kinds.TOO_MANY_CONNECTIONS, f"{most} connections are open.", limit=most)
        if self._open[host] >= most_of_one:
            detail = f"{most_of_one} connections are open from {host}."
            return Problem(kinds.TOO_MANY_FROM_ONE_ADDRESS, detail, limit=most_of_one)
        self._open[host] += 1
        return None

    def release(self, host: str) -> None:
        """Count a connection no more."""
        self._open[host] -= 1
        if not self._open[host]:
            del self._open[host]

    def _rate(self, host: str) -> RateLimiter:
        found = self._rates.get(host)
        if found is None:
            if len(self._rates) >= _REMEMBERED_ADDRESSES:
                self._rates = {key: each for key, each in self._rates.items() if not each.full}
            found = self._rates[host] = RateLimiter(
                self._limits.max_connects_hz,
                burst=self._limits.max_connections_per_address,
                clock=self._clock,
            )
        return found


class Acceptor:
    """Accepts the connections of a listening socket, which stays the caller's.

    ``protocol``: makes the protocol of a connection.
    ``watched``: whether frames are sent or recorded, for which time has to be left.
    ``tls``: with what connections are encrypted; None for not at all.
    ``offs``: as `ReadLimiter` has it.
    """

    def __init__(
        self,
        listener: socket.socket,
        *,
        protocol: Callable[[], asyncio.Protocol],
        limits: LimitSettings,
        watched: Callable[[], bool],
        tls: ssl.SSLContext | None = None,
        offs: Callable[[], int] = lambda: 0,
    ) -> None:
        self._offs = offs
        self._loop = asyncio.get_running_loop()
        self._listener = listener
        self._protocol = protocol
        self._tls = tls
        self._limits = limits
        self._requests = turns_of_requests(self._loop, limits=limits, watched=watched)
        self._streams = FairQueue(
            self._loop, share=lambda: STREAMS_SHARE, share_of_one=lambda: STREAMS_SHARE
        )
        self._first = FairQueue(
            self._loop,
            share=lambda: PRIORITY_SHARE,
            share_of_one=lambda: PRIORITY_SHARE,
            goes_before=(self._requests, self._streams),
        )
        self._admission = Admission(limits, clock=self._loop.time)
        self._reserve = Reserve(
            self._loop, connect=self._connect_beyond, refuse=self._refuse, tls=tls is not None
        )
        self._refusals: dict[str, bytes] = {}
        self._handshakes: set[asyncio.Task[None]] = set()
        self._pause: asyncio.TimerHandle | None = None

    def open(self) -> None:
        """Accept from now on."""
        self._pause = None
        self._loop.add_reader(self._listener, self._accept)

    async def close(self) -> None:
        """Accept nothing more, and give handshakes up; connections that stand are left alone."""
        if self._pause is not None:
            self._pause.cancel()
        self._loop.remove_reader(self._listener)
        self._reserve.close()
        if self._tls is not None:
            # without TLS they are done at once; uvloop would not notify their protocols
            for task in self._handshakes:
                task.cancel()
        await asyncio.gather(*self._handshakes, return_exceptions=True)

    def _accept(self) -> None:
        until_s, accepted = self._loop.time() + ACCEPT_S, 0
        while accepted < AT_ONCE or self._loop.time() < until_s:
            accepted += 1
            try:
                connection, address = self._listener.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                _log.warning("no connection can be accepted for %g s: %s", PAUSE_S, error)
                self._loop.remove_reader(self._listener)
                self._pause = self._loop.call_later(PAUSE_S, self.open)
                return
            connection.setblocking(False)
            self._begin(connection, str(address[0]))

    def _begin(self, connection: socket.socket, host: str) -> None:
        problem = self._admission.admit(host)
        if self._tls is None and switches_off(arrived(connection) or b""):
            self._first.hold_others()  # from now on, not only when it is read in its turn
        if problem is None:
            release = partial(self._admission.release, host)
            connecting = self._connect(connection, host, release, self._offs())
            self._start(connecting, self._requests.account(host))
        else:
            self._reserve.take(connection, host, problem)

    def _connect_beyond(self, candidate: Candidate) -> None:
        release = partial(self._reserve.release, candidate)
        connecting = self._connect(candidate.connection, candidate.host, release, None, candidate)
        self._start(connecting, self._first.account(candidate.host))

    def _start(self, connecting: Coroutine[Any, Any, None], account: Account) -> None:
        task = self._loop.create_task(metered(connecting, account))
        self._handshakes.add(task)
        task.add_done_callback(self._handshakes.discard)

    def _refuse(self, connection: socket.socket, problem: Problem) -> None:
        with contextlib.suppress(OSError):
            if self._tls is None:
                connection.send(self._refusal(problem))
                connection.recv(PORTION_BYTES)  # unread, it would reset the connection
        connection.close()

    def _refusal(self, problem: Problem) -> bytes:
        """Return an answer that a flood requests again and again."""
        known = self._refusals.get(problem.detail)
        if known is None:
            if len(self._refusals) >= _REMEMBERED_ADDRESSES:
                self._refusals.clear()
            known = self._refusals[problem.detail] = refusal(problem)
        return known

    async def _connect(
        self,
        connection: socket.socket,
        host: str,
        release: Callable[[], None],
        offs: int | None,
        candidate: Candidate | None = None,
    ) -> None:
        """Hand a connection to a protocol once its handshake is done."""
        counted = contextlib.ExitStack()
        counted.callback(release)

        def limited() -> ReadLimiter:
            limiter = ReadLimiter(
                self._protocol(),
                requests=self._requests.account(host),
                streams=self._streams.account(host),
                first=self._first.account(host),
                beyond=None if candidate is None else self._refusal(candidate.problem),
                lost=counted.close,
                offs=self._offs,
                arrived=offs if self._tls is None and arrived(connection) else None,
            )
            if candidate is not None:
                candidate.limiter = limiter
                if candidate.refused:
                    limiter.refuse()
            return limiter

        if candidate is not None and candidate.refused and self._tls is None:
            counted.close()
            self._refuse(connection, candidate.problem)
            return
        within_s = self._limits.head_s if candidate is None else min(LOOK_S, self._limits.head_s)
        try:
            await self._loop.connect_accepted_socket(
                limited,
                connection,
                ssl=self._tls,
                ssl_handshake_timeout=None if self._tls is None else within_s,
            )
        except (OSError, EOFError) as error:  # those of TLS among them
            _log.debug("no handshake with %s: %s", host, error)
            counted.close()
            connection.close()
        except BaseException:
            counted.close()
            connection.close()
            raise
