"""Whether the daemon stays as it is while it runs for long: memory, descriptors, threads.

Viewers stream range at the paper's video setting while it records without a pause: one recording
after the other, each of which is deleted when the next one runs, so that the disk does not fill.
"""

import statistics
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from benchmarks.common.daemon import VIDEO, Process, daemon
from benchmarks.common.tables import Cell, Table, percentiles
from benchmarks.service.viewers import Seen, Viewer, cut, watch

RANGE = {"type": "subscribe", "v": 1, "subscriptions": [{"product": "range"}]}
SAMPLE_S = 5.0
RECORDING_S = 60.0
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
        process.settle()
        recorder = Recorder(client)
        samples = Samples()
        watching = [Viewer(process.stream_url, RANGE) for _ in range(viewers)]

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


def tables(*, minutes: float = 30.0, viewers: int = 20) -> Iterator[Table]:
    """Run for so many minutes, while so many viewers look on."""
    with tempfile.TemporaryDirectory() as name:
        result = soak(minutes=minutes, viewers=viewers, directory=Path(name))
    missed = f"{statistics.median(result.missing):g} / {max(result.missing)}"
    rows = (
        ("frames captured, of those due", f"{result.frames} of {result.expected:.0f}"),
        ("frames a viewer missed, median / most", missed),
        ("of these reported as dropped", f"{sum(result.dropped)} of {sum(result.missing)}"),
        ("photon to client, p50 / p99", f"{percentiles(result.latencies_ms, (50, 99))} ms"),
        (
            "recordings, frames in them, frames dropped",
            f"{result.recordings}, {result.recorded}, {result.recording_dropped}",
        ),
        ("share of one core", f"{result.cpu_s / result.duration_s:.0%}"),
    )
    text = (
        "`transientcam serve` with the simulated camera at the paper's video setting, "
        f"{viewers} viewers of range, and one recording of {RECORDING_S:g} s after the other, each "
        f"deleted when the next one runs: {minutes:g} minutes, after {SETTLE_S:g} s in which "
        "buffers fill. Whatever else the machine ran meanwhile is in these figures."
    )
    yield Table("", ("", ""), list(rows), text=[text])
    text = (
        f"What the process held, looked at every {SAMPLE_S:g} s; the slope is that of a line "
        "through it, ± its standard error."
    )
    columns = ("", "first minute", "last minute", "least", "most", "slope")
    yield Table("", columns, list(_rows(result.samples)), text=[text])


def _rows(samples: Samples) -> Iterator[list[Cell]]:
    memory = [each / 2**20 for each in samples.memory_bytes]
    minute = max(1, round(60.0 / SAMPLE_S))
    values: list[float]
    for name, values, form in (
        ("memory, MiB", memory, ".1f"),
        ("descriptors", [float(each) for each in samples.descriptors], ".0f"),
        ("threads", [float(each) for each in samples.threads], ".0f"),
    ):
        gradient, error = slope(samples.time_s, values)
        first, last = statistics.mean(values[:minute]), statistics.mean(values[-minute:])
        cells = [format(each, form) for each in (first, last, min(values), max(values))]
        change = round(gradient, 2) + 0.0  # no minus before a zero
        yield [name, *cells, f"{change:+.2f} ± {error:.2f} an hour"]
