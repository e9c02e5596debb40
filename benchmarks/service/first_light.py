"""How soon the first frame is there, and what streaming at the paper's video rate costs."""

import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
from playwright.sync_api import sync_playwright

import transientcam
from benchmarks.common.daemon import VIDEO, daemon
from benchmarks.common.tables import Table, heads, percentiles
from benchmarks.service.throughput import viewed
from benchmarks.service.viewers import ViewerRecord


@dataclass(frozen=True)
class Start:
    """When things were there after the daemon's process was started, in s."""

    address_s: float
    range_map_s: float
    on_screen_s: float


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


def measure_stream(cache: Path, *, duration_s: float) -> tuple[ViewerRecord, float, float]:
    """Return what a client gets of range and coefficients, in which time, and what that costs."""
    with daemon(environment={"NUMBA_CACHE_DIR": str(cache)}) as running:
        httpx.put(f"{running.url}/api/v1/sequence", json=VIDEO).raise_for_status()
        running.settle()
        return viewed(running, "range", "coefficients", duration_s=duration_s)


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
        seen, took_s, cpu_s = measure_stream(caches[0], duration_s=stream_s)
    columns = heads(
        "for, s:.0f | frames/s:.2f | frames missing | drops reported | "
        "daemon's share of one core:.0% | last image's arrival to client, median / 99 %, ms"
    )
    numbers = set(seen.numbers)
    missing = max(numbers) - min(numbers) + 1 - len(numbers)
    # of the second of the two products of a frame
    latency = percentiles([1e3 * each for each in seen.latencies_s[1::2]], (50, 99))
    row = (took_s, len(numbers) / took_s, missing, seen.dropped, cpu_s / took_s, latency)
    text = "Streaming range and coefficients to one client, simulation included:"
    yield Table("", columns, [row], text=[text])


def _row(name: str, starts: list[Start]) -> list[str]:
    cells = [name]
    for step in ("address_s", "range_map_s", "on_screen_s"):
        values = [getattr(start, step) for start in starts]
        median = statistics.median(values)
        cells.append(f"{median:.2f} s ({min(values):.2f} to {max(values):.2f})")
    return cells
