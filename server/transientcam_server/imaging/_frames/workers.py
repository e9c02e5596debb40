"""Workers that compute for the event loop, and what they have in progress.

Everything here lives on the event loop and computes nothing there.
"""

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import Executor, Future, wait
from contextlib import contextmanager
from typing import Any, TypeVar

_log = logging.getLogger("transientcam_server.imaging.workers")
_T = TypeVar("_T")


class Workers:
    """Runs functions on an executor of ``count`` workers.

    Long work never takes the last free worker, so that new frames are computed beside it.
    """

    def __init__(self, executor: Executor, *, count: int) -> None:
        self._executor = executor
        self._long = asyncio.Semaphore(count - 1)
        self._tasks: set[asyncio.Task[Any]] = set()
        self._running: set[Future[Any]] = set()
        self._failing: set[str] = set()
        self._frames = 0

    async def run(self, compute: Callable[..., _T], *arguments: Any) -> tuple[_T, float]:
        """Return the result of ``compute`` on a worker, and the seconds it took there."""
        future = self._executor.submit(_timed, compute, *arguments)
        self._running.add(future)
        future.add_done_callback(self._running.discard)
        return await asyncio.wrap_future(future)

    async def run_long(self, compute: Callable[..., _T], *arguments: Any) -> tuple[_T, float]:
        """Do as `run` does, but never on the last free worker."""
        async with self._long:
            return await self.run(compute, *arguments)

    @contextmanager
    def one_more_frame(self) -> Iterator[bool]:
        """Count a frame as being reconstructed; give whether it is the only one."""
        self._frames += 1
        try:
            yield self._frames == 1
        finally:
            self._frames -= 1

    def start(self, work: Coroutine[Any, Any, _T]) -> "asyncio.Task[_T]":
        """Start a task that several callers may wait for; `close` cancels it."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._finished)
        return task

    async def close(self, *, within_s: float) -> bool:
        """Cancel every task that was started, and return whether all that computed has ended."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        running = set(self._running)
        return not (await asyncio.to_thread(wait, running, timeout=within_s)).not_done

    def note_failure(self, product: str, number: int) -> None:
        """Log the failure of a product, the first of a series; call it in an except clause."""
        if product not in self._failing:
            self._failing.add(product)
            _log.exception("frame %d: making %s failed", number, product)

    def note_success(self, product: str) -> None:
        """Note that a product works, so that its next failure is logged again."""
        self._failing.discard(product)

    def _finished(self, task: "asyncio.Task[Any]") -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # retrieved here, or asyncio logs it where no caller is left


def _timed(compute: Callable[..., _T], *arguments: Any) -> tuple[_T, float]:
    begin_s = time.perf_counter()
    value = compute(*arguments)
    return value, time.perf_counter() - begin_s
