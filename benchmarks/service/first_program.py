"""What a newcomer waits for, from an empty directory to the first program's answer."""

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from benchmarks.common.daemon import Process
from benchmarks.common.records import DOCS, ROOT
from benchmarks.common.tables import Table, heads

_START: Final = DOCS / "start.md"
_ADDRESS: Final = "http://127.0.0.1:8000"
_END_S: Final = 30.0


def first_program(page: str) -> str:
    """Return the program that stands under "First program" of docs/start.md."""
    found = re.search(
        r"^## First program\n.*?^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE
    )
    if found is None:
        raise ValueError(f"{_START} has no program under 'First program'")
    return found.group(1)


def build_wheel(to: Path) -> Path:
    """Return a wheel of these sources."""
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(to)]
    subprocess.run([*command, str(ROOT)], check=True, capture_output=True)
    (wheel,) = to.glob("*.whl")
    return wheel


def measure(wheel: Path, directory: Path, clock_s: Callable[[], float]) -> list[tuple[str, float]]:
    """Return the steps and when each was done, in s since the first began."""
    done: list[tuple[str, float]] = []
    began_s = clock_s()

    def finished(step: str) -> None:
        done.append((step, clock_s() - began_s))

    # no path leads to these sources
    environment = {"PYTHONPATH": "", "NUMBA_CACHE_DIR": str(directory / "kernels")}
    within: dict[str, Any] = {"cwd": directory, "env": os.environ | environment, "check": True}
    python = directory / "venv" / "bin" / "python"
    subprocess.run([sys.executable, "-m", "venv", directory / "venv"], check=True)
    finished("`python -m venv .venv`")
    subprocess.run([python, "-m", "pip", "install", "--quiet", f"{wheel}[server]"], **within)
    finished("`pip install 'transientcam-….whl[server]'`")
    daemon = Process([python.with_name("transientcam"), "serve", "--port", "0"], environment)
    try:
        finished("`transientcam serve` prints its address")
        program = first_program(_START.read_text("utf-8")).replace(_ADDRESS, daemon.url)
        for which in ("first", "second"):
            subprocess.run([python, "-c", program], stdout=subprocess.PIPE, **within)
            finished(f"the first program has printed its answer, {which} run")
    finally:
        daemon.end_within(_END_S)
    return done


def tables(wheel: Path | None = None) -> Iterator[Table]:
    """Install into an empty directory, and run the first program; the wheel is built if not given.

    The steps are those of docs/start.md; the program is the one that stands there. Installing needs
    the network, and its time is mostly the network's.
    """
    table = Table("", heads("after this step | it took, s:.1f | since the beginning, s:.1f"))
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        built = wheel or build_wheel(directory / "dist")
        before_s = 0.0
        for step, at_s in measure(built.resolve(), directory, time.perf_counter):
            table.rows.append((step, at_s - before_s, at_s))
            before_s = at_s
    yield table
