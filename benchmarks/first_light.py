"""How soon the first frame is there, and what streaming at the paper's video rate costs.

Run it with ``python -m benchmarks.first_light [--stream-s 60] [--write]``. It starts
``transientcam serve`` as a user would, first with an empty kernel cache (as after an installation),
then with the cache that run left, and streams range and coefficients at the paper's video setting
(Sec. 6.3: m = 3, 0.5 ms, 12 images, 18.6 Hz, 163 x 120).
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import sync_playwright

import transientcam
from benchmarks.daemon import daemon
from benchmarks.machine import machine

VIDEO = {"base_frequency_hz": 23e6, "harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}
PAGE = Path(__file__).parents[1] / "docs" / "first-light.md"
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
    with (
        daemon(environment=environment) as running,
        transientcam.Camera(running.url) as camera,
    ):
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


def report(cold: list[Start], warm: list[Start], streamed: Streamed) -> str:
    """Return the page."""
    lines = [
        "# First light",
        "",
        "Written by `python -m benchmarks.first_light --write` on",
        f"{machine()}.",
        "",
        "Time from starting the daemon's process, median (and range) of "
        f"{len(cold)} cold and {len(warm)} warm starts;",
        "cold: nothing compiled yet; on screen: the range map is drawn,",
        "in a browser that already ran.",
        "",
        "| | prints its address | first range map over HTTP | on screen |",
        "|---|---|---|---|",
        *(_row(name, starts) for name, starts in (("cold", cold), ("warm", warm))),
        "",
        "Streaming range and coefficients to one client at the paper's video setting",
        "(m = 3, 0.5 ms, 12 images a frame, 163 x 120), simulation included:",
        "",
        "| for | frames/s | frames missing | drops reported | daemon's share of one core "
        "| last image's arrival to client, median / 99 % |",
        "|---|---|---|---|---|---|",
        f"| {streamed.duration_s:.0f} s | {streamed.rate_hz:.2f} | {streamed.missing} "
        f"| {streamed.dropped} | {streamed.cpu_s / streamed.duration_s:.0%} "
        f"| {statistics.median(streamed.latencies_ms):.1f} ms "
        f"/ {statistics.quantiles(streamed.latencies_ms, n=100)[-1]:.1f} ms |",
        "",
    ]
    return "\n".join(lines)


def _row(name: str, starts: list[Start]) -> str:
    def spread(values: list[float]) -> str:
        return f"{statistics.median(values):.2f} s ({min(values):.2f} to {max(values):.2f})"

    columns = (
        [start.address_s for start in starts],
        [start.range_map_s for start in starts],
        [start.on_screen_s for start in starts],
    )
    return f"| {name} | " + " | ".join(map(spread, columns)) + " |"


def main() -> None:
    """Measure, print, and with ``--write`` keep the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stream-s", type=float, default=60.0, help="how long to stream, in s")
    parser.add_argument("--starts", type=int, default=3, help="how many cold and warm starts")
    parser.add_argument("--write", action="store_true", help=f"write docs/{PAGE.name}")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        caches = [Path(directory, str(number)) for number in range(arguments.starts)]
        cold = [measure_start(cache) for cache in caches]
        subprocess.run(
            [Path(sys.executable).with_name("transientcam"), "compile"],
            env=os.environ | {"NUMBA_CACHE_DIR": str(caches[0])},
            check=True,
        )
        warm = [measure_start(caches[0]) for _ in caches]
        streamed = measure_stream(caches[0], duration_s=arguments.stream_s)
    page = report(cold, warm, streamed)
    print(page)
    if arguments.write:
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
