"""How long compiling takes, and starting with everything compiled."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from typing import Any

from benchmarks.common.tables import Table
from benchmarks.common.timing import duration

_ORDERS = (3, 4, 8)
_PROGRAM = """
import json, sys, time
start_s = time.perf_counter()
import transientcam_moments as tm
imported_s = time.perf_counter() - start_s
steps = []
tm.kernels.compile(
    harmonics=json.loads(sys.argv[1]),
    precisions=json.loads(sys.argv[2]),
    progress=lambda done, total, name: steps.append(
        (name, time.perf_counter(), time.process_time())
    ),
)
lanes = [(a[0], b[1] - a[1], b[2] - a[2]) for a, b in zip(steps, steps[1:])]
print(json.dumps({"import_s": imported_s, "lanes": lanes, "failed": tm.kernels.state()["failed"]}))
"""


def tables() -> Iterator[Table]:
    """Compile in fresh processes, first with an empty cache and then with the one that is left."""
    table = Table(
        "Compiling on one thread: seconds (of them, processor time)",
        ("lane", *(f"m = {m}" for m in _ORDERS)),
        notes=[
            "Lanes share what has been compiled: each costs what the ones above have left of it.",
            "Nothing waits for it: NumPy serves until a lane is there.",
        ],
    )
    rows: dict[str, list[str]] = {}
    loads: list[str] = []
    for m in _ORDERS:
        with tempfile.TemporaryDirectory() as cache:
            cold, warm = _run(cache, m), _run(cache, m)
        for name, wall_s, processor_s in cold["lanes"]:
            lane, _, precision = name.replace(f" m={m}", "").rpartition(" ")
            row = f"{lane.replace('_', ' ')}, {precision}"
            rows.setdefault(row, []).append(f"{wall_s:.2f} ({processor_s:.2f})")
        total = [sum(step[index] for step in cold["lanes"]) for index in (1, 2)]
        rows.setdefault("all", []).append(f"{total[0]:.2f} ({total[1]:.2f})")
        loads.append(duration(sum(step[1] for step in warm["lanes"])))
        import_s = warm["import_s"]
    table.rows.extend((name, *row) for name, row in rows.items())
    table.rows.append(("all, from the cache", *loads))
    table.rows.append(("importing transientcam_moments", *[duration(import_s)] * len(_ORDERS)))
    yield table


def _run(cache: str, m: int) -> dict[str, Any]:
    result = subprocess.run(
        [sys.executable, "-c", _PROGRAM, json.dumps([m]), json.dumps(["float32", "float64"])],
        env={**os.environ, "NUMBA_CACHE_DIR": cache},
        capture_output=True,
        text=True,
        check=True,
    )
    measured: dict[str, Any] = json.loads(result.stdout)
    return measured
