"""What tests let another process call; its modules are imported there."""

import os
import threading
from collections.abc import Callable
from typing import NoReturn, TypeVar

from transientcam_compiled._process import MEMORY_BYTES
from transientcam_server.errors import JobCancelled, Problem, kinds
from transientcam_server.planning import Progress

_T = TypeVar("_T")


def pid(progress: Progress) -> int:
    return os.getpid()


def steps(count: int, progress: Progress) -> int:
    """Report each of these steps many times, and show it."""
    for k in range(count):
        progress.at(k / count, f"step {k}")
        for _ in range(1000):
            progress()
        progress.show({"step": k})
    return count


def refuse(progress: Progress) -> NoReturn:
    raise Problem(kinds.TARGET_UNREACHABLE, "Too far.", field="range_error_m", best=None)


def go_on_for_ever(progress: Progress) -> NoReturn:
    """Compute without ever asking whether to go on; the first step names this process."""
    progress.at(0.5, str(os.getpid()))
    while True:
        sum(k * k for k in range(10_000))


def tell_for_ever(progress: Progress) -> NoReturn:
    """Report one step after the other, so that there is always something to be heard."""
    while True:
        for k in range(1000):
            progress.at(k / 1000, "on and on")


def end_at_once(progress: Progress) -> NoReturn:
    os._exit(3)


def want_all_memory(progress: Progress) -> int:
    return len(bytearray(MEMORY_BYTES))


class Here:
    """Calls in this process: what a test replaces is replaced for it, too."""

    def run(self, compute: Callable[..., _T], *arguments: object, progress: Progress) -> _T:
        return compute(*arguments, progress)

    def prepare(self) -> None:
        """Be here."""

    def leave(self) -> None:
        """Stay."""

    def close(self) -> None:
        """End nothing."""


class Endless:
    """Work in pure Python that reports where it is, and goes on until that raises."""

    def __init__(self) -> None:
        self.began, self.ended = threading.Event(), threading.Event()
        self.raised: Exception | None = None

    def __call__(self, goal: object, scene: object, progress: Progress) -> None:
        progress.at(0.5, "searching")
        progress.show({"summary": "One of many."})
        self.began.set()
        try:
            while not self.ended.is_set():
                sum(k * k for k in range(10_000))
                progress()
        except (Problem, JobCancelled) as error:
            self.raised = error
            self.ended.set()
            raise


def is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True
