"""What a frame costs the running daemon, from the raw frame to the encoded product.

A short recording of the simulated camera is replayed in a loop from memory, so that nothing is
simulated while the daemon is measured; one viewer reads the range. The daemon of a checkout of an
earlier commit is measured in turn with this one's. The latency is that of the simulated camera.
"""

import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import httpx

from benchmarks.common.daemon import VIDEO, Process, running
from benchmarks.common.machine import commit_of
from benchmarks.common.recordings import record
from benchmarks.common.records import ROOT
from benchmarks.common.tables import Table, heads, met
from benchmarks.service.viewers import Viewer, ViewerRecord, cut, spending, watch
from transientcam_driver import Sequence

SIZES: Final = ((163, 120), (640, 480))
HARMONICS: Final = (3, 4, 8)
BASE_HZ: Final = {3: 23e6, 4: 23e6, 8: 11.5e6}
RECORDED_FRAMES: Final = 4
PACED_HZ: Final = 10.0
"""Rate at which the cost of a frame is measured, where a daemon delivers twice as many."""
OFFERED_HZ: Final = {163: 600.0, 640: 120.0}
"""Rate that no daemon keeps up with, for the frames a second that it delivers at most."""
COMPUTED: Final = ("direct", "indirect", "coefficients")
"""What is computed of each frame beside the range."""
BAR_HZ: Final = 60.0
_SETTLE_S = 2.0
_COMPILED_WITHIN_S = 240.0


@dataclass(frozen=True)
class Daemon:
    """The daemon of a checkout, and the estimator that its frames are computed with."""

    tree: Path
    estimator: str = "pisarenko"


@dataclass(frozen=True)
class Cost:
    """What frames of one size and order cost one daemon."""

    cpu_ms: float
    """Processor time of a frame that a viewer takes the range of, beyond that of a daemon that
    replays without a viewer."""
    replay_ms: float
    """Processor time of a frame without a viewer."""
    rate_hz: float
    """Frames a second that the viewer gets where far more are offered."""


@contextmanager
def daemon_of(daemon: Daemon, camera: str) -> Iterator[Process]:
    """Run the daemon of a checkout once all its kernels are compiled."""
    path = ":".join(str(daemon.tree / name) for name in ("client", "driver", "server"))
    program = Path(sys.executable).with_name("transientcam")
    command: list[str | Path] = [program, "serve", "--port", "0", "--camera", camera]
    environment = {"PYTHONPATH": path, "TRANSIENTCAM_RECONSTRUCTION__ESTIMATOR": daemon.estimator}
    with running(command, environment) as process:
        process.settle(_COMPILED_WITHIN_S)
        yield process


def _subscribe(*products: str, computed: tuple[str, ...] = ()) -> dict[str, object]:
    """Return a subscription; of ``computed`` one pixel is sent, which are computed whole for it."""
    whole: list[dict[str, object]] = [{"product": each, "max_rate_hz": None} for each in products]
    pixels = [{"product": each, "max_rate_hz": None, "region": [0, 0, 1, 1]} for each in computed]
    subscriptions = whole + pixels
    return {"type": "subscribe", "v": 1, "token": None, "subscriptions": subscriptions}


def viewed(
    process: Process, *products: str, computed: tuple[str, ...] = (), duration_s: float
) -> tuple[ViewerRecord, float, float]:
    """Return what one viewer saw, in which time, and what the daemon spent in it."""
    viewer = Viewer(process.stream_url, _subscribe(*products, computed=computed))
    watch([viewer], duration_s=_SETTLE_S)
    elapsed_s, spent_s = spending(process, [viewer], duration_s=duration_s)
    cut([viewer.connection])
    return viewer.seen, elapsed_s, spent_s


def _idle_cost_s(process: Process, duration_s: float) -> float:
    time.sleep(_SETTLE_S)
    before_s = process.cpu_s()
    time.sleep(duration_s)
    return (process.cpu_s() - before_s) / duration_s


