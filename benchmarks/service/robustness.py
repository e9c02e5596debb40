"""What becomes of the service when the camera is unplugged again and again under load.

Viewers stream range and coefficients at the paper's video setting while the camera is unplugged and
plugged in again. A daemon is also ended with SIGTERM at moments when it is starting, compiling and
streaming, and one is killed while it records.
"""

import statistics
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import httpx

import transientcam
from benchmarks.common.daemon import VIDEO, daemon
from benchmarks.common.tables import Table, met
from benchmarks.recordings import kills as killing
from benchmarks.service.soak import Sample
from benchmarks.service.viewers import Viewer, cut, watch
from transientcam import wire
from transientcam.stream_state import Reconnect

SUBSCRIBE = wire.Subscribe(
    (wire.Subscription("range"), wire.Subscription("coefficients"))
).to_document()
SEEN_BAR_S = 1.0
BACK_BAR_S = 5.0
END_BAR_S = 5.0
HISTORY_S = 12.0
"""Frames of so long are kept, and memory grows until then."""
WARM_UP = 20
"""Unplugs before the memory that growth is measured from."""
END_AFTER_S = (0.0, 0.5, 2.0, 5.0, 10.0)


@dataclass
class Unplugs:
    """What was seen of the camera going and coming."""

    seen_s: list[float] = field(default_factory=list)
    """From the unplug to the notice ``camera-lost``, of each."""
    back_s: list[float] = field(default_factory=list)
    """From the replug to the first new frame."""
    samples: list[Sample] = field(default_factory=list)
    missing: list[int] = field(default_factory=list)
    recorded: int = 0


def measure_unplugs(directory: Path, *, unplugs: int, viewers: int) -> Unplugs:
    """Unplug and replug so often, and look how long it takes and what it leaves."""
    environment = {"XDG_DATA_HOME": str(directory)}
    with (
        daemon("--camera", "sim:mirrors", environment=environment) as process,
        transientcam.Camera(process.url) as camera,
    ):
        camera.configure(**VIDEO)
        process.settle()
        time.sleep(HISTORY_S)
        watching = [Viewer(process.stream_url, SUBSCRIBE) for _ in range(viewers)]
        with camera.stream("flags", reconnect=Reconnect()) as stream:
            stream.receive()
            recording = camera.record(name="robustness")
            found = Unplugs()
            try:
                for _ in range(unplugs):
                    _unplug(camera, stream, watching, found)
                    found.samples.append(Sample.of(process))
            finally:
                cut(each.connection for each in watching)
        found.recorded = camera.stop_recording(recording["id"])["frames"]
    for each in watching:
        numbers = each.seen.numbers[::2]  # two products a frame
        found.missing.append(numbers[-1] - numbers[0] + 1 - len(numbers) - each.seen.dropped // 2)
    return found


def _unplug(
    camera: transientcam.Camera,
    stream: transientcam.Stream,
    watching: Sequence[Viewer],
    found: Unplugs,
) -> None:
    begin_s = time.perf_counter()
    camera.cause("unplug")
    while not any(each.kind == "camera-lost" for each in list(stream.notices)):
        watch(watching, duration_s=0.01)
        _drain(stream)
    found.seen_s.append(time.perf_counter() - begin_s)
    stream.notices.clear()  # type: ignore[attr-defined]  # a deque, of which this is the reader
    begin_s = time.perf_counter()
    camera.cause("replug")
    frames = camera.acquisition["frames"]
    while camera.acquisition["frames"] == frames:
        watch(watching, duration_s=0.01)
        _drain(stream)
    found.back_s.append(time.perf_counter() - begin_s)
    watch(watching, duration_s=0.3)
    _drain(stream)
    stream.notices.clear()  # type: ignore[attr-defined]  # the same


def _drain(stream: transientcam.Stream) -> None:
    """Take in everything that waits."""
    try:
        while True:
            stream.receive(timeout_s=0.0)
    except transientcam.FrameTimeout:
        pass


def measure_ends(directory: Path) -> list[tuple[float, float, bool]]:
    """Return for some moments how long the end took after SIGTERM, and whether it compiled then."""
    ends = []
    for number, after_s in enumerate(END_AFTER_S):
        cache = directory / f"kernels-{number}"
        environment = {"NUMBA_CACHE_DIR": str(cache), "XDG_DATA_HOME": str(directory)}
        with daemon("--camera", "sim:mirrors", environment=environment) as process:
            time.sleep(after_s)
            kernels = httpx.get(f"{process.url}/api/v1/info", timeout=30.0).json()["kernels"]
            httpx.post(f"{process.url}/api/v1/recordings", json={}, timeout=30.0).raise_for_status()
            begin_s = time.perf_counter()
        ends.append((after_s, time.perf_counter() - begin_s, kernels is not None))
    return ends


def tables(*, unplugs: int = 100, viewers: int = 10, kills: int = 100) -> Iterator[Table]:
    """Unplug the camera so often beside viewers, end daemons, and kill one so often."""
    with tempfile.TemporaryDirectory() as name:
        seen = measure_unplugs(Path(name), unplugs=unplugs, viewers=viewers)
        yield _unplugged(seen, viewers)
        yield _ended(measure_ends(Path(name)))
        yield killing.table(killing.measure_kills(Path(name) / "kills", kills=kills))


def _unplugged(seen: Unplugs, viewers: int) -> Table:
    warm, last = seen.samples[min(WARM_UP, len(seen.samples) - 1)], seen.samples[-1]
    rows = []
    for name, values_s, bar_s in (
        ("unplug to the notice `camera-lost`", seen.seen_s, SEEN_BAR_S),
        ("replug to the next frame", seen.back_s, BACK_BAR_S),
    ):
        median, longest = statistics.median(values_s), max(values_s)
        reached = f"{bar_s:g} s, {met(longest <= bar_s)}"
        rows.append((name, f"{median:.2f} s", f"{longest:.2f} s", reached))
    return Table(
        "Unplugged under load",
        ("", "median", "longest", "bar"),
        rows,
        [
            f"Growth from unplug {WARM_UP} to the last: "
            f"{(last.memory_bytes - warm.memory_bytes) / 2**20:+.1f} MiB of memory, "
            f"{last.descriptors - warm.descriptors:+d} descriptors, "
            f"{last.threads - warm.threads:+d} threads. "
            "Frames that a viewer neither received nor had reported as dropped: "
            f"{max(seen.missing)} at most. Frames in the recording: {seen.recorded}."
        ],
        [
            "`transientcam serve` with the simulated camera at 18.6 Hz, "
            f"{viewers} viewers of range and coefficients, and a recording. The camera was "
            f"unplugged and plugged in again {len(seen.seen_s)} times."
        ],
    )


def _ended(ends: list[tuple[float, float, bool]]) -> Table:
    return Table(
        "Ended by SIGTERM",
        ("after", "a kernel was being compiled", "exit after"),
        [
            (f"{after_s:g} s", "yes" if compiling else "no", f"{end_s:.2f} s")
            for after_s, end_s, compiling in ends
        ],
        [f"- Bar: {END_BAR_S:g} s, {met(max(end_s for _, end_s, _ in ends) <= END_BAR_S)}."],
        ["With a recording that runs and an empty kernel cache, so long after it listened."],
    )
