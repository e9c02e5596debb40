"""Recordings over the network and on a cluster: bytes, efficiency, what 100 workers need."""

import dataclasses
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import distributed
import xarray

import transientcam
from benchmarks.common.daemon import daemon
from benchmarks.common.recordings import record
from benchmarks.common.tables import Column, Table, heads, verdict
from benchmarks.service.byte_counter import ByteCounter
from transientcam_driver import Sequence
from transientcam_server.offline import BatchOptions, reconstruct_on
from transientcam_server.offline._job import BLOCK_FRAMES
from transientcam_server.settings import ReconstructionSettings

FRAMES: Final = 2000
_CAMERA: Final = "sim:mirrors?seed=5"
_HARMONICS: Final = 4
_SEQUENCE: Final = Sequence(harmonics=_HARMONICS, zeroth="estimated", exposure_s=5e-4)
_DISTINCT: Final = 8
"""Frames that are simulated; the recording repeats them."""
_PRODUCTS: Final = ("range", "direct", "indirect", "validity", "flags")
_ESTIMATOR: Final = "likelihood"
_BAR: Final = 0.85
_WORKERS: Final = 100
_PIXELS: Final = 640 * 480
_HOUR_FRAMES: Final = 36_000
"""An hour at 10 frames a second."""
_EMPTY_TASKS: Final = 5000


def bytes_moved(directory: Path) -> Table:
    """Return what travels from a daemon for a slice of a recording, by every way to read it."""
    path = directory / "slices.h5"
    record(path, _CAMERA, _SEQUENCE, 200, distinct=_DISTINCT)
    table = Table(
        "Bytes moved for a slice",
        ("read", *(Column(f"{what}, KiB", ".0f") for what in ("open", "one frame", "ten frames"))),
        notes=[
            f"A recording of 200 frames at 163 x 120, m = {_HARMONICS}, "
            f"{path.stat().st_size / 1024:.0f} KiB. Counted between client and daemon, with the "
            "heads of requests and answers."
        ],
    )
    environment = {"TRANSIENTCAM_RECORDINGS__DIRECTORY": str(directory)}
    with daemon("--camera", _CAMERA, environment=environment) as process:
        for name, openly in _WAYS.items():
            with ByteCounter(process.url) as counter:
                sizes = []
                read = openly(f"{counter.url}/api/v1/recordings/slices")
                sizes.append(counter.taken())
                for frames in (slice(100, 101), slice(120, 130)):
                    read(frames)
                    sizes.append(counter.taken())
            table.rows.append((name, *(size / 1024 for size in sizes)))
    return table


def _by_zarr(url: str) -> Callable[[slice], object]:
    dataset = xarray.open_zarr(f"{url}/zarr", chunks=None)
    return lambda frames: dataset["raw"][frames].to_numpy()


def _by_ranges(url: str) -> Callable[[slice], object]:
    recording = transientcam.open(url)
    return lambda frames: recording.raw[frames]


_WAYS: Final[dict[str, Callable[[str], Callable[[slice], object]]]] = {
    "`xarray.open_zarr`": _by_zarr,
    "`transientcam.open`": _by_ranges,
}


@dataclasses.dataclass(frozen=True)
class Measured:
    """What one process spends on a frame at 163 x 120, and a scheduler on a task."""

    frame_s: float
    pixels: int
    read_bytes: float
    written_bytes: float
    task_s: float


