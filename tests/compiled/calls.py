"""What tests let another process call, or do before all else there."""

import ctypes
import os
import resource
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

from numba.core import event

from transientcam_compiled import Tell

_SEEN: list[str] = []


@contextmanager
def noted() -> Iterator[None]:
    """A context that says that it was entered."""
    _SEEN.append("entered")
    yield


def write(fifo: Path) -> None:
    fifo.write_text("idle")


def ending() -> NoReturn:
    """End the process before there is a context."""
    os._exit(3)


def seen(tell: Tell) -> list[str]:
    return _SEEN


def niceness(tell: Tell) -> int:
    return os.nice(0)


def limits(tell: Tell) -> tuple[int, int]:
    """How soon it is killed where memory is short, and what its data may take beside what it is."""
    score = int(Path("/proc/self/oom_score_adj").read_text())
    return score, resource.getrlimit(resource.RLIMIT_DATA)[0]


def hold_the_interpreter(tell: Tell) -> None:
    """Say which process this is, and let no other thread of it do anything any more."""
    tell(os.getpid())
    ctypes.PyDLL(None).sleep(3600)


def pid(tell: Tell) -> int:
    return os.getpid()


def count(until: int, tell: Tell) -> int:
    for k in range(until):
        tell(k)
    return until


def main_module(tell: Tell) -> object:
    import __main__

    return getattr(__main__, "__file__", None)


def refuse(tell: Tell) -> NoReturn:
    raise OSError("full")


def a_lock(tell: Tell) -> object:
    return threading.Lock()


def end_at_once(tell: Tell) -> NoReturn:
    os._exit(3)


def go_on_for_ever(tell: Tell) -> NoReturn:
    """Say which process this is, and compute without ever saying anything again."""
    tell(os.getpid())
    while True:
        sum(k * k for k in range(10_000))


# -- kernels that are in no cache ------------------------------------------------------------------


def load(key: str) -> str:
    with event.trigger_event("numba:compile"):  # as numba does where it has to compile
        return f"{key} of {threading.current_thread().name}"


def load_here(process: int, key: str) -> str:
    """Load in one process, and end any other."""
    if os.getpid() != process:
        os._exit(3)
    return load(key)


def load_never(process: int, key: str) -> str:
    """Load in one process, and wait in any other."""
    if os.getpid() != process:
        signal.pause()
    return load(key)


def fail(key: str) -> NoReturn:
    raise RuntimeError("no such processor\nand a long story")
