"""The queue of plans: one is computed at a time, few may wait, and frames go first.

What plans is pure Python in large part: beside it, on another thread, whatever else holds the
interpreter's lock for a moment waits for it, above all frames and their clients.
"""

import asyncio
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final, TypeVar

from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.imaging.workers import Workers

MOST: Final = 8
"""Places: requests whose plan or front is computed, or is next."""
MOST_OF_ONE: Final = 4
"""Of one address."""
WAIT_S: Final = 10.0
RETRY_AFTER_S: Final = 10
WATCHED_SHARE: Final = 0.25
"""Of one processor, that planning takes for good while frames are sent or recorded."""
AT_ONCE_S: Final = 20.0
"""Processor time that planning may take before: that of a look, a plan and a front."""
_T = TypeVar("_T")


class PlanningQueue:
    """Lets requests wait for plans; on the event loop, and what is planned on a worker.

    Parameters
    ----------
    workers
        That plan.
    wait_s
        How long a request waits for a place.
    """

    def __init__(self, workers: Workers, *, wait_s: float = WAIT_S) -> None:
        self._workers = workers
        self._wait_s = wait_s
        self._one_at_a_time = asyncio.Lock()
        self._change = asyncio.Condition()
        self._placed: Counter[str] = Counter()
        self._work: asyncio.Future[Any] | None = None
        self._closing = False

    @asynccontextmanager
    async def place_of(self, client: str) -> AsyncIterator[None]:
        """Count a request of an address until the block ends, once there is a place for it.

        Waiting costs nothing: a client that is refused at once asks again at once.

        Raises
        ------
        Problem
            ``planning-busy`` where no place comes free in time, ``shutting-down`` from `close` on.
        """
        async with self._change:
            try:
                async with asyncio.timeout(self._wait_s):
                    await self._change.wait_for(lambda: self._closing or self._has_room(client))
            except TimeoutError:
                raise self._busy(client) from None
            if self._closing:
                raise _closing()
            self._placed[client] += 1
        try:
            yield
        finally:
            self._placed[client] -= 1
            self._placed += Counter()  # forgets those that have none
            async with self._change:
                self._change.notify_all()

    async def run(self, compute: Callable[..., _T], *arguments: object) -> _T:
        """Return the result of ``compute`` on a worker, when no other plan is computed.

        Raises
        ------
        Problem
            ``shutting-down`` from `close` on.
        """
        async with self._one_at_a_time:
            if self._closing:
                raise _closing()
            work = asyncio.ensure_future(self._workers.run_long(compute, *arguments))
            self._work = work
            try:
                value, _ = await work
            except asyncio.CancelledError:
                if self._closing:
                    raise _closing() from None
                raise
        return value

    async def close(self) -> None:
        """End all that waits, without waiting until the worker notices."""
        self._closing = True
        if self._work is not None:
            self._work.cancel()
        async with self._change:
            self._change.notify_all()

    def _has_room(self, client: str) -> bool:
        return self._placed[client] < MOST_OF_ONE and self._placed.total() < MOST

    def _busy(self, client: str) -> Problem:
        total, theirs = self._placed.total(), self._placed[client]
        return Problem(
            kinds.PLANNING_BUSY,
            f"{total} requests wait for plans, {theirs} of them from {client}.",
            limit=f"{MOST} requests, {MOST_OF_ONE} of one address",
            retry_after_s=RETRY_AFTER_S,
        )


def _closing() -> Problem:
    return Problem(kinds.SHUTTING_DOWN, "The service is shutting down.")


class Allowance:
    """Processor time that planning may take at once, before it has to keep to a share.

    It is used up by what is planned, and comes back at the share; so a plan now and then is
    computed without a rest, and one after the other keep to the share.

    Parameters
    ----------
    share
        Returns the share of one processor, above 0 to 1, that may be taken now for good.
    at_once_s
        Processor time that may be taken beyond it.
    now_s
        The time.
    """

    def __init__(
        self,
        share: Callable[[], float],
        *,
        at_once_s: float = AT_ONCE_S,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._share = share
        self._most_s = at_once_s
        self._now_s = now_s
        self._left_s = at_once_s
        self._since_s = now_s()
        self._lock = threading.Lock()

    def take(self, cpu_s: float) -> float:
        """Note what was computed, and return how long to rest now, in s."""
        share = self._share()
        with self._lock:
            now_s = self._now_s()
            back_s = share * (now_s - self._since_s)
            self._since_s = now_s
            self._left_s = min(self._left_s + back_s - cpu_s, self._most_s)
            if share >= 1.0:
                self._left_s = max(self._left_s, 0.0)
            return max(-self._left_s / share, 0.0)


class Rest:
    """Lets the work of one thread rest in between, as its allowance says.

    Parameters
    ----------
    allowance
        Of all planning.
    wait
        Waits for so many seconds; may end sooner.
    cpu_s
        Processor time of the thread, which counts from now on.
    """

    def __init__(
        self,
        allowance: Allowance,
        wait: Callable[[float], object],
        *,
        cpu_s: Callable[[], float] = time.thread_time,
    ) -> None:
        self._allowance = allowance
        self._wait = wait
        self._cpu_s = cpu_s
        self._since_s = cpu_s()

    def __call__(self) -> None:
        """Rest for what was computed since the last call."""
        rest_s = self._allowance.take(self._cpu_s() - self._since_s)
        if rest_s:
            self._wait(rest_s)
        self._since_s = self._cpu_s()
