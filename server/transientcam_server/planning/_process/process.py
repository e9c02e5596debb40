"""A process of its own for plans, which frames go before.

What plans is Python in large part: on a thread of the service it would hold the interpreter's lock,
which every frame needs many times, and memory that the service would keep (decision 15).
"""

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

import transientcam_moments as tm
from transientcam_compiled import ChildProcess, ProcessEnded, Tell
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning._process.queue import RETRY_AFTER_S, Progress

_T = TypeVar("_T")


class PlanningProcess:
    """Calls functions in another process, one at a time.

    It is started by the first call, or before it (`prepare`), stays for the next one, and is killed
    where a call is given up. Once it is idle it makes kernels ready: a plan is a look and, right
    after it, a search.

    ``most_s``: how long one call may take.
    ``clock``: time in s.
    """

    def __init__(
        self, most_s: float = math.inf, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._most_s = most_s
        self._clock = clock
        self._calling = threading.Lock()
        self._child = ChildProcess(_planning, tm.kernels.make_ready)
        self._closing = threading.Event()

    def run(self, compute: Callable[..., _T], *arguments: object, progress: Progress) -> _T:
        """Return ``compute(*arguments, progress)`` of the other process; waits for it.

        ``compute``: a function of a module, or a method of what can be pickled.
        ``arguments``: are pickled.
        ``progress``: of this process. What it raises kills the other one, and is raised here.
        Raises Problem ``shutting-down`` from `close` on, ``plan-too-long`` after ``most_s``,
        ``planning-ended`` where the process is gone; Exception: what ``compute`` raises.
        """

        def ask() -> None:
            if self._closing.is_set():
                raise Problem(kinds.SHUTTING_DOWN, "The service is shutting down.")
            if self._clock() >= ends_s:
                detail = f"It was not done after {self._most_s:g} s."
                raise Problem(kinds.PLAN_TOO_LONG, detail, limit=self._most_s)
            progress()

        def told(said: Any) -> None:
            ask()
            if isinstance(said, tuple):
                progress.at(*said)
            else:
                progress.show(said)

        with self._calling:
            ends_s = self._clock() + self._most_s
            ask()
            try:
                value: _T = self._child.call(_compute, compute, arguments, ask=ask, told=told)
            except (ProcessEnded, MemoryError) as error:
                raise Problem(
                    kinds.PLANNING_ENDED,
                    "The process that plans has ended."
                    if isinstance(error, ProcessEnded)
                    else "The process that plans has too little memory.",
                    retry_after_s=RETRY_AFTER_S,
                ) from None
        return value

    def prepare(self) -> None:
        """Start the process, so that the first call need not wait for its imports; at once.

        Where the system gives no process, the first call says so.
        """
        self._unless_it_computes(self._start)

    def leave(self) -> None:
        """End the process, unless it computes: its memory is given back. From any thread."""
        self._unless_it_computes(self._child.end)

    def close(self) -> None:
        """End what is computed: it raises ``shutting-down``. From any thread."""
        self._closing.set()
        self.leave()  # else the call that computes ends it

    def _start(self) -> None:
        if not self._closing.is_set():
            with suppress(OSError):
                self._child.start()

    def _unless_it_computes(self, do: Callable[[], None]) -> None:
        if self._calling.acquire(blocking=False):
            try:
                do()
            finally:
                self._calling.release()


@contextmanager
def _planning() -> Iterator[None]:
    """Use one thread inside, and only note which kernels calls want, but for the likelihood's."""
    tm.kernels.use_one_thread()
    tm.kernels.load(("likelihood",), 1)
    with tm.kernels.only_note():
        yield


def _compute(compute: Callable[..., _T], arguments: tuple[object, ...], tell: Tell) -> _T:
    """Call in the other process; a step is told where it is another one than before.

    This side asks by itself whether to go on.
    """
    reported: tuple[float, str] | None = None

    def report(share: float, step: str) -> None:
        nonlocal reported
        if reported != (share, step):
            reported = share, step
            tell(reported)

    return compute(*arguments, Progress(report, show=tell))
