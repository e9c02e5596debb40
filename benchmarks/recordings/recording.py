"""What recording costs.

Simulated frames of 16 images at 163 x 120 are recorded, paced at 60 frames/s (six times what the
camera's own sequence of 16 images gives), in a process of its own.
"""

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import h5py

from benchmarks.common.tables import Table, heads, percentiles
from transientcam_driver import AppliedSequence, Capabilities, RawFrame, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.recording import Header, Recording, RecordingWriter

RATE_HZ = 60.0
DIFFERENT_FRAMES = 24
SEQUENCE = Sequence(harmonics=3, zeroth="low-frequency")


@dataclass(frozen=True)
class Cost:
    """What recording for some time took."""

    seconds: float
    frames: int
    cpu_s: float
    append_ms: list[float]
    ratio: float
    expand_ms: float


def captured() -> tuple[list[RawFrame], AppliedSequence, Capabilities]:
    """Return some frames of the simulated camera with all its noise."""
    with open_camera("sim:mirrors?seed=1", clock=VirtualClock()) as camera:
        applied = camera.configure(SEQUENCE)
        camera.start()
        frames = [camera.read_frame() for _ in range(DIFFERENT_FRAMES)]
        return frames, applied, camera.capabilities


def measure_cost(directory: Path, *, seconds: float) -> Cost:
    """Return what writing frames at `RATE_HZ` costs, with a look at the disk every second."""
    frames, applied, capabilities = captured()
    header = Header("benchmark", "benchmark", time.time(), applied, capabilities)
    writer = RecordingWriter(directory / "cost.h5", header)
    append_ms = []
    cpu_s, begin_s = time.process_time(), time.perf_counter()
    for number in range(int(seconds * RATE_HZ)):
        time.sleep(max(0.0, begin_s + number / RATE_HZ - time.perf_counter()))
        before_s = time.perf_counter()
        writer.append(frames[number % len(frames)])
        append_ms.append(1e3 * (time.perf_counter() - before_s))
        writer.synchronise(time.monotonic())
    elapsed_s, spent_s = time.perf_counter() - begin_s, time.process_time() - cpu_s
    writer.close({})
    with Recording(writer.path) as recording:
        before_s = time.perf_counter()
        for _ in recording:
            pass
        expand_ms = 1e3 * (time.perf_counter() - before_s) / recording.frames
        ratio = recording.frames * frames[0].images.nbytes / writer.path.stat().st_size
    return Cost(elapsed_s, len(append_ms), spent_s, append_ms, ratio, expand_ms)


def tables(*, seconds: float = 20.0, directory: Path | None = None) -> Iterator[Table]:
    """Record for so long, in a temporary directory if none is given."""
    with tempfile.TemporaryDirectory(dir=directory) as name:
        cost = measure_cost(Path(name), seconds=seconds)
    libraries = f"h5py {version('h5py')} (HDF5 {h5py.version.hdf5_version}), isal {version('isal')}"
    yield Table(
        "",
        heads(
            "frames | share of one core:.1% | append, median / 99 % / longest, ms | "
            "compression | reading back, with checksum, ms a frame:.1f"
        ),
        [
            (
                cost.frames,
                cost.cpu_s / cost.seconds,
                percentiles(cost.append_ms, (50, 99, 100)),
                f"{cost.ratio:.2f} : 1",
                cost.expand_ms,
            )
        ],
        text=[
            f"Simulated frames of {SEQUENCE.images} images at 163 x 120 with all noise, written at "
            f"{RATE_HZ:g} frames/s for {cost.seconds:.0f} s by one process that does nothing else; "
            "brought to the disk every second. Whatever other programs the machine ran meanwhile "
            f"is in these times; the share of a core is the process's own. With {libraries}."
        ],
    )
