"""What becomes of the service when the camera is unplugged again and again under load.

Run it with ``python -m benchmarks.robustness [--unplugs 100] [--viewers 10] [--write]``. It starts
``transientcam serve`` with the simulated camera at the paper's video setting (Sec. 6.3: 18.6 Hz),
lets viewers stream range and coefficients, records, unplugs the camera, and plugs it in again. It
also ends a daemon with SIGTERM at moments when it is starting, compiling and streaming, and kills
one while it records (``--kills 100``).
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import httpx

import transientcam
from benchmarks import kills
from benchmarks.daemon import Process, daemon
from benchmarks.machine import machine
from benchmarks.viewers import Viewer, cut, watch
from transientcam.stream_state import Reconnect

PAGE = Path(__file__).parents[1] / "docs" / "robustness.md"
VIDEO = {"base_frequency_hz": 23e6, "harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}
SUBSCRIBE = {
    "type": "subscribe",
    "v": 1,
    "subscriptions": [{"product": "range"}, {"product": "coefficients"}],
}
SEEN_BAR_S = 1.0
BACK_BAR_S = 5.0
END_BAR_S = 5.0
SETTLE_WITHIN_S = 900.0
HISTORY_S = 12.0
WARM_UP = 20
"""Unplugs before the memory that growth is measured from."""
END_AFTER_S = (0.0, 0.5, 2.0, 5.0, 10.0)


@dataclass
class Unplugs:
    """What was seen of the camera going and coming.

    Attributes
    ----------
    seen_s
        From the unplug to the notice ``camera-lost``, of each.
    back_s
        From the replug to the first new frame.
    """

    seen_s: list[float] = field(default_factory=list)
    back_s: list[float] = field(default_factory=list)
    memory_bytes: list[int] = field(default_factory=list)
    descriptors: list[int] = field(default_factory=list)
    threads: list[int] = field(default_factory=list)
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
        settle(camera)
        url = process.url.replace("http", "ws", 1) + "/api/v1/stream"
        watching = [Viewer(url, SUBSCRIBE) for _ in range(viewers)]
        with camera.stream("flags", reconnect=Reconnect()) as stream:
            stream.receive()
            recording = camera.record(name="robustness")
            found = Unplugs()
            try:
                for _ in range(unplugs):
                    _unplug(camera, stream, watching, found)
                    _look(process, found)
            finally:
                cut(each.connection for each in watching)
        found.recorded = camera.stop_recording(recording["id"])["frames"]
    for each in watching:
        numbers = each.seen.numbers[::2]  # two products a frame
        found.missing.append(numbers[-1] - numbers[0] + 1 - len(numbers) - each.seen.dropped // 2)
    return found


def settle(camera: transientcam.Camera) -> None:
    """Wait until the kernels are there, and the frames of the last seconds are kept."""
    end_s = time.perf_counter() + SETTLE_WITHIN_S
    while camera.info["kernels"]["compiling"] and time.perf_counter() < end_s:
        time.sleep(0.5)
    time.sleep(HISTORY_S)


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


def _look(process: Process, found: Unplugs) -> None:
    found.memory_bytes.append(process.resident_bytes())
    found.descriptors.append(process.descriptors())
    found.threads.append(process.threads())


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
        ends.append((after_s, time.perf_counter() - begin_s, kernels["compiling"] is not None))
    return ends


def report(
    unplugs: Unplugs,
    ends: list[tuple[float, float, bool]],
    killed: list[kills.Kill],
    *,
    viewers: int,
) -> str:
    """Return the page."""
    return "\n".join(
        [
            "# What the service survives",
            "",
            "Written by `python -m benchmarks.robustness --write` on",
            f"{machine()}.",
            "Whatever else the machine ran meanwhile is in these figures.",
            "",
            "## Unplugged under load",
            "",
            "`transientcam serve` with the simulated camera at 18.6 Hz, "
            f"{viewers} viewers of range and coefficients, and a recording.",
            f"The camera was unplugged and plugged in again {len(unplugs.seen_s)} times.",
            "",
            "| | median | longest | bar |",
            "|---|---:|---:|---|",
            _row("unplug to the notice `camera-lost`", unplugs.seen_s, SEEN_BAR_S),
            _row("replug to the next frame", unplugs.back_s, BACK_BAR_S),
            "",
            f"Growth from unplug {WARM_UP} to the last: "
            f"{_growth(unplugs.memory_bytes) / 2**20:+.1f} MiB of memory, "
            f"{_growth(unplugs.descriptors):+d} descriptors, "
            f"{_growth(unplugs.threads):+d} threads.",
            "Frames that a viewer neither received nor had reported as dropped: "
            f"{max(unplugs.missing)} at most. Frames in the recording: {unplugs.recorded}.",
            "",
            "## Ended by SIGTERM",
            "",
            "With a recording that runs and an empty kernel cache, so long after it listened.",
            "",
            "| after | a kernel was being compiled | exit after |",
            "|---:|---|---:|",
            *(
                f"| {after_s:g} s | {'yes' if compiling else 'no'} | {end_s:.2f} s |"
                for after_s, end_s, compiling in ends
            ),
            "",
            f"Bar: {END_BAR_S:g} s, {_met(max(end_s for _, end_s, _ in ends) <= END_BAR_S)}.",
            "",
            *kills.report(killed),
        ]
    )


def _row(name: str, values_s: list[float], bar_s: float) -> str:
    median, longest = statistics.median(values_s), max(values_s)
    return f"| {name} | {median:.2f} s | {longest:.2f} s | {bar_s:g} s, {_met(longest <= bar_s)} |"


def _met(met: bool) -> str:
    return "met" if met else "missed"


def _growth(values: list[int]) -> int:
    return values[-1] - values[min(WARM_UP, len(values) - 1)]


def main() -> None:
    """Measure, print, and with ``--write`` keep the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--unplugs", type=int, default=100, help="how often")
    parser.add_argument("--viewers", type=int, default=10, help="how many look on")
    parser.add_argument("--kills", type=int, default=100, help="how often, while it records")
    parser.add_argument("--write", action="store_true", help=f"write docs/{PAGE.name}")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        unplugs = measure_unplugs(Path(name), unplugs=arguments.unplugs, viewers=arguments.viewers)
        ends = measure_ends(Path(name))
        killed = kills.measure_kills(Path(name) / "kills", kills=arguments.kills)
    page = report(unplugs, ends, killed, viewers=arguments.viewers)
    print(page)
    if arguments.write:
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
