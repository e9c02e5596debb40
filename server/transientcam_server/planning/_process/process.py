"""A process of its own for plans, which frames go before.

What plans is Python in large part: on a thread of the service it would hold the interpreter's lock,
which every frame needs many times, and memory that the service would keep (decision 15).
"""

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, Final, TypeVar

import transientcam_moments as tm
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning._process.progress import Progress

NICE: Final = 10
"""A tenth of the processor time beside a service that needs all of it, all that is left else."""
_ASK_EVERY_S: Final = 0.25
_IDLE_S: Final = 1.0
"""After which kernels are made ready: a plan is a look and, right after it, a search."""
_MODULE: Final = "transientcam_server.planning._process.process"
_T = TypeVar("_T")


class PlanningProcess:
    """Calls functions in another process, one at a time.

    It is started by the first call, or before it (`prepare`), stays for the next one, and is killed
    where a call is given up.
    """

    def __init__(self) -> None:
        self._calling = threading.Lock()
        self._child: _Child | None = None
        self._closing = threading.Event()

    def run(self, compute: Callable[..., _T], *arguments: object, progress: Progress) -> _T:
        """Return ``compute(*arguments, progress)`` of the other process; waits for it.

        Parameters
        ----------
        compute
            A function of a module, or a method of what can be pickled.
        arguments
            Pickled.
        progress
            Of this process. What it raises kills the other one, and is raised here.

        Raises
        ------
        Problem
            ``shutting-down`` from `close` on, ``internal-error`` where the process is gone.
        Exception
            What ``compute`` raises.
        """

        def ask() -> None:
            if self._closing.is_set():
                raise _closing()
            progress()

        with self._calling:
            ask()
            child = self._child = self._child or _Child()
            try:
                value: _T = child.call(compute, arguments, progress, ask)
            except _Failed as failed:
                raise failed.error from None
            except (EOFError, OSError):
                self._end()
                raise Problem(kinds.INTERNAL_ERROR, "The process that plans has ended.") from None
            except BaseException:
                self._end()
                raise
        return value

    def prepare(self) -> None:
        """Start the process, so that the first call need not wait for its imports; at once.

        Where the system gives no process, the first call says so.
        """
        if self._calling.acquire(blocking=False):
            try:
                if not self._closing.is_set():
                    with suppress(OSError):
                        self._child = self._child or _Child()
            finally:
                self._calling.release()

    def leave(self) -> None:
        """End the process, unless it computes: its memory is given back. From any thread."""
        if self._calling.acquire(blocking=False):
            try:
                self._end()
            finally:
                self._calling.release()

    def close(self) -> None:
        """End what is computed: it raises ``shutting-down``. From any thread."""
        self._closing.set()
        self.leave()  # else the call that computes ends it

    def _end(self) -> None:
        child, self._child = self._child, None
        if child is not None:
            child.end()


class _Failed(Exception):  # noqa: N818 - carries what the function raised
    def __init__(self, error: Exception) -> None:
        super().__init__(error)
        self.error = error


class _Child:
    """The other process, from this side."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        with theirs, ours:  # closed here where the system gives no process
            self._process = subprocess.Popen(  # noqa: S603 - this program
                [sys.executable, "-P", "-m", _MODULE, str(theirs.fileno())],
                env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                pass_fds=(theirs.fileno(),),
                stdin=subprocess.DEVNULL,
            )
            self._connection = Connection(ours.detach())

    def call(
        self,
        compute: Callable[..., Any],
        arguments: tuple[object, ...],
        progress: Progress,
        ask: Callable[[], None],
    ) -> Any:
        """Do as `PlanningProcess.run` does, and ``ask`` meanwhile whether to go on.

        Raises
        ------
        _Failed
            With what ``compute`` raises.
        EOFError, OSError
            Where the process has ended.
        """
        self._connection.send((compute, arguments))
        while True:
            if not self._connection.poll(_ASK_EVERY_S):
                ask()
                continue
            kind, value = self._connection.recv()
            if kind == "value":
                return value
            if kind == "error":
                raise _Failed(value)
            if kind == "step":
                progress.at(*value)
            else:
                progress.show(value)

    def end(self) -> None:
        """Kill it, and wait until it has ended."""
        self._process.kill()
        self._process.wait()
        self._connection.close()


def _closing() -> Problem:
    return Problem(kinds.SHUTTING_DOWN, "The service is shutting down.")


def serve(connection: Connection) -> None:
    """Call what arrives, and send what it returns or raises, until the other side is gone.

    A step is sent where it is another one than before; the other side asks by itself whether to
    go on.
    """
    reported: tuple[float, str] | None = None

    def send(kind: str, value: object) -> None:
        try:
            connection.send((kind, value))
        except OSError:
            raise SystemExit from None

    def report(share: float, step: str) -> None:
        nonlocal reported
        if reported != (share, step):
            reported = share, step
            send("step", reported)

    while True:
        try:
            if not connection.poll(_IDLE_S):
                tm.kernels.make_ready()  # for the next plan
            compute, arguments = connection.recv()
        except EOFError:
            return
        try:
            value = compute(*arguments, Progress(report, show=partial(send, "shown")))
        except Exception as error:
            send("error", error)
        else:
            send("value", value)


def main() -> None:
    """Serve the connection whose descriptor is the argument."""
    os.nice(NICE)
    # Ctrl-C at a terminal is for the service, which ends this process
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tm.kernels.use_one_thread()
    with tm.kernels.only_note():
        serve(Connection(int(sys.argv[1])))


if __name__ == "__main__":
    main()
