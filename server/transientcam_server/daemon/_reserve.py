"""Connections beyond a limit: a few are read just far enough to see what they ask for.

One that switches the light off is served like any other, and then closed; the others are refused.
Where there are more than `MOST` of them, the address that has the most gives its oldest up, so
that a flood from one address takes nothing from another, and the newest comes first.
"""

import asyncio
import contextlib
import socket
from collections import Counter
from collections.abc import Callable
from typing import Final

from transientcam_server.daemon._priority import switches_off
from transientcam_server.daemon._rate_limit import RateLimiter
from transientcam_server.daemon._read_limiter import PORTION_BYTES, ReadLimiter
from transientcam_server.errors import Problem

MOST: Final = 64
"""Of these connections at the same time, of all addresses together."""
LOOK_S: Final = 1.0
"""Time for a request to be complete; then its connection is refused."""
HANDSHAKES_HZ: Final = 100.0
"""Of TLS, in the reserve; they cost processor time before it is known what a connection asks."""
_HANDSHAKES_AT_ONCE: Final = 16


def arrived(connection: socket.socket) -> bytes | None:
    """Return what has arrived, without taking it; None for nothing yet, empty at the end."""
    try:
        return connection.recv(PORTION_BYTES, socket.MSG_PEEK)
    except (BlockingIOError, InterruptedError):
        return None
    except OSError:
        return b""


class Candidate:
    """A connection beyond a limit; ``refused``: as soon as it is read.

    ``problem``: why it is refused unless it switches the light off.
    ``limiter``: what reads it, as soon as there is a protocol.
    """

    def __init__(self, connection: socket.socket, host: str, problem: Problem) -> None:
        self.connection = connection
        self.host = host
        self.problem = problem
        self.limiter: ReadLimiter | None = None
        self.refused = False
        self.handed_on = False
        self.deadline: asyncio.TimerHandle | None = None

    @property
    def served(self) -> bool:
        """Whether it switches the light off."""
        return self.limiter is not None and self.limiter.first


class Reserve:
    """Holds connections beyond a limit until it is known what they ask for.

    ``connect``: begins to hand a connection to a protocol within `LOOK_S`; `release` is called
    when that has ended.
    ``refuse``: answers a connection that has no protocol with a problem, and closes it.
    ``tls``: whether connections are encrypted, so that it takes a handshake to know what they ask.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        *,
        connect: Callable[[Candidate], None],
        refuse: Callable[[socket.socket, Problem], None],
        tls: bool,
    ) -> None:
        self._loop = loop
        self._connect = connect
        self._refuse = refuse
        self._tls = tls
        self._candidates: dict[Candidate, None] = {}
        self._speaking: list[Candidate] = []
        self._handshakes = RateLimiter(HANDSHAKES_HZ, burst=_HANDSHAKES_AT_ONCE, clock=loop.time)
        self._later: asyncio.TimerHandle | None = None

    def take(self, connection: socket.socket, host: str, problem: Problem) -> None:
        """Take a connection that was accepted beyond a limit."""
        if len(self._candidates) >= MOST:
            self._give_up(self._least())
        candidate = Candidate(connection, host, problem)
        self._candidates[candidate] = None
        if self._look(candidate):
            return
        candidate.deadline = self._loop.call_later(LOOK_S, self._too_late, candidate)
        if not candidate.handed_on and candidate not in self._speaking:
            self._loop.add_reader(connection, self._speaks, candidate)

    def release(self, candidate: Candidate) -> None:
        """Count a connection no more."""
        if candidate.deadline is not None:
            candidate.deadline.cancel()
        self._candidates.pop(candidate, None)

    def close(self) -> None:
        """Refuse what is not known yet."""
        for candidate in [each for each in self._candidates if not each.served]:
            self._give_up(candidate)

    def _least(self) -> Candidate:
        """Return the oldest of the address that has the most, of those not served if there is."""
        count = Counter(each.host for each in self._candidates)
        return max(self._candidates, key=lambda each: (count[each.host], not each.served))

    def _speaks(self, candidate: Candidate) -> None:
        self._loop.remove_reader(candidate.connection)
        self._look(candidate)

    def _look(self, candidate: Candidate) -> bool:
        """Look at what has arrived, without taking it; return whether the connection has ended."""
        begin = arrived(candidate.connection)
        if begin is None:
            return False
        if not begin:  # its client has gone
            self.release(candidate)
            candidate.connection.close()
            return True
        if self._tls:
            self._speaking.append(candidate)
            self._shake_hands()
            return False
        if switches_off(begin) is not False:
            self._hand_on(candidate)
            return False
        self._give_up(candidate)
        return True

    def _shake_hands(self) -> None:
        """Begin the handshakes that there is time for, that of the newest first."""
        while self._speaking and self._handshakes.allow():
            self._hand_on(self._speaking.pop())
        if self._speaking and self._later is None:
            self._later = self._loop.call_later(1.0 / HANDSHAKES_HZ, self._shake_hands_again)

    def _shake_hands_again(self) -> None:
        self._later = None
        self._shake_hands()

    def _too_late(self, candidate: Candidate) -> None:
        if not candidate.served:
            self._give_up(candidate)

    def _hand_on(self, candidate: Candidate) -> None:
        candidate.handed_on = True
        self._connect(candidate)

    def _give_up(self, candidate: Candidate) -> None:
        self.release(candidate)
        if candidate in self._speaking:
            self._speaking.remove(candidate)
        if candidate.limiter is not None:
            candidate.limiter.refuse()
            if not self._tls:
                with contextlib.suppress(OSError):  # unread, it would reset the connection
                    candidate.connection.recv(PORTION_BYTES)
        elif candidate.handed_on:
            candidate.refused = True
        else:
            self._loop.remove_reader(candidate.connection)
            self._refuse(candidate.connection, candidate.problem)
