"""What recording costs, and whether it survives the death of its writer.

Simulated frames of 16 images at 163 x 120 are recorded, paced at 60 frames/s (six times what the
camera's own sequence of 16 images gives), in a process of its own; and such a process is killed
again and again.
"""

import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np

from benchmarks.common.tables import Column, Table, percentiles
from transientcam_driver import AppliedSequence, Capabilities, RawFrame, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.recording import Header, Recording, RecordingWriter, recover

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


@dataclass(frozen=True)
class Kills:
    """What was left by writers that were killed."""

    kills: int
    acknowledged: int
    recovered: int
    lost: int
    torn: int
    recovery_ms: list[float]


def captured() -> tuple[list[RawFrame], AppliedSequence, Capabilities]:
    """Return some frames of the simulated camera with all its noise."""
    with open_camera("sim:mirrors?seed=1", clock=VirtualClock()) as camera:
        applied = camera.configure(SEQUENCE)
        camera.start()
        frames = [camera.read_frame() for _ in range(DIFFERENT_FRAMES)]
        return frames, applied, camera.capabilities


def begin(path: Path) -> tuple[RecordingWriter, list[RawFrame]]:
    """Open a recording and return it with the frames for it."""
    frames, applied, capabilities = captured()
    header = Header("benchmark", "benchmark", time.time(), applied, capabilities)
    return RecordingWriter(path, header), frames


def measure_cost(directory: Path, *, seconds: float) -> Cost:
    """Return what writing frames at `RATE_HZ` costs, with a look at the disk every second."""
    writer, frames = begin(directory / "cost.h5")
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


def write_for_ever(path: Path) -> None:
    """Write frames as fast as it goes, and say after each how many there are."""
    writer, frames = begin(path)
    number = 0
    while True:
        writer.append(frames[number % len(frames)])
        number += 1
        os.write(1, b"%d\n" % number)


def measure_kills(directory: Path, *, kills: int) -> Kills:
    """Kill writers at random moments and compare every frame that recovery finds."""
    frames, _, _ = captured()
    random_number = random.Random(1)
    acknowledged_in_all = recovered_in_all = lost = torn = 0
    recovery_ms = []
    for kill in range(kills):
        path = directory / f"{kill}.h5"
        acknowledged = _killed(path, after_frames=random_number.randint(1, 60))
        before_s = time.perf_counter()
        recover(path.with_name(path.name + ".part"))
        recovery_ms.append(1e3 * (time.perf_counter() - before_s))
        with Recording(path) as recording:
            for number, raw in enumerate(recording):
                torn += not np.array_equal(raw.images, frames[number % len(frames)].images)
            lost += max(0, acknowledged - recording.frames)
            recovered_in_all += recording.frames
        with h5py.File(path):  # by any reader
            pass
        acknowledged_in_all += acknowledged
        path.unlink()
    return Kills(kills, acknowledged_in_all, recovered_in_all, lost, torn, recovery_ms)


def _killed(path: Path, *, after_frames: int) -> int:
    command = [sys.executable, "-m", "benchmarks.recordings.recording", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as writer:
        assert writer.stdout is not None
        acknowledged = 0
        while acknowledged < after_frames:
            acknowledged = int(writer.stdout.readline())
        writer.send_signal(signal.SIGKILL)
        for line in writer.stdout:
            acknowledged = int(line)
    return acknowledged


def tables(
    *, seconds: float = 20.0, kills: int = 100, directory: Path | None = None
) -> Iterator[Table]:
    """Record for so long, and kill so many writers, in a temporary directory if none is given."""
    with tempfile.TemporaryDirectory(dir=directory) as name:
        cost = measure_cost(Path(name), seconds=seconds)
        left = measure_kills(Path(name), kills=kills)
    libraries = f"h5py {version('h5py')} (HDF5 {h5py.version.hdf5_version}), isal {version('isal')}"
    yield Table(
        "",
        (
            "frames",
            Column("share of one core", ".1%"),
            "append, median / 99 % / longest, ms",
            "compression",
            Column("reading back, with checksum, ms a frame", ".1f"),
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
    columns = (
        "kills",
        "frames acknowledged",
        "frames recovered",
        "acknowledged and lost",
        "different",
        Column("recovery, median, ms", ".0f"),
    )
    counts = (left.kills, left.acknowledged, left.recovered, left.lost, left.torn)
    row = (*counts, statistics.median(left.recovery_ms))
    text = (
        "Writers killed (SIGKILL) at a random moment while they write as fast as they can, then "
        "recovered; every frame is compared with what was written."
    )
    yield Table("", columns, [row], text=[text])


if __name__ == "__main__":
    write_for_ever(Path(sys.argv[1]))
