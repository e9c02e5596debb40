"""The first process of a container: it ends last, and with the code of its command."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest


def init(code: str, *arguments: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [
            *(sys.executable, "-m", "transientcam_supervisor.init"),
            *(sys.executable, "-c", code, *arguments),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize(
    ("code", "expected"),
    [("raise SystemExit(3)", 3), ("import os; os.kill(os.getpid(), 9)", 137), ("", 0)],
)
def test_its_code_is_that_of_the_command(code: str, expected: int) -> None:
    with init(code) as process:
        assert process.wait() == expected


def test_it_waits_for_what_the_command_leaves_behind(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    code = (
        "import os, sys\n"
        "if os.fork() == 0:\n"
        "    print(open(sys.argv[1]).read(), flush=True)\n"
        "    os._exit(0)\n"
        "os.kill(os.getpid(), 9)\n"
    )
    with init(code, str(fifo)) as process:
        fifo.write_text("it was waited for")
        assert process.stdout is not None
        assert process.stdout.read() == "it was waited for\n"
        assert process.wait() == 137


def test_a_signal_reaches_the_command() -> None:
    code = "import signal; print('ready', flush=True); signal.pause()"
    with init(code) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        assert process.wait() == 143
