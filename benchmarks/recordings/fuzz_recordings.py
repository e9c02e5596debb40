"""Damaged and forged recordings in a service's directory: what becomes of it.

Cases follow from their numbers, so that one can be tried again alone. They run in processes of
their own: one that crashes or hangs is noted, and the next process goes on after it. A case may
take so much of the processor; how long it takes on a busy machine says nothing.
"""

import collections
import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py

from benchmarks.common.records import ROOT
from benchmarks.common.tables import Table
from tests.server.fuzzing.recordings import (
    BEYOND_BYTES,
    KINDS,
    MEMORY_BYTES,
    MOST_SPENT_S,
    in_memory,
)

BATCH = 2000
SILENT_S = 900.0
"""Without a word for so long, a process is ended, and its case tried once more alone."""
LOOK_S = 1.0
OVER_HTTP_EVERY = 10


@dataclass
class Findings:
    """What came of many cases."""

    states: collections.Counter[tuple[str, str]] = field(default_factory=collections.Counter)
    """How often a kind of case was listed as what."""
    wrong: dict[str, list[int]] = field(default_factory=dict)
    """Cases by what should not have happened: crashes, hangs, server errors."""
    grown_bytes: list[int] = field(default_factory=list)
    """The most memory that each case took."""
    spent_s: list[float] = field(default_factory=list)
    """The processor time that each case took."""

    def take(self, outcome: dict[str, Any]) -> None:
        """Count a case."""
        self.states[outcome["kind"], outcome["state"]] += 1
        self.grown_bytes.append(outcome["grown_bytes"])
        self.spent_s.append(outcome["spent_s"])
        for each in outcome["wrong"]:
            self.wrong.setdefault(each, []).append(outcome["number"])


def attempt(first: int, last: int, *, stop: threading.Event) -> Iterator[dict[str, Any]]:
    """Try some cases until ``stop`` is set, and go on after one that ends the process."""
    silent = None
    while first < last:
        number, ended = first, None
        with tempfile.TemporaryDirectory(dir=in_memory()) as name:
            for line in _lines(Path(name), first, last, stop=stop):
                if "begin" in line:
                    number = line["begin"]
                elif "ended" in line:
                    ended = line["ended"]
                else:
                    yield line
        if stop.is_set():
            return
        if ended == 0 and number != last - 1:
            raise RuntimeError(f"the process ended after case {number}")
        if ended is None and silent != number:
            first = silent = number  # it may have waited for the machine: once more
            continue
        if ended != 0:
            what = "no answer" if ended is None else f"the process ended: {ended}"
            how = {"kind": KINDS[number % len(KINDS)], "state": "lost", "wrong": [what]}
            yield how | {"number": number, "grown_bytes": 0, "spent_s": 0.0}
        first = number + 1


def _lines(
    directory: Path, first: int, last: int, *, stop: threading.Event
) -> Iterator[dict[str, Any]]:
    """Run a process, and return what it writes, and with what it ended: None if it was killed."""
    command = [sys.executable, "-m", "tests.server.fuzzing.recordings", str(directory / "tried")]
    environment = os.environ | {"TRANSIENTCAM_KERNELS": "off"}
    with (
        subprocess.Popen(
            [*command, str(first), str(last), str(OVER_HTTP_EVERY)],
            cwd=ROOT,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # an interrupt is for this process
        ) as process,
        selectors.DefaultSelector() as selector,
    ):
        assert process.stdout is not None
        selector.register(process.stdout, selectors.EVENT_READ)
        rest = b""
        heard_s = time.monotonic()
        while True:
            if selector.select(LOOK_S):
                data = os.read(process.stdout.fileno(), 65536)
                if not data:
                    break
                heard_s = time.monotonic()
                *lines, rest = (rest + data).split(b"\n")
                yield from map(json.loads, lines)
            elif stop.is_set() or time.monotonic() - heard_s > SILENT_S:
                process.kill()
                yield {"ended": None}
                return
            if stop.is_set():
                process.kill()
                return
    yield {"ended": process.returncode}


def measure(*, cases: int, jobs: int, kept: Path | None = None) -> Findings:
    """Try so many cases, some at the same time; what a file keeps is not tried again.

    Outcomes are appended to the file, a line for each. An interrupt ends it with what there is.
    """
    findings = Findings()
    known = _known(kept)
    for number, outcome in known.items():
        if number < cases:
            findings.take(outcome)
    taking, stop = threading.Lock(), threading.Event()

    def take(outcome: dict[str, Any]) -> None:
        with taking:
            findings.take(outcome)
            if kept is not None:
                with kept.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(outcome) + "\n")

    def try_batch(begin: int) -> None:
        last = min(begin + BATCH, cases)
        left = [number for number in range(begin, last) if number not in known]
        if left:
            for outcome in attempt(left[0], last, stop=stop):
                if outcome["number"] not in known:
                    take(outcome)

    threads = ThreadPoolExecutor(jobs)
    try:
        for _ in threads.map(try_batch, range(0, cases, BATCH)):
            pass
    except KeyboardInterrupt:
        pass
    finally:
        stop.set()
        threads.shutdown(cancel_futures=True)
    return findings


def _known(kept: Path | None) -> dict[int, dict[str, Any]]:
    if kept is None or not kept.exists():
        return {}
    lines = kept.read_text(encoding="utf-8").splitlines()
    return {outcome["number"]: outcome for outcome in map(json.loads, lines)}


def tables(
    *, cases: int = 100_000, jobs: int = os.cpu_count() or 1, keep: Path | None = None
) -> Iterator[Table]:
    """Try so many files, so many at a time; with a file of outcomes, go on where that ended.

    An interrupt ends it with what was tried until then.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    begin_s = time.perf_counter()
    findings = measure(cases=cases, jobs=jobs, kept=keep)
    elapsed_s, tried = time.perf_counter() - begin_s, len(findings.grown_bytes)
    took = ""
    if keep is None:
        took = f": in {elapsed_s / 60:.0f} min, {1e3 * elapsed_s / tried:.0f} ms each"
    libraries = f"h5py {h5py.version.version} (HDF5 {h5py.version.hdf5_version})"
    beyond = sum(each > BEYOND_BYTES for each in findings.grown_bytes)
    rows = [
        (
            "processes that crashed or hung, server errors, files that could not be deleted, or a "
            "good recording not listed as complete",
            f"{sum(map(len, findings.wrong.values()))}",
        ),
        ("most memory that one case took", f"{max(findings.grown_bytes) / 2**20:.0f} MiB"),
        (f"cases that took more than {BEYOND_BYTES / 2**20:.0f} MiB", f"{beyond}"),
        ("most processor time that one case took", f"{max(findings.spent_s):.1f} s"),
    ]
    wrong = [f"- wrong: {what}: cases {found[:10]}" for what, found in findings.wrong.items()]
    text = (
        f"{tried:,} files were put into the directory of a service, beside a good recording{took}, "
        f"with {libraries}."
    )
    yield Table("", ("", ""), rows, wrong, [text])
    states = ("complete", "interrupted", "damaged")
    of_kinds = [(f"`{kind}`", *(findings.states[kind, s] for s in states)) for kind in KINDS]
    limits = (
        f"The processes could take {MEMORY_BYTES / 2**30:.0f} GiB beyond what they began with. The "
        "length of a text attribute is the one size that cannot be looked at before HDF5 allocates "
        f"it, up to 4 GiB for a moment. A case that takes more than {MOST_SPENT_S:g} s of "
        "processor time counts as one that hangs."
    )
    yield Table("", ("damage", *states), of_kinds, text=[limits])
