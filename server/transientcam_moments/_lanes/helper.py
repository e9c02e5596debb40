"""A process that compiles lanes into the cache, for a process that goes on working meanwhile.

Compiling is Python in large part: on a thread it would hold the interpreter's lock for most of a
minute, which all other threads need (decision 10).
"""

import logging
import os
import subprocess
import sys
import threading
from multiprocessing import Pipe
from pathlib import Path
from typing import Final

_MODULE: Final = "transientcam_moments._kernels"
_ASK_EVERY_S: Final = 0.25
_log = logging.getLogger("transientcam_moments")


class Helper:
    """Compiles lanes in another process, which starts with the first of them.

    For one thread; a context manager, whose exit ends the process. It ends by itself where this
    one is gone.

    Parameters
    ----------
    command : sequence of str, optional
        Of the process, to which the number of a descriptor is added: `program` where it is left
        out. None where there is none.
    """

    def __init__(self, command: tuple[str, ...] | None) -> None:
        self._command = command
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> "Helper":
        """Return itself; nothing is started yet."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        self.close()

    def compile(self, name: str, harmonics: int, precision: str) -> bool:
        """Have a lane compiled into the cache; return whether that was tried to the end.

        It returns early where the main thread has ended, and at once where there is no process for
        it. One that fails is not tried again, which a line of the log says.
        """
        if self._command is None:
            return True
        try:
            self._start()
            return self._ask(f"{name} {harmonics} {precision}")
        except (OSError, EOFError) as error:
            _log.warning(
                "the process that compiles kernels has failed (%s); they are compiled on a thread",
                str(error) or "it has ended",
            )
            self._command = None
            self.close()
            return True

    def close(self) -> None:
        """End the process, whatever it does."""
        process, self._process = self._process, None
        if process is not None:
            self._connection.close()
            process.kill()
            process.wait()

    def _start(self) -> None:
        if self._process is not None:
            return
        assert self._command is not None  # noqa: S101 - there is a process for it
        self._connection, theirs = Pipe()
        with theirs:
            descriptor = theirs.fileno()
            self._process = subprocess.Popen(  # noqa: S603 - this program
                [*self._command, str(descriptor)],
                env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                pass_fds=(descriptor,),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )

    def _ask(self, lane: str) -> bool:
        main = threading.main_thread()
        self._connection.send_bytes(lane.encode())
        while not self._connection.poll(_ASK_EVERY_S):
            if not main.is_alive():
                return False
        self._connection.recv_bytes()
        return True


def program() -> tuple[str, ...] | None:
    """Return the command of the process; None where this one cannot start Python once more.

    A program that embeds or packs Python would be started itself.
    """
    named = "python" in Path(sys.executable or "").name.lower()
    if os.name != "posix" or not named or getattr(sys, "frozen", False):
        return None
    # -P: nothing of the directory that the program happens to run in
    return (sys.executable, "-P", "-m", _MODULE)
