"""What a newcomer waits for, step by step: from an empty directory to the first program's answer.

Run it with ``python -m benchmarks.first_program [--wheel FILE] [--write]``. The steps are those of
docs/start.md; the program is the one that stands there. Installing needs the network, and its time
is mostly the network's.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from benchmarks.daemon import Process
from benchmarks.machine import machine

_ROOT: Final = Path(__file__).parents[1]
PAGE: Final = _ROOT / "docs" / "first-program.md"
_START: Final = _ROOT / "docs" / "start.md"
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
    subprocess.run([*command, str(_ROOT)], check=True, capture_output=True)
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


def page_of(done: list[tuple[str, float]]) -> str:
    """Return the page: how long each step took, and the time since the first began."""
    lines = [
        "# The first program",
        "",
        "Written by `python -m benchmarks.first_program --write` on",
        f"{machine()}.",
        "",
        "From an empty directory to the answer of the program in [Start](start.md#first-program).",
        "Measured once. Installing downloads what is not in pip's cache.",
        "",
        "| after this step | it took | since the beginning |",
        "|---|---:|---:|",
    ]
    before_s = 0.0
    for step, at_s in done:
        lines.append(f"| {step} | {at_s - before_s:.1f} s | {at_s:.1f} s |")
        before_s = at_s
    return "\n".join([*lines, ""])


def main(arguments: list[str] | None = None) -> None:
    """Measure, and print or write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.first_program", description=__doc__)
    parser.add_argument("--wheel", type=Path, help="the wheel to install; built here otherwise")
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.relative_to(_ROOT)}")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        wheel = given.wheel or build_wheel(directory / "dist")
        page = page_of(measure(wheel.resolve(), directory, time.perf_counter))
    if given.write:
        PAGE.write_text(page, encoding="utf-8")
    print(page)


if __name__ == "__main__":
    main()
