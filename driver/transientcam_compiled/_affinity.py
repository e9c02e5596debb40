"""Threads that work beside the thread that calls them, on other processors than its own."""

import ctypes
import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any, cast


def _find_processor() -> Callable[[], int]:
    """Return what says on which processor the calling thread runs; less than 0: not known."""
    with suppress(OSError, AttributeError, TypeError):  # the C library has no such function
        if hasattr(os, "sched_setaffinity"):
            return cast("Callable[[], int]", ctypes.CDLL(None).sched_getcpu)
    return lambda: -1


_processor = _find_processor()


class ThreadsApart(ThreadPoolExecutor):
    """Threads that leave the processor of the thread which submits work to them.

    Linux wakes a thread where it ran last if that processor is idle, and else beside the thread
    that wakes it. A virtual machine takes its idle processors for busy (``vcpu_is_preempted``):
    there all threads share the caller's until the scheduler moves them, after some 20 ms of work,
    and a film takes one. Where a system cannot say, it places the threads by itself.

    ``threads``: how many there are at most.
    ``name``: how their names begin.
    ``processor``: returns the processor that the calling thread runs on, or less than 0.
    """

    def __init__(self, threads: int, name: str, processor: Callable[[], int] = _processor) -> None:
        self._processor = processor
        self._native_ids: list[int] = []
        self._placed: tuple[int, int, frozenset[int]] | None = None
        super().__init__(threads, name, initializer=self._begin)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """As of `ThreadPoolExecutor`, off the processor that this runs on."""
        here = self._processor()
        if here >= 0:
            self._leave(here)
        return super().submit(fn, *args, **kwargs)

    def _begin(self) -> None:
        self._native_ids.append(threading.get_native_id())

    def _leave(self, processor: int) -> None:
        """Let the threads use all processors that the calling thread may use, but for this one."""
        allowed = frozenset(os.sched_getaffinity(0))
        placed = processor, len(self._native_ids), allowed
        if placed == self._placed:
            return
        self._placed = placed
        for native_id in self._native_ids.copy():
            with suppress(OSError):  # a sandbox may forbid it
                os.sched_setaffinity(native_id, allowed - {processor} or allowed)