def measure(
    daemon: Daemon, recording: Path, recorded_hz: float, width: int, *, duration_s: float
) -> Cost:
    """Return what frames of a recording cost the daemon of a checkout."""
    offered_hz = OFFERED_HZ[width]
    replay = f"recording:{recording}?loop=on&speed="
    with daemon_of(daemon, f"{replay}{offered_hz / recorded_hz:.6f}") as process:
        seen, elapsed_s, _ = viewed(process, "range", computed=COMPUTED, duration_s=duration_s)
        most_hz = len(set(seen.numbers)) / elapsed_s
    paced_hz = min(PACED_HZ, 0.5 * most_hz)
    with daemon_of(daemon, f"{replay}{paced_hz / recorded_hz:.6f}") as process:
        idle_s = _idle_cost_s(process, duration_s)
        seen, elapsed_s, spent_s = viewed(
            process, "range", computed=COMPUTED, duration_s=duration_s
        )
        rate_hz = len(set(seen.numbers)) / elapsed_s
        assert rate_hz > 0.9 * paced_hz, f"{rate_hz:.1f} of {paced_hz:g} frames a second"
        cpu_ms = 1e3 * (spent_s / elapsed_s - idle_s) / rate_hz
    return Cost(cpu_ms, 1e3 * idle_s / paced_hz, most_hz)


def latency(daemon: Daemon, *, duration_s: float) -> tuple[float, float]:
    """Return p50 and p99 of the time from a frame's last image to a client, in ms."""
    with daemon_of(daemon, "sim:mirrors") as process:
        httpx.put(f"{process.url}/api/v1/sequence", json=VIDEO).raise_for_status()
        seen, _, _ = viewed(process, "range", "coefficients", duration_s=duration_s)
    latencies_ms = sorted(1e3 * each for each in seen.latencies_s)
    return statistics.median(latencies_ms), latencies_ms[int(0.99 * len(latencies_ms))]


def tables(*, against: Path | None = None, seconds: float = 8.0) -> Iterator[Table]:
    """Measure each figure for so many seconds; of ``against``, an earlier commit's checkout, too.

    Processor time is what a frame takes beyond a daemon that replays without a viewer.
    """
    daemons = {"now": Daemon(ROOT), "now, likelihood": Daemon(ROOT, "likelihood")}
    before = []
    if against is not None:
        daemons = {"before": Daemon(against)} | daemons
        before = [f"*Before* is the daemon of commit {commit_of(against)}."]
    columns = heads(
        "image | m | daemon | processor time, ms/frame:.2f | replay alone, ms/frame:.2f | "
        "frames/s:.0f"
    )
    costs = Table("", columns, text=[f"Each figure is one run of {seconds:g} s.", *before])
    with tempfile.TemporaryDirectory() as name:
        for width, height in SIZES:
            for harmonics in HARMONICS:
                recording = Path(name) / f"{width}-{harmonics}.h5"
                spec = f"sim:mirrors?width={width}&height={height}&seed=1"
                sequence = Sequence(base_frequency_hz=BASE_HZ[harmonics], harmonics=harmonics)
                rate_hz = record(
                    recording, spec, sequence, RECORDED_FRAMES, distinct=RECORDED_FRAMES
                ).frame_rate_hz
                for when, daemon in daemons.items():
                    cost = measure(daemon, recording, rate_hz, width, duration_s=seconds)
                    print(f"{width} x {height}, m = {harmonics}, {when}: {cost}", flush=True)
                    image = f"{width} x {height}"
                    row = (image, harmonics, when, cost.cpu_ms, cost.replay_ms, cost.rate_hz)
                    costs.rows.append(row)
    rate_hz = next(row[-1] for row in costs.rows if row[:3] == ("640 x 480", 4, "now"))
    costs.notes.append(f"- Bar: 640 x 480, m = 4: {BAR_HZ:g} frames/s, {met(rate_hz >= BAR_HZ)}.")
    yield costs
    yield Table(
        "",
        heads("daemon | p50, ms:.1f | p99, ms:.1f"),
        [(when, *latency(each, duration_s=3 * seconds)) for when, each in daemons.items()],
        text=[
            "Latency, from the arrival of a frame's last image to a client that reads range and "
            "coefficients (simulated camera, m = 3, 0.5 ms, 163 x 120, 18.6 Hz):"
        ],
    )
