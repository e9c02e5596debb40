"""How long the daemon computes in NumPy until its kernels are compiled, on a new machine."""

import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from benchmarks.common.daemon import COMPILED_WITHIN_S, Process, daemon
from benchmarks.common.tables import Table
from transientcam import Camera, ProblemError

_LOOK_EVERY_S = 0.1
_FRAME_WITHIN_S = 10.0


@dataclass(frozen=True)
class WarmUp:
    """What there was how long after a change, in s."""

    first_frame_s: float
    """The first frame of it, computed in NumPy where the kernel was not there."""
    estimator_s: float
    all_s: float
    """``estimator_s``, ``all_s``: the kernel of the estimator, and all that live frames use."""


def warmed_up(process: Process, camera: Camera, sequence_id: int, begin_s: float) -> WarmUp:
    """Wait for a frame of a sequence, and then until nothing is being prepared."""
    end_s = begin_s + COMPILED_WITHIN_S
    there = False
    while not there:
        with suppress(ProblemError):  # none yet
            frame = camera.frame("range", wait_s=_FRAME_WITHIN_S)
            there = frame.meta["sequence_id"] == sequence_id
    first_frame_s = process.age_s() - begin_s
    estimator_s = all_s = first_frame_s
    while (kernels := camera.info["kernels"]) is not None:
        if process.age_s() > end_s:
            raise TimeoutError("the kernels are still being compiled")
        all_s = process.age_s() - begin_s
        if any(name.startswith("likelihood") for name in kernels["preparing"]):
            estimator_s = all_s
        time.sleep(_LOOK_EVERY_S)
    return WarmUp(first_frame_s, estimator_s, all_s)


def tables(harmonics: tuple[int, ...] = (6, 3, 8)) -> Iterator[Table]:
    """Start a daemon with nothing compiled, change m, and start one with what that has left."""
    table = Table(
        "Until compiled speed, nothing compiled before: seconds",
        ("after", "first frame", "estimator compiled", "all compiled"),
        notes=[
            "`sim:mirrors`, the default estimator, which frames have from the first one on: in "
            "NumPy until it is compiled. Seconds from the start of the process, or from `PUT "
            "/api/v1/sequence`."
        ],
    )
    with tempfile.TemporaryDirectory() as cache:
        environment = {"NUMBA_CACHE_DIR": cache}
        with daemon(environment=environment) as process, _camera(process) as camera:
            usual, limits = camera.sequence, camera.camera["capabilities"]
            found = warmed_up(process, camera, usual["sequence_id"], 0.0)
            table.rows.append((f"the start, m = {usual['harmonics']}", *_cells(found)))
            for m in harmonics:
                begin_s = process.age_s()
                most_hz = limits["max_frequency_hz"] / m
                lower_hz = min(usual["base_frequency_hz"], most_hz)
                applied = camera.configure(harmonics=m, base_frequency_hz=lower_hz)
                found = warmed_up(process, camera, applied["sequence_id"], begin_s)
                table.rows.append((f"m = {m}", *_cells(found)))
        with daemon(environment=environment) as process, _camera(process) as camera:
            found = warmed_up(process, camera, camera.sequence["sequence_id"], 0.0)
            table.rows.append(("the next start", *_cells(found)))
    yield table


def _camera(process: Process) -> Camera:
    return Camera(process.url, timeout_s=60.0)


def _cells(found: WarmUp) -> tuple[str, ...]:
    return tuple(f"{each:.1f}" for each in (found.first_frame_s, found.estimator_s, found.all_s))