def efficiency(directory: Path) -> tuple[Table, Measured]:
    """Return the time of 2 processes against that of 1."""
    recording, first = directory / "long.h5", directory / "first.h5"
    record(recording, _CAMERA, _SEQUENCE, FRAMES, distinct=_DISTINCT)
    record(first, _CAMERA, _SEQUENCE, 2 * BLOCK_FRAMES, distinct=_DISTINCT)
    options = BatchOptions(_PRODUCTS, ReconstructionSettings(estimator=_ESTIMATOR))
    table = Table(
        f"{FRAMES} frames at 163 x 120, m = {_HARMONICS}",
        heads("processes | time, s:.1f | frames a second:.0f | efficiency:.0%"),
        notes=[
            f"Products {', '.join(_PRODUCTS)}, estimator {_ESTIMATOR}, one thread a process. "
            f"{_DISTINCT} simulated frames are repeated. Workers had computed another recording "
            "before: their start and the loading of kernels are not in these times."
        ],
    )
    times_s = []
    for workers in (1, 2):
        with (
            distributed.LocalCluster(
                n_workers=workers, threads_per_worker=1, dashboard_address="127.0.0.1:0"
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            reconstruct_on(client, str(first), str(directory / f"w{workers}.zarr"), options)
            begin_s = time.perf_counter()
            output = directory / f"{workers}.zarr"
            reconstruct_on(client, str(recording), str(output), options)
            times_s.append(time.perf_counter() - begin_s)
            task_s = _task_s(client)
        share = times_s[0] / (workers * times_s[-1])
        table.rows.append((str(workers), times_s[-1], FRAMES / times_s[-1], share))
    table.notes.append(verdict(share, _BAR, "efficiency of 2 processes"))
    written = sum(each.stat().st_size for each in output.rglob("*") if each.is_file())
    size = recording.stat().st_size
    found = Measured(times_s[0] / FRAMES, 163 * 120, size / FRAMES, written / FRAMES, task_s)
    return table, found


def _task_s(client: distributed.Client) -> float:
    """Return the time that scheduler, client and worker take for a task that does nothing."""
    begin_s = time.perf_counter()
    futures = client.map(_nothing, range(_EMPTY_TASKS), pure=False)
    distributed.wait(futures)
    return (time.perf_counter() - begin_s) / _EMPTY_TASKS


def _nothing(_: int) -> None:
    pass


def needs(measured: Measured) -> Table:
    """Return what a cluster needs for an hour of 640 x 480, scaled by the number of pixels."""
    scale = _PIXELS / measured.pixels
    frame_s, read, written = (
        scale * each for each in (measured.frame_s, measured.read_bytes, measured.written_bytes)
    )
    tasks = _HOUR_FRAMES / BLOCK_FRAMES
    rounds = -(-tasks // _WORKERS)
    took_s = rounds * BLOCK_FRAMES * frame_s
    table = Table(
        f"What {_WORKERS} workers need for an hour of 640 x 480",
        ("", "computed from the figures above"),
        notes=[
            f"{_HOUR_FRAMES} frames: an hour at 10 a second. Time and bytes grow with the number "
            "of pixels; workers as quick as a core of this machine, each with a core of its own. "
            f"Tasks of {BLOCK_FRAMES} frames come in {rounds:.0f} rounds. Computed, not measured: "
            "a network or a store that is slower than stated here makes it longer."
        ],
    )
    gib = 1024**3
    rows = {
        "time, s": f"{took_s:.0f}",
        "time of one worker, h": f"{_HOUR_FRAMES * frame_s / 3600:.1f}",
        "tasks": f"{tasks:.0f}",
        "time of a task, s": f"{BLOCK_FRAMES * frame_s:.1f}",
        "read, GiB": f"{_HOUR_FRAMES * read / gib:.0f}",
        "written, GiB": f"{_HOUR_FRAMES * written / gib:.0f}",
        "read from the recording's store, MiB/s": f"{_HOUR_FRAMES * read / took_s / 1024**2:.0f}",
        "written, MiB/s": f"{_HOUR_FRAMES * written / took_s / 1024**2:.0f}",
        "scheduler and client for a task, ms": f"{measured.task_s * 1e3:.2f}",
        "share of the time that the scheduler is busy": f"{tasks * measured.task_s / took_s:.2%}",
    }
    table.rows.extend(rows.items())
    return table


def tables() -> Iterator[Table]:
    """Count bytes, and reconstruct on one and two processes: a quiet machine for minutes."""
    with TemporaryDirectory() as kept:
        yield bytes_moved(Path(kept))
    with TemporaryDirectory() as kept:
        table, measured = efficiency(Path(kept))
        yield table
        yield needs(measured)
