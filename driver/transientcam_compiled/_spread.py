"""Parts of an image for several threads: kernels release the interpreter while they run."""

import ctypes
import itertools
import math
import os
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final, Protocol, cast

_CONTROL_GROUPS: Final = Path("/sys/fs/cgroup")
_MEMBERSHIP: Final = Path("/proc/self/cgroup")
BLOCK = 1 << 15
"""Pixels that stay in the caches from one kernel to the next.

After each kernel a thread waits for the interpreter's lock, so that fewer would cost more.
"""
LARGE = 1 << 16
"""Pixels from which an image is cut into parts of `BLOCK`."""

Part = Callable[[int, int], None]
"""Works on the pixels (or rows) from its first argument up to its second."""


class Spread(Protocol):
    """Has ``total`` pixels worked on, in parts that begin at multiples of ``unit``."""

    def __call__(self, part: Part, total: int, /, unit: int = 1024, each: int = 1) -> None:
        """Return when all parts are done, of which there are up to ``each`` for each thread."""


def at_once(part: Part, total: int, /, unit: int = 1024, each: int = 1) -> None:
    """Do everything in one part, on the calling thread."""
    part(0, total)


def over(executor: Executor, parts: int) -> Spread:
    """Return a way to do up to ``parts`` parts of an image at once, on the threads of an executor.

    The calling thread works, too, and waits for the others. Large images are cut into more parts,
    as are all where several are asked for each thread: it takes the next one when it has done one,
    so that none waits long for another that is late or has other work. No part is smaller than a
    unit.
    """

    def spread(part: Part, total: int, /, unit: int = 1024, each: int = 1) -> None:
        size = max(unit, -(-total // (parts * each * unit)) * unit)
        if total >= LARGE:
            size = min(size, max(unit, BLOCK // unit * unit))
        cuts = [0, *range(size, total - unit + 1, size), total]
        # a thread still holds what it was submitted after it is done: of the part, and so of the
        # results, nothing but this queue may be there
        waiting = deque(partial(part, *cut) for cut in itertools.pairwise(cuts))
        del part

        def work() -> None:
            while waiting:
                try:
                    do = waiting.popleft()
                except IndexError:  # another thread was quicker
                    return
                do()

        others = [executor.submit(work) for _ in range(min(parts, len(waiting)) - 1)]
        work()
        for other in others:
            if not other.cancel():  # it has begun
                other.result()

    return spread


class _Here(threading.local):
    """How many threads calls on this thread use where they do not say."""

    threads: int | None = None


class _Shared:
    """The threads that all calls of a process share: made when they are first needed."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.executor: Executor | None = None

    def get(self) -> Executor:
        with self.lock:
            if self.executor is None:
                others = max(1, cores() - 1)
                self.executor = ThreadsApart(others, SHARED_THREADS)
            return self.executor

    def forget(self) -> None:
        """Have none: a child process inherits the object, but not its threads."""
        self.__init__()  # type: ignore[misc]  # the lock may be held by a thread that is gone


SHARED_THREADS = "transientcam-kernel"
"""How the names of the shared threads begin."""
_HERE, _SHARED = _Here(), _Shared()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_SHARED.forget)


def use_one_thread() -> None:
    """Let calls on this thread use no other, unless they say so: as on the workers of a pool."""
    _HERE.threads = 1


@contextmanager
def use_all_cores() -> Iterator[None]:
    """Let calls on this thread use all cores inside the block, also after `use_one_thread`."""
    before, _HERE.threads = _HERE.threads, None
    try:
        yield
    finally:
        _HERE.threads = before


def on_threads(threads: int | None) -> Spread:
    """Return a way to do an image on so many threads, or on all cores, of which one is this."""
    if threads is None:
        threads = _HERE.threads or cores()
    return at_once if threads == 1 else over(_SHARED.get(), threads)


def over_all_cores() -> Spread:
    """Return a way to do an image on all cores, of which this thread has one.

    Also on a thread that `use_one_thread` was called on.
    """
    return on_threads(cores())


def start_threads() -> None:
    """Start the threads that all calls share, so that no call waits until they run."""
    on_threads(None)(lambda start, stop: None, 1024 * cores())


def cores() -> int:
    """Return how many cores this process may use, by its affinity and by a container's quota."""
    affinity = getattr(os, "sched_getaffinity", None)  # not every system can say
    allowed = (os.cpu_count() or 1) if affinity is None else len(affinity(0))
    return max(1, min(allowed, quota_of(_CONTROL_GROUPS, _MEMBERSHIP)))


@lru_cache(maxsize=1)
def quota_of(root: Path, membership: Path) -> int:
    """Return how many cores quotas leave, rounded up; as many as there may be without one.

    ``root`` is where control groups are mounted, of version 1 or 2; ``membership`` says which one
    this process is in. Those above it count, too, and in a container the uppermost one alone.
    """
    groups = {root, root / "cpu"}
    with suppress(OSError):
        for line in membership.read_text().splitlines():
            _, controllers, path = line.split(":", 2)
            if not controllers or "cpu" in controllers.split(","):
                own = root / ("cpu" if controllers else "") / path.lstrip("/")
                groups.update((own, *own.parents))
    return min(map(_quota, groups))


def _quota(group: Path) -> int:
    for texts in (("cpu.max",), ("cpu.cfs_quota_us", "cpu.cfs_period_us")):
        with suppress(OSError, ValueError):  # a file is not there, or says "max"
            quota, period = map(int, " ".join((group / each).read_text() for each in texts).split())
            if quota > 0:  # -1: none
                return math.ceil(quota / period)
    return sys.maxsize


def blocks(start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Cut pixels into blocks of `BLOCK`, or half as many more at the end."""
    cuts = [*range(start, max(start + 1, stop - BLOCK // 2), BLOCK), stop]
    return itertools.pairwise(cuts)


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
