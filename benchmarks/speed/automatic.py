"""What a program gets that calls nothing but the functions it needs: first and later calls."""

import json
import math
import os
import statistics
import subprocess
import sys
from collections.abc import Iterator

from benchmarks.common.data import CORES, PAPER
from benchmarks.common.tables import Table, heads, verdict
from benchmarks.common.timing import duration
from benchmarks.speed.ceiling import measured

_FRAMES = 256
_ORDERS = (3, 4)
_PAIRS = 5
_DENSITY_BAR = 12.0
_PISARENKO_BAR_S = 1e-3
_PROGRAM = """
import json, statistics, sys, time
import numpy as np
from benchmarks.common.data import PAPER, moments, numpy_alone
import transientcam_moments as tm

m, frames = json.loads(sys.argv[1])
with numpy_alone():
    b = moments(m, PAPER)
    coefficients = tm.levinson(b)
phase_rad = np.linspace(0, 2 * np.pi, frames, endpoint=False)

def timed(call):
    start_s = time.perf_counter()
    call()
    return time.perf_counter() - start_s

def kernel_of(name):
    return f"{name} m={m} float32" in tm.kernels.state()["compiled"]

def program(name, call):
    first_s = timed(call)
    start_s = time.perf_counter()
    if tm.kernels.state()["enabled"]:
        while not kernel_of(name):  # a user reads the first result meanwhile
            time.sleep(0.01)
        ready_s = time.perf_counter() - start_s
    else:
        time.sleep(0.5)  # as a user reads the first result here, too
        ready_s = 0.0
    second_s = timed(call)
    later_s = statistics.median(timed(call) for _ in range(15))
    return {"first": first_s, "ready": ready_s, "second": second_s, "later": later_s}

print(json.dumps({
    "density": program("density", lambda: tm.density(coefficients, phase_rad)),
    "pisarenko": program("pisarenko", lambda: tm.pisarenko(b)),
    "levinson": program("levinson", lambda: tm.levinson(b)),
    "peaks": program("peaks", lambda: tm.peaks(coefficients)),
}))
"""
_Times = dict[str, dict[str, float]]
"""Seconds of each call's steps: first, ready, second, later."""


def tables() -> Iterator[Table]:
    """Run fresh processes in turn, with kernels from a warm cache and with NumPy alone."""
    table = Table(
        f"Fresh processes that ask for nothing, 163 x 120, float32, {CORES} cores",
        heads(
            "call | NumPy: first | second | later | kernels: first | ready after | second | "
            "later | gain: second | later"
        ),
        notes=[
            f"density: {_FRAMES} times. NumPy: with BLAS, all cores, `TRANSIENTCAM_KERNELS=off`. "
            f"Medians of {_PAIRS} processes of either kind, in turn; later: the median of fifteen "
            "calls. A gain holds the same call of both kinds of processes against each other. "
            "The first call computes with NumPy; then the kernel is loaded from the cache, beside "
            "what the program does next."
        ],
    )
    # processes compute in memory that has been written before, as does the ceiling
    write_s = 4 * _FRAMES * math.prod(PAPER) / measured(CORES).stream_bytes_s
    table.notes.append(
        f"Writing a density's {4e-6 * _FRAMES * math.prod(PAPER):.0f} MB and nothing else, past "
        f"the caches from all cores, takes {duration(write_s)}."
    )
    for m in _ORDERS:
        _fresh(m, "on")  # warms the cache
        pairs = [(_fresh(m, "off"), _fresh(m, "on")) for _ in range(_PAIRS)]
        numpy, kernels = (_medians([pair[kind] for pair in pairs]) for kind in (0, 1))
        for name, found in kernels.items():
            alone = numpy[name]
            gain = {step: alone[step] / found[step] for step in ("second", "later")}
            times = [alone[step] for step in ("first", "second", "later")]
            times += [found[step] for step in ("first", "ready", "second", "later")]
            table.rows.append(
                (
                    f"{name}, m = {m}",
                    *(duration(each) for each in times),
                    *(f"{each:.1f}" for each in gain.values()),
                )
            )
            if name == "density":
                for step, each in gain.items():
                    table.notes.append(verdict(each, _DENSITY_BAR, f"m = {m}, density, {step}"))
                seconds = [pair[kind][name]["second"] for kind in (0, 1) for pair in pairs]
                table.notes.append(
                    f"m = {m}, density, second calls: NumPy {_span(seconds[:_PAIRS])}, kernels "
                    f"{_span(seconds[_PAIRS:])}; NumPy's later calls over the second one with "
                    f"kernels: {alone['later'] / found['second']:.1f}."
                )
            if name == "pisarenko" and m == _ORDERS[-1]:
                quick = _PISARENKO_BAR_S / found["later"]
                table.notes.append(verdict(quick, 1.0, f"m = {m}, pisarenko, 1 ms over its time"))
    yield table


def _medians(runs: list[_Times]) -> _Times:
    """Return the median of each time over several processes."""
    return {
        name: {step: statistics.median(run[name][step] for run in runs) for step in steps}
        for name, steps in runs[0].items()
    }


def _span(seconds: list[float]) -> str:
    """Return the least and the largest of some times."""
    return f"{duration(min(seconds))} to {duration(max(seconds))}"


def _fresh(m: int, kernels: str) -> _Times:
    """Run the program in a process of its own, with TRANSIENTCAM_KERNELS as given."""
    result = subprocess.run(
        [sys.executable, "-c", _PROGRAM, json.dumps([m, _FRAMES])],
        env={**os.environ, "TRANSIENTCAM_KERNELS": kernels},
        capture_output=True,
        text=True,
        check=True,
    )
    times: _Times = json.loads(result.stdout)
    return times
