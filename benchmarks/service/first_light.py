"""How soon the first frame is there, and what streaming at the paper's video rate costs."""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import sync_playwright

import transientcam
from benchmarks.common.daemon import VIDEO, daemon
from benchmarks.common.tables import Table, heads, percentiles

SETTLE_S = 5.0
"""Before the measurement: until the kernels are loaded and the new sequence's frames come."""


@dataclass(frozen=True)
class Start:
    """When things were there after the daemon's process was started, in s."""

    address_s: float
    range_map_s: float
    on_screen_s: float


@dataclass(frozen=True)
class Streamed:
    """What one client saw in ``duration_s`` and what the daemon spent on it."""

    duration_s: float
    frames: int
    missing: int
    dropped: int
    cpu_s: float
    latencies_ms: list[float]

    @property
    def rate_hz(self) -> float:
        """Frames a second, by the client's clock."""
        return self.frames / self.duration_s


def measure_start(cache: Path) -> Start:
    """Return when address, range map and picture were there; the browser itself already runs."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium")
        page = browser.new_page()
        with daemon(environment={"NUMBA_CACHE_DIR": str(cache)}) as running:
            with transientcam.Camera(running.url) as camera:
                camera.frame("range", wait_s=10.0)
                range_map_s = running.age_s()
            page.goto(running.url)
            page.wait_for_selector("[data-frame]:not([data-frame=''])")
            on_screen_s = running.age_s()
        browser.close()
    return Start(running.address_s, range_map_s, on_screen_s)


def measure_stream(cache: Path, *, duration_s: float) -> Streamed:
    """Return what a client gets that takes range and coefficients for ``duration_s``."""
    environment = {"NUMBA_CACHE_DIR": str(cache)}
    with daemon(environment=environment) as running, transientcam.Camera(running.url) as camera:
        applied = camera.configure(**VIDEO)
        latencies_ms, numbers = [], set()
        with camera.stream("range", "coefficients") as frames:
            settled_s = time.perf_counter() + SETTLE_S
            frame = frames.receive()
            while (
                frame.meta["sequence_id"] != applied["sequence_id"]
                or frame.product != "coefficients"
                or time.perf_counter() < settled_s
            ):
                frame = frames.receive()
            before = len(frames.notices)
            cpu_s, start_s = running.cpu_s(), time.perf_counter()
            while time.perf_counter() - start_s < duration_s:
                frame = frames.receive()
                if frame.product == "coefficients":  # the second of the two products of a frame
                    numbers.add(frame.frame)
                    latencies_ms.append(1e3 * (time.time() - frame.meta["host_time_s"]))
            elapsed_s, spent_s = time.perf_counter() - start_s, running.cpu_s() - cpu_s
            notices = list(frames.notices)[before:]
    dropped = sum(int(notice.details["count"]) for notice in notices if notice.kind == "dropped")
    missing = max(numbers) - min(numbers) + 1 - len(numbers)
    return Streamed(elapsed_s, len(numbers), missing, dropped, spent_s, latencies_ms)


def tables(*, stream_s: float = 60.0, starts: int = 3) -> Iterator[Table]:
    """Start the daemon with nothing compiled and with everything, and stream to one client.

    Coefficients and range are streamed at the paper's video setting (Sec. 6.3).
    """
    with tempfile.TemporaryDirectory() as directory:
        caches = [Path(directory, str(number)) for number in range(starts)]
        cold = [measure_start(cache) for cache in caches]
        subprocess.run(
            [Path(sys.executable).with_name("transientcam"), "compile"],
            env=os.environ | {"NUMBA_CACHE_DIR": str(caches[0])},
            check=True,
        )
        warm = [measure_start(caches[0]) for _ in caches]
        yield Table(
            "",
            ("", "prints its address", "first range map over HTTP", "on screen"),
            [_row("cold", cold), _row("warm", warm)],
            text=[f"Median (and range) of {starts} cold and {starts} warm starts:"],
        )
        seen = measure_stream(caches[0], duration_s=stream_s)
    columns = heads(
        "for, s:.0f | frames/s:.2f | frames missing | drops reported | "
        "daemon's share of one core:.0% | last image's arrival to client, median / 99 %, ms"
    )
    share = seen.cpu_s / seen.duration_s
    latency = percentiles(seen.latencies_ms, (50, 99))
    row = (seen.duration_s, seen.rate_hz, seen.missing, seen.dropped, share, latency)
    text = "Streaming range and coefficients to one client, simulation included:"
    yield Table("", columns, [row], text=[text])


def _row(name: str, starts: list[Start]) -> list[str]:
    cells = [name]
    for step in ("address_s", "range_map_s", "on_screen_s"):
        values = [getattr(start, step) for start in starts]
        median = statistics.median(values)
        cells.append(f"{median:.2f} s ({min(values):.2f} to {max(values):.2f})")
    return cells
