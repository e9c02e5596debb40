"""Whether the daemon stays as it is while it runs for long: memory, descriptors, threads.

Viewers stream range at the paper's video setting while it records without a pause: one recording
after the other, each of which is deleted when the next one runs, so that the disk does not fill.
"""

import statistics
import tempfile
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import httpx
import numpy as np

from benchmarks.common.daemon import VIDEO, Process, daemon
from benchmarks.common.tables import Cell, Table, percentiles
from benchmarks.service.viewers import RANGE, Viewer, cut, spending, watch

SAMPLE_S = 5.0
RECORDING_S = 60.0
SETTLE_S = 120.0
"""Left out at the beginning: buffers and caches fill until then."""


class Sample(NamedTuple):
    """What the daemon's process held at some time."""

    time_s: float
    memory_bytes: int
    descriptors: int
    threads: int

    @classmethod
    def of(cls, process: Process) -> "Sample":
        """Look at it now."""
        held = process.resident_bytes(), process.descriptors(), process.threads()
        return cls(process.age_s(), *held)


HELD: Final = ("memory, MiB", "descriptors", "threads")
"""What a `Sample` holds, in words."""
UNITS: Final = (2**20, 1, 1)


@dataclass(frozen=True)
class Soak:
    """What was seen."""

    frames: int
    expected: float
    missing: list[int]
    dropped: list[int]
    latencies_ms: list[float]
    recorder: "Recorder"
    cpu_s: float
    duration_s: float
    samples: list[Sample]


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
        samples: list[Sample] = []
        watching = [Viewer(process.stream_url, RANGE) for _ in range(viewers)]

        def look() -> None:
            samples.append(Sample.of(process))

        try:
            watch(watching, duration_s=SETTLE_S, every_s=SAMPLE_S, meanwhile=look)
            begin_s = process.age_s()
            duration_s, cpu_s = spending(
                process, watching, duration_s=60.0 * minutes, every_s=SAMPLE_S, meanwhile=look
            )
        finally:
            cut(each.connection for each in watching)
            recorder.stop()
    seen = [each.seen for each in watching]
    return Soak(
        frames=max(each.numbers[-1] for each in seen) - min(each.numbers[0] for each in seen) + 1,
        expected=applied["frame_rate_hz"] * duration_s,
        missing=[each.missing for each in seen],
        dropped=[each.dropped for each in seen],
        latencies_ms=[1e3 * latency_s for each in seen for latency_s in each.latencies_s],
        recorder=recorder,
        cpu_s=cpu_s,
        duration_s=duration_s,
        samples=[each for each in samples if each.time_s >= begin_s],
    )


def slope(time_s: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """Return the slope of a line through values, a hour, and its standard error."""
    time_h = np.asarray(time_s) / 3600.0
    (gradient, _), covariance = np.polyfit(time_h, values, 1, cov=True)
    return float(gradient), float(np.sqrt(covariance[0, 0]))


def tables(*, minutes: float = 30.0, viewers: int = 20) -> Iterator[Table]:
    """Run for so many minutes, while so many viewers look on."""
    with tempfile.TemporaryDirectory() as name:
        result = soak(minutes=minutes, viewers=viewers, directory=Path(name))
    recorder = result.recorder
    missed = f"{statistics.median(result.missing):g} / {max(result.missing)}"
    rows = (
        ("frames captured, of those due", f"{result.frames} of {result.expected:.0f}"),
        ("frames a viewer missed, median / most", missed),
        ("of these reported as dropped", f"{sum(result.dropped)} of {sum(result.missing)}"),
        ("photon to client, p50 / p99", f"{percentiles(result.latencies_ms, (50, 99))} ms"),
        (
            "recordings, frames in them, frames dropped",
            f"{recorder.recordings}, {recorder.frames}, {recorder.dropped}",
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


def _rows(samples: list[Sample]) -> Iterator[list[Cell]]:
    minute = max(1, round(60.0 / SAMPLE_S))
    times_s, *held = zip(*samples, strict=True)
    for name, counts, unit, form in zip(HELD, held, UNITS, (".1f", ".0f", ".0f"), strict=True):
        values = [each / unit for each in counts]
        gradient, error = slope(times_s, values)
        first, last = statistics.mean(values[:minute]), statistics.mean(values[-minute:])
        cells = [format(each, form) for each in (first, last, min(values), max(values))]
        change = round(gradient, 2) + 0.0  # no minus before a zero
        yield [name, *cells, f"{change:+.2f} ± {error:.2f} an hour"]
