"""Threads that wait for the disk, so that nothing else does.

A disk that does not answer, as one on a network that is gone, holds whoever calls it, for as long
as it likes. It then has these few threads, and each request ends in time, with ``disk-stalled``.
"""

import asyncio
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from queue import SimpleQueue
from typing import Any, Final, TypeVar

from transientcam_server.errors import Problem, kinds

DISK_THREADS: Final = ("disk", "recorder", "recovery")
"""What the names of threads begin with that may wait for a disk for ever; the end of the process
does not wait for them."""
_COUNT: Final = 6
_LONGEST_S: Final = 60.0
_T = TypeVar("_T")
_Work = tuple[Future[Any], Callable[[], Any]]


class DiskThreads:
    """Runs work that waits for the disk.

    ``stalled_s``: how long nothing is done before the disk is said to be stalled.
    ``activity``: returns what changes while the disk does something.
    ``around``: is given work on the caller's thread, and returns what is done in place of it.
    """

    around: Callable[[Callable[[], Any]], Callable[[], Any]]

    def __init__(
        self,
        *,
        stalled_s: float,
        activity: Callable[[], object] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._stalled_s = stalled_s
        self._activity = activity
        self._clock = clock
        self.around = lambda work: work
        self._waiting: SimpleQueue[_Work | None] = SimpleQueue()
        self._idle = threading.Semaphore(0)
        self._threads = 0
        self._began_s: dict[int, float] = {}

    @property
    def waiting_s(self) -> float:
        """How long the longest work has waited for the disk."""
        began_s = list(self._began_s.values())  # threads change it meanwhile
        return self._clock() - min(began_s) if began_s else 0.0

    async def run(self, work: Callable[..., _T], *arguments: Any) -> _T:
        """Return the result of ``work`` on one of the threads.

        Raises Problem ``disk-stalled``, if nothing is done for so long. Work that has begun goes
        on.
        """
        result = asyncio.wrap_future(self.submit(work, *arguments))
        latest_s = self._clock() + max(_LONGEST_S, self._stalled_s)
        try:
            while True:
                before = self._activity()
                await asyncio.wait((result,), timeout=self._stalled_s)
                if result.done():
                    return result.result()
                if self._activity() == before or self._clock() > latest_s:
                    raise stalled(self._stalled_s)
        finally:
            result.cancel()  # what has not begun never does

    def submit(self, work: Callable[..., _T], *arguments: Any) -> "Future[_T]":
        """Begin ``work`` on one of the threads, as soon as one is free."""
        future: Future[_T] = Future()
        self._waiting.put((future, self.around(partial(work, *arguments))))
        if not self._idle.acquire(blocking=False) and self._threads < _COUNT:
            self._threads += 1
            threading.Thread(
                target=self._serve, name=f"{DISK_THREADS[0]}-{self._threads}", daemon=True
            ).start()
        return future

    def close(self) -> None:
        """End the threads that do not wait for the disk."""
        for _ in range(self._threads):
            self._waiting.put(None)

    def _serve(self) -> None:
        me = threading.get_ident()
        while (next_one := self._waiting.get()) is not None:
            future, work = next_one
            if future.set_running_or_notify_cancel():
                self._began_s[me] = self._clock()
                try:
                    done = partial(future.set_result, work())
                except BaseException as error:
                    done = partial(future.set_exception, error)
                del self._began_s[me]
                done()
                del done
            del next_one, future, work
            self._idle.release()


def stalled(since_s: float) -> Problem:
    """Return the problem of a disk that does not answer."""
    detail = f"The disk of the recordings has not answered for {since_s:g} s."
    return Problem(kinds.DISK_STALLED, detail, limit=since_s, retry_after_s=round(max(1, since_s)))
