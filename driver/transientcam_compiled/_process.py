"""Another process of this program: it calls functions, while this one goes on working.

What is Python in large part, as compiling and planning are, would hold the interpreter's lock on a
thread, which all other threads need (decisions 15 and 10).
"""

import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from multiprocessing import Pipe
from pathlib import Path
from typing import Any, Final

MEMORY_BYTES: Final = 3 << 29
"""What a process may have for data beyond its libraries: five times what a plan takes."""
NICE: Final = 10
"""A tenth of the processor time beside others that need all of it, all that is left else."""
_ASK_EVERY_S: Final = 0.25
Tell = Callable[[object], None]
"""Takes what a function says while it is called; the last argument of each."""


class ProcessEnded(OSError):  # noqa: N818 - says what has happened
    """The other process has ended before it answered."""


def _nothing(*_: object) -> None:
    """Do nothing."""


class ChildProcess:
    """Calls functions in another process, one at a time; started by the first call, or before it.

    It is a fresh Python with this `sys.path`, which runs no main module, so that nothing of a
    script runs twice. It has a low priority (``nice``) and leaves Ctrl-C at a terminal to this one.
    Where memory is short it is the first to go, and it gets no more than ``memory_bytes``.
    It ends with the thread that started it, however that ends and whatever it does then. For one
    thread.

    ``inside``: returns the context that everything is called in there.
    ``idle``: called there after each second without a call.
    ``memory_bytes``: for data beyond that of its libraries (``RLIMIT_DATA``): what needs more
    raises `MemoryError` there.
    ``nice``: taken from its priority.
    """

    def __init__(
        self,
        inside: Callable[[], AbstractContextManager[object]] = nullcontext,
        idle: Callable[[], object] = _nothing,
        *,
        memory_bytes: int = MEMORY_BYTES,
        nice: int = NICE,
    ) -> None:
        self._inside, self._idle = inside, idle
        self._memory_bytes, self._nice = memory_bytes, nice
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start the process, unless it is there; returns at once.

        Raises OSError where the system gives no process, or where Python cannot be started once
        more.
        """
        if self._process is not None:
            if self._process.poll() is None:
                return
            self.end()
        program = python()
        if program is None:
            raise OSError("there is no Python to start beside this program")
        ours, theirs = Pipe()
        numbers = theirs.fileno(), os.getpid(), self._memory_bytes, self._nice
        try:
            with theirs:
                self._process = subprocess.Popen(  # noqa: S603 - this program
                    # -P: nothing of the directory that the program happens to run in
                    [program, "-P", "-m", "transientcam_compiled", *map(str, numbers)],
                    # threads of BLAS would wait busily for each other: matrices are small
                    env=os.environ
                    | {"OPENBLAS_NUM_THREADS": "1"}
                    | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                    pass_fds=(theirs.fileno(),),
                    stdin=subprocess.DEVNULL,
                )
        except OSError:
            ours.close()
            raise
        self._connection = ours
        with suppress(OSError):  # the first call says that it has ended
            ours.send((self._inside, self._idle))

    def call(
        self,
        function: Callable[..., Any],
        *arguments: object,
        ask: Callable[[], object],
        told: Tell = _nothing,
    ) -> Any:
        """Return ``function(*arguments, tell)`` of the other process; waits for it.

        ``function``: of a module, or a method of what can be pickled.
        ``arguments``: pickled.
        ``ask``: called here several times a second meanwhile. What it raises gives the call up,
        which kills the process, and is raised.
        ``told``: called here with all that the function hands to its ``tell``; may raise, too.
        Raises ProcessEnded where the process has ended; the next call starts another one.
        Raises OSError as `start` does.
        Raises what the function raises.
        """
        self.start()
        try:
            kind, value = self._answer((function, arguments), ask, told)
        except BaseException:
            self.end()
            raise
        if kind == "raised":
            raise value
        return value

    def _answer(self, request: object, ask: Callable[[], object], told: Tell) -> tuple[str, Any]:
        try:
            self._connection.send(request)
        except OSError:
            raise ProcessEnded("it has ended") from None
        while True:
            try:
                there = self._connection.poll(_ASK_EVERY_S)
                answer: tuple[str, Any] = self._connection.recv() if there else ("", None)
            except (EOFError, OSError):
                raise ProcessEnded("it has ended") from None
            if not there:
                ask()
            elif answer[0] == "told":
                told(answer[1])
            else:
                return answer

    def end(self) -> None:
        """Kill the process, whatever it does, and wait until it has ended."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            self._connection.close()


def python() -> str | None:
    """Return the interpreter to start; None where this program cannot start Python once more.

    A program that embeds or packs Python would be started itself.
    """
    named = "python" in Path(sys.executable or "").name.lower()
    packed = getattr(sys, "frozen", False)
    return sys.executable if os.name == "posix" and named and not packed else None
