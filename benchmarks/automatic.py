"""What a program gets that calls nothing but the functions it needs: first and later calls."""

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from benchmarks.ceiling import measured
from benchmarks.data import CORES, PAPER
from benchmarks.tables import Table, verdict
from benchmarks.timing import duration

_FRAMES = 256
_ORDERS = (3, 4)
_DENSITY_BAR = 12.0
_PISARENKO_BAR_S = 1e-3
_PROGRAM = """
import json, statistics, sys, time
import numpy as np
from benchmarks.data import PAPER, moments, numpy_alone
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

def lane_of(name):
    return f"{name} m={m} float32" in tm.kernels.state()["compiled"]

def program(name, call):
    with numpy_alone():
        call()
        numpy_s = min(timed(call) for _ in range(3))
    first_s = timed(call)
    start_s = time.perf_counter()
    while not lane_of(name):  # a user reads the first result meanwhile
        time.sleep(0.01)
    ready_s = time.perf_counter() - start_s
    second_s = timed(call)
    later_s = statistics.median(timed(call) for _ in range(15))
    return {"numpy": numpy_s, "first": first_s, "ready": ready_s, "second": second_s,
            "later": later_s}

print(json.dumps({
    "density": program("density", lambda: tm.density(coefficients, phase_rad)),
    "pisarenko": program("pisarenko", lambda: tm.pisarenko(b)),
    "levinson": program("levinson", lambda: tm.levinson(b)),
}))
"""


def tables() -> Iterator[Table]:
    """Run fresh processes, whose cache holds what former ones compiled."""
    table = Table(
        f"Fresh processes that ask for nothing, 163 x 120, float32, {CORES} cores",
        ("call", "NumPy", "first call", "lane after", "second call", "later", "gain"),
        notes=[
            f"density: {_FRAMES} times. NumPy: with BLAS, all cores, the quickest of three calls "
            "of the same process; gain: NumPy over later calls. The first call computes with NumPy "
            "while the lane is loaded from the cache beside it.",
        ],
    )
    # processes compute in memory that has been written before, as does the ceiling
    write_s = 4 * _FRAMES * math.prod(PAPER) / measured(CORES).stream_bytes_s
    table.notes.append(
        f"Writing a density's {4e-6 * _FRAMES * math.prod(PAPER):.0f} MB and nothing else, past "
        f"the caches from all cores, takes {duration(write_s)}."
    )
    for m in _ORDERS:
        _fresh(m)  # warms the cache
        for name, found in _fresh(m).items():
            gain = found["numpy"] / found["later"]
            times = [found[key] for key in ("numpy", "first", "ready", "second", "later")]
            table.rows.append(
                (f"{name}, m = {m}", *(duration(each) for each in times), f"{gain:.1f}")
            )
            if name == "density":
                second = found["numpy"] / found["second"]
                table.notes.append(verdict(gain, _DENSITY_BAR, f"m = {m}, density, later calls"))
                table.notes.append(verdict(second, _DENSITY_BAR, f"m = {m}, density, second call"))
            if name == "pisarenko" and m == _ORDERS[-1]:
                quick = _PISARENKO_BAR_S / found["later"]
                table.notes.append(verdict(quick, 1.0, f"m = {m}, pisarenko, 1 ms over its time"))
    yield table


def _fresh(m: int) -> dict[str, Any]:
    result = subprocess.run(
        [sys.executable, "-c", _PROGRAM, json.dumps([m, _FRAMES])],
        env={**os.environ, "TRANSIENTCAM_KERNELS": "on"},
        capture_output=True,
        text=True,
        check=True,
    )
    measured: dict[str, Any] = json.loads(result.stdout)
    return measured
