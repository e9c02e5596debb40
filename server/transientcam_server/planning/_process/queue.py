"""The queue of plans: one is computed at a time, and few may wait."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final, Protocol, TypeVar

from transientcam_server.errors import Problem, kinds

Report = Callable[[float, str], None]
"""Takes the share that is done, 0 to 1, and the present step; what it raises ends the work."""
Show = Callable[[dict[str, Any]], None]
"""Takes what there is of the result so far, as JSON."""


class Progress:
    """Steps of work, reported by the work itself.

    ``report``: receives all that becomes known; called from the thread of the work.
    ``first``, ``last``: shares of the whole at which this work begins and ends.
    ``show``: receives the result as far as there is one; called from the thread of the work.
    """

    def __init__(
        self,
        report: Report = lambda share, step: None,
        *,
        first: float = 0.0,
        last: float = 1.0,
        show: Show = lambda document: None,
    ) -> None:
        self._report = report
        self.show = show
        self._first, self._last = first, last
        self._now = first, "waiting"

    def __call__(self) -> None:
        """Ask whether to go on, at the same step."""
        self._report(*self._now)

    def at(self, share: float, step: str) -> None:
        """Report the share of this work that is done, and what is next."""
        whole = self._first + (self._last - self._first) * min(share, 1.0)
        self._now = whole, step
        self()

    def part(self, first: float, last: float, *, show: Show | None = None) -> "Progress":
        """Return the progress of work that is a part of this; ``show`` in the place of its own.

        What the part reports is where the whole is from then on, too.
        """
        span = self._last - self._first

        def report(share: float, step: str) -> None:
            self._now = share, step
            self._report(share, step)

        return Progress(
            report,
            first=self._first + span * first,
            last=self._first + span * last,
            show=show or self.show,
        )


MOST: Final = 8
"""Places: requests whose plan or front is computed, or is next."""
MOST_OF_ONE: Final = 4
"""Of one address."""
WAIT_S: Final = 10.0
RETRY_AFTER_S: Final = 10
IDLE_S: Final = 60.0
"""After which the process that plans is ended, until it is needed again."""
_T = TypeVar("_T")


class Planning(Protocol):
    """Computes plans, one at a time; `PlanningProcess` does."""

    def run(self, compute: Callable[..., _T], *arguments: object, progress: Progress) -> _T:
        """Return ``compute(*arguments, progress)``; what ``progress`` raises ends the work."""
        ...

    def prepare(self) -> None:
        """Get ready for a first plan; returns at once."""
        ...

    def leave(self) -> None:
        """Give memory back where nothing is computed."""
        ...

    def close(self) -> None:
        """End what is computed."""
        ...


class PlanningQueue:
    """Lets requests wait for plans; on the event loop, and what is planned in another process.

    ``process``: that plans.
    ``wait_s``: how long a request waits for a place.
    ``idle_s``: how long the process stays for the next plan.
    """

    def __init__(
        self, process: Planning, *, wait_s: float = WAIT_S, idle_s: float = IDLE_S
    ) -> None:
        self._process = process
        self._wait_s = wait_s
        self._idle_s = idle_s
        self._idle: asyncio.TimerHandle | None = None
        self._one_at_a_time = asyncio.Lock()
        self._change = asyncio.Condition()
        self._placed: Counter[str] = Counter()
        self._work: asyncio.Future[Any] | None = None
        self._closing = False

    @asynccontextmanager
    async def place_of(self, client: str) -> AsyncIterator[None]:
        """Count a request of an address until the block ends, once there is a place for it.

        Waiting costs nothing: a client that is refused at once asks again at once.
        Raises Problem ``planning-busy`` where no place comes free in time, ``shutting-down`` from
        `close` on.
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

    def prepare(self) -> None:
        """Have the process ready for a first plan, for as long as it stays for a next one."""
        if not self._closing:
            self._process.prepare()
            self._leave_when_idle()

    async def run(self, compute: Callable[..., _T], *arguments: object, progress: Progress) -> _T:
        """Return ``compute(*arguments, progress)`` of the process, when no other plan is computed.

        Raises Problem ``shutting-down`` from `close` on.
        """
        async with self._one_at_a_time:
            if self._closing:
                raise _closing()
            self._stay()
            # a thread that waits, and none of the workers
            work = asyncio.ensure_future(
                asyncio.to_thread(self._process.run, compute, *arguments, progress=progress)
            )
            self._work = work
            try:
                return await work
            except asyncio.CancelledError:
                if self._closing:
                    raise _closing() from None
                raise
            finally:
                if not self._closing:
                    self._leave_when_idle()

    async def close(self) -> None:
        """End all that waits, without waiting until the process has ended."""
        self._closing = True
        self._stay()
        self._process.close()
        if self._work is not None:
            self._work.cancel()
        async with self._change:
            self._change.notify_all()

    def _leave_when_idle(self) -> None:
        self._stay()
        loop = asyncio.get_running_loop()
        self._idle = loop.call_later(self._idle_s, self._process.leave)

    def _stay(self) -> None:
        if self._idle is not None:
            self._idle.cancel()
            self._idle = None

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
