"""Whether the daemon stays as it is while it runs for long: memory, descriptors, threads.

Run it with ``python -m benchmarks.soak [--minutes 30] [--viewers 20] [--write]``. It starts
``transientcam serve`` with the simulated camera at the paper's video setting (Sec. 6.3: 18.6 Hz),
lets viewers stream range, and records without a pause: one recording after the other, each of which
is deleted when the next one runs, so that the disk does not fill.
"""

import argparse
import statistics
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from benchmarks.daemon import Process, daemon
from benchmarks.machine import machine
from benchmarks.viewers import Seen, Viewer, cut, watch

PAGE = Path(__file__).parents[1] / "docs" / "soak.md"
VIDEO = {"base_frequency_hz": 23e6, "harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}
RANGE = {"type": "subscribe", "v": 1, "subscriptions": [{"product": "range"}]}
SAMPLE_S = 5.0
RECORDING_S = 60.0
COMPILED_WITHIN_S = 900.0
SETTLE_S = 120.0
"""Left out at the beginning: buffers and caches fill until then."""


@dataclass
class Samples:
    """What the daemon's process held at some times."""

    time_s: list[float] = field(default_factory=list)
    memory_bytes: list[int] = field(default_factory=list)
    descriptors: list[int] = field(default_factory=list)
    threads: list[int] = field(default_factory=list)

    def take(self, process: Process) -> None:
        """Look once."""
        self.time_s.append(process.age_s())
        self.memory_bytes.append(process.resident_bytes())
        self.descriptors.append(process.descriptors())
        self.threads.append(process.threads())


@dataclass(frozen=True)
class Soak:
    """What was seen."""

    minutes: float
    viewers: int
    frames: int
    expected: float
    missing: list[int]
    dropped: list[int]
    latencies_ms: list[float]
    recordings: int
    recorded: int
    recording_dropped: int
    cpu_s: float
    duration_s: float
    samples: Samples


class Recorder:
    """Records one minute after the other, and deletes what it has recorded, on its own thread."""

    def __init__(self, client: httpx.Client) -> None:
        self._client = client
        self._running: str | None = None
        self.recordings = self.frames = self.dropped = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._ending.wait(1.0):
            self._look()

    def _look(self) -> None:
        """Start the next recording where none runs."""
        if self._running is not None:
            document = self._client.get(f"recordings/{self._running}").json()
            if document["state"] != "complete":
                return
            self.recordings += 1
            self.frames += document["frames"]
            self.dropped += document["dropped_frames"]
            self._client.delete(f"recordings/{self._running}").raise_for_status()
        wanted = {"name": "soak", "duration_s": RECORDING_S}
        self._running = self._client.post("recordings", json=wanted).raise_for_status().json()["id"]

    def stop(self) -> None:
        """End the last one."""
        self._ending.set()
        self._thread.join()
        if self._running is not None:
            self._client.post(f"recordings/{self._running}/stop").raise_for_status()
            self._client.delete(f"recordings/{self._running}").raise_for_status()


def soak(*, minutes: float, viewers: int, directory: Path) -> Soak:
    """Run the daemon for so long under load, and look at it all the while."""
    environment = {"XDG_DATA_HOME": str(directory)}
    with (
        daemon("--camera", "sim:mirrors", environment=environment) as process,
        httpx.Client(base_url=f"{process.url}/api/v1/", timeout=60.0) as client,
    ):
        applied = client.put("sequence", json=VIDEO).raise_for_status().json()
        _await_kernels(client)
        recorder = Recorder(client)
        samples = Samples()
        url = process.url.replace("http", "ws", 1) + "/api/v1/stream"
        watching = [Viewer(url, RANGE) for _ in range(viewers)]

        def look() -> None:
            samples.take(process)

        try:
            watch(watching, duration_s=SETTLE_S, every_s=SAMPLE_S, meanwhile=look)
            for each in watching:
                each.seen = Seen()
            cpu_s = process.cpu_s()
            begin_s = process.age_s()
            duration_s = watch(
                watching, duration_s=60.0 * minutes, every_s=SAMPLE_S, meanwhile=look
            )
            cpu_s = process.cpu_s() - cpu_s
        finally:
            cut(each.connection for each in watching)
            recorder.stop()
        return _soak(
            watching, recorder, _since(samples, begin_s), minutes, duration_s, cpu_s, applied
        )


def _await_kernels(client: httpx.Client) -> None:
    end_s = time.monotonic() + COMPILED_WITHIN_S
    while client.get("info").json()["kernels"]["compiling"] and time.monotonic() < end_s:
        time.sleep(1.0)


def _since(samples: Samples, begin_s: float) -> Samples:
    first = next(index for index, each in enumerate(samples.time_s) if each >= begin_s)
    return Samples(
        samples.time_s[first:],
        samples.memory_bytes[first:],
        samples.descriptors[first:],
        samples.threads[first:],
    )


def _soak(
    watching: list[Viewer],
    recorder: Recorder,
    samples: Samples,
    minutes: float,
    duration_s: float,
    cpu_s: float,
    applied: dict[str, Any],
) -> Soak:
    seen = [each.seen for each in watching]
    numbers = [each.numbers for each in seen]
    return Soak(
        minutes=minutes,
        viewers=len(watching),
        frames=max(each[-1] for each in numbers) - min(each[0] for each in numbers) + 1,
        expected=applied["frame_rate_hz"] * duration_s,
        missing=[each[-1] - each[0] + 1 - len(each) for each in numbers],
        dropped=[each.dropped for each in seen],
        latencies_ms=[1e3 * latency_s for each in seen for latency_s in each.latencies_s],
        recordings=recorder.recordings,
        recorded=recorder.frames,
        recording_dropped=recorder.dropped,
        cpu_s=cpu_s,
        duration_s=duration_s,
        samples=samples,
    )


def slope(time_s: list[float], values: list[float]) -> tuple[float, float]:
    """Return the slope of a line through values, a hour, and its standard error."""
    time_h = np.asarray(time_s) / 3600.0
    (gradient, _), covariance = np.polyfit(time_h, values, 1, cov=True)
    return float(gradient), float(np.sqrt(covariance[0, 0]))


def report(result: Soak) -> str:
    """Return the page."""
    latencies = statistics.quantiles(result.latencies_ms, n=100)
    share = result.cpu_s / result.duration_s
    return "\n".join(
        [
            f"# {result.minutes:g} minutes at full rate",
            "",
            f"Written by `python -m benchmarks.soak --minutes {result.minutes:g} --write` on",
            f"{machine()}.",
            "",
            f"`transientcam serve` with the simulated camera at the paper's video setting, "
            f"{result.viewers} viewers of range, and one",
            f"recording of {RECORDING_S:g} s after the other, each deleted when the next one runs: "
            f"{result.minutes:g} minutes, after {SETTLE_S:g} s",
            "in which buffers fill. Whatever else the machine ran meanwhile is in these figures.",
            "",
            "| | |",
            "|---|---|",
            f"| frames captured, of those due | {result.frames} of {result.expected:.0f} |",
            f"| frames a viewer missed, median / most | {statistics.median(result.missing):g} "
            f"/ {max(result.missing)} |",
            f"| of these reported as dropped | {sum(result.dropped)} of {sum(result.missing)} |",
            f"| photon to client, p50 / p99 | {latencies[49]:.1f} / {latencies[98]:.1f} ms |",
            f"| recordings, frames in them, frames dropped | {result.recordings}, "
            f"{result.recorded}, {result.recording_dropped} |",
            f"| share of one core | {share:.0%} |",
            "",
            f"What the process held, looked at every {SAMPLE_S:g} s; "
            "the slope is that of a line through it, ± its standard error.",
            "",
            "| | first minute | last minute | least | most | slope |",
            "|---|---:|---:|---:|---:|---:|",
            *_rows(result.samples),
            "",
        ]
    )


def _rows(samples: Samples) -> list[str]:
    memory = [each / 2**20 for each in samples.memory_bytes]
    rows: list[tuple[str, list[float], str]] = [
        ("memory, MiB", memory, ".1f"),
        ("descriptors", [float(each) for each in samples.descriptors], ".0f"),
        ("threads", [float(each) for each in samples.threads], ".0f"),
    ]
    minute = max(1, round(60.0 / SAMPLE_S))
    lines = []
    for name, values, form in rows:
        gradient, error = slope(samples.time_s, values)
        parts = (
            statistics.mean(values[:minute]),
            statistics.mean(values[-minute:]),
            min(values),
            max(values),
        )
        cells = " | ".join(format(each, form) for each in parts)
        change = round(gradient, 2) + 0.0  # no minus before a zero
        lines.append(f"| {name} | {cells} | {change:+.2f} ± {error:.2f} an hour |")
    return lines


def main() -> None:
    """Soak, print, and with ``--write`` keep the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0, help="how long")
    parser.add_argument("--viewers", type=int, default=20, help="how many look on")
    parser.add_argument("--write", action="store_true", help=f"write docs/{PAGE.name}")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        result = soak(minutes=arguments.minutes, viewers=arguments.viewers, directory=Path(name))
    page = report(result)
    print(page)
    if arguments.write:
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
