"""Ctrl-C in a terminal while a verb computes on processes of its own, as `--workers 2` starts them.

Tasks that a test wants to be interrupted never end by themselves, so that no test depends on how
fast they are.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

COMMAND = [sys.executable, "-c", "from transientcam.cli import main; main()"]
WORKERS = 2
PRELOADED = """
import os, time
import {module} as module

real = module.{function}
held = {held}

def {function}(*arguments):
    while held(*arguments):
        time.sleep(0.05)
    return real(*arguments)

def dask_setup(worker):
    module.{function} = {function}
    print(os.getpid(), flush=True)
"""
"""What every worker runs before its first task; that it was there it says by its process."""


@dataclass(frozen=True)
class Hold:
    """Which calls in a worker never end.

    Attributes
    ----------
    module, function
        What is called for each task.
    held
        Source of a function that is true of the arguments of such a call.
    """

    module: str
    function: str
    held: str

    def preloaded(self) -> str:
        """Return the source that a worker is to preload."""
        return PRELOADED.format(module=self.module, function=self.function, held=self.held)


def interrupt(directory: Path, *arguments: str, hold: Hold, once: Callable[[], bool]) -> None:
    """Press Ctrl-C once something is there, and see that the command ends and leaves no process.

    Parameters
    ----------
    directory
        Where a file may be written.
    arguments
        Of `transientcam`, without `--workers`.
    hold
        What does not end by itself.
    once
        Says that enough was done.
    """
    preload = directory / "hold.py"
    preload.write_text(hold.preloaded(), encoding="utf-8")
    environment = os.environ | {"DASK_DISTRIBUTED__WORKER__PRELOAD": str([str(preload)])}
    with in_a_terminal(*arguments, "--workers", str(WORKERS), environment=environment) as process:
        while not once():
            assert process.poll() is None, process.communicate()
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        said, errors = process.communicate()
    assert process.returncode == 128 + signal.SIGINT, errors
    workers = [int(each) for each in said.split()[:WORKERS]]
    assert len(workers) == WORKERS
    for worker in workers:
        assert not Path(f"/proc/{worker}").exists()


@contextmanager
def in_a_terminal(
    *arguments: str, environment: dict[str, str]
) -> Iterator["subprocess.Popen[str]"]:
    """Run a command in a process group of its own, as a shell does."""
    process = subprocess.Popen(
        [*COMMAND, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
