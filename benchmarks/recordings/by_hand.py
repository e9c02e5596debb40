"""Ranges computed from the files of recordings, against the daemon's: every mode of the camera.

The example that is run is that of docs/recordings.md.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.daemon import daemon
from benchmarks.common.records import DOCS
from benchmarks.common.tables import Table
from transientcam import Camera
from transientcam_server.offline import BatchOptions
from transientcam_server.offline._job import Job, computed
from transientcam_server.offline._opening import open_recording
from transientcam_server.settings import ReconstructionSettings

PAGE: Final = DOCS / "recordings.md"
CAMERA: Final = "sim:mirrors?seed=1"
LABELS: Final = ("harmonic", "phase_rad", "frequency_hz", "illumination", "take")
_Array = NDArray[Any]


@dataclass(frozen=True)
class Mode:
    """A way to capture; fields of the sequence, and whether with measured gains."""

    name: str
    sequence: dict[str, Any] = field(default_factory=dict)
    calibrated: bool = False


_NONE = {"scheme": "none"}
_CANCELLATION = {"scheme": "harmonic-cancellation", "n": 5}
MODES: Final = (
    Mode("b_0 at a low frequency, arccos", {"zeroth": "low-frequency"}),
    Mode("b_0 by on and off, arccos", {"zeroth": "on-off"}),
    Mode("b_0 estimated, arccos", {"zeroth": "estimated"}),
    Mode("no sub-phases", {"zeroth": "low-frequency", "sub_phases": _NONE}),
    Mode("harmonic cancellation", {"zeroth": "on-off", "sub_phases": _CANCELLATION}),
    Mode("2 takes in sequence", {"zeroth": "low-frequency", "takes": 2}),
    Mode("3 takes, interleaved", {"zeroth": "on-off", "takes": 3, "take_order": "interleaved"}),
    Mode("calibrated", {"zeroth": "low-frequency"}, calibrated=True),
)


@dataclass(frozen=True)
class Ranges:
    """Ranges (H, W) in m of one frame: the daemon's, and four computed from its file."""

    daemon: _Array
    example: _Array
    labelled: _Array
    opened: _Array
    worker: _Array


def calibrate(camera: Camera, sequence: dict[str, Any]) -> None:
    """Measure and activate gains for a sequence, the simulated camera before a diffuser."""
    scene = camera.simulation["scene"]
    camera.simulate("calibration")
    camera.sequence = sequence
    job = camera.calibrations.measure(frames=4, activate=True)
    camera.wait_for(job["id"])
    camera.simulate(scene)


def recorded(camera: Camera, mode: Mode, directory: Path) -> Ranges:
    """Record a frame in a mode, and compute its range in each way."""
    sequence = {"harmonics": 3, "exposure_s": 0.00048} | mode.sequence
    if mode.calibrated:
        calibrate(camera, sequence)
    else:
        camera.sequence = sequence
    recording_id = _finished(camera, camera.record(frames=1)["id"])
    path = directory / f"{recording_id}.h5"
    camera.download_recording(recording_id, path)
    served = camera.frame("range", recording=recording_id, number=1).array
    with open_recording(str(path)) as opened:
        of_open = opened.frames[0].range_m
    return Ranges(served, by_example(path), by_labels(path), of_open, by_worker(path))


def _finished(camera: Camera, recording_id: str) -> str:
    while camera.recording(recording_id)["state"] != "complete":
        camera.latest(wait_s=1.0)
    return recording_id


def by_example(path: Path) -> _Array:
    """Return what the example of docs/recordings.md computes of a file."""
    names: dict[str, Any] = {}
    exec(example().replace('"corner.h5"', repr(str(path))), names)  # it is our own documentation
    return np.asarray(names["range_m"])


def example() -> str:
    """Return the code under "By hand" in docs/recordings.md."""
    section = PAGE.read_text(encoding="utf-8").partition("## By hand")[2]
    found = re.search(r"```python\n(.*?)```", section, re.DOTALL)
    if found is None:
        raise ValueError(f"{PAGE} has no example by hand")
    return found.group(1)


def by_labels(path: Path) -> _Array:
    """Return the range of raw images with their labels and gains."""
    with h5py.File(path) as file:
        sequence, camera = (json.loads(file.attrs[name]) for name in ("sequence", "camera"))
        stated = {name: sequence[name] for name in ("zeroth", "takes")}
        found = tm.reconstruct(
            file["raw"][0],
            _settings(file).for_moments(sensor=tm.noise.Sensor(**camera["sensor"]), **stated),
            **{name: file[name][()] for name in LABELS},
            calibration=file["gain"][()],
            bad_pixels=file["bad"][()] > 0 if "bad" in file else None,
        )
    return np.asarray(found.range_m)


def by_worker(path: Path) -> _Array:
    """Return the range that a worker of `transientcam reconstruct --workers` computes."""
    with h5py.File(path) as file:
        options = BatchOptions(("range",), _settings(file))
    ranges: _Array = computed(Job.of(str(path), options), 0, 1)["range"][0]
    return ranges


def _settings(file: h5py.File) -> ReconstructionSettings:
    return ReconstructionSettings.recorded(json.loads(file.attrs["reconstruction"]))


def differences(served: _Array, found: _Array) -> tuple[float, float, float]:
    """Return median and largest difference in m, and the share of pixels that differ by > 1 mm.

    A pixel that has a range in one of them alone differs infinitely.
    """
    apart = np.abs(served - found)
    apart[np.isnan(served) & np.isnan(found)] = 0.0
    apart[np.isnan(served) != np.isnan(found)] = np.inf
    return float(np.median(apart)), float(apart.max()), float((apart > 1e-3).mean())


def table(camera: Camera, directory: Path) -> Table:
    """Return the differences of every mode."""
    result = Table(
        "Against the daemon",
        ("mode", "example", "`tm.reconstruct`, labelled", "`transientcam.open`", "worker"),
        notes=[
            "Median and largest absolute difference in m from the daemon's own range of the same "
            f"frame (`{CAMERA}`, with noise, m = 3), and the share of the pixels that differ by "
            "more than 1 mm. The example divides by gains where the daemon multiplies with their "
            "reciprocals, which rounds otherwise. So do compiled kernels, which the worker of "
            "`transientcam reconstruct --workers` has, and the others have not."
        ],
    )
    for mode in MODES:
        ranges = recorded(camera, mode, directory)
        ways = (ranges.example, ranges.labelled, ranges.opened, ranges.worker)
        result.rows.append((mode.name, *(_cell(ranges.daemon, way) for way in ways)))
    return result


def _cell(served: _Array, found: _Array) -> str:
    median, largest, share = differences(served, found)
    return f"{median:.2g}, {largest:.2g} ({share:.2%})"


def tables() -> Iterator[Table]:
    """Record a frame in every mode, and compute its range in each way."""
    with TemporaryDirectory() as kept, TemporaryDirectory() as downloads:
        environment = {
            "TRANSIENTCAM_KERNELS": "off",  # when they are ready would depend on the moment
            "TRANSIENTCAM_RECORDINGS__DIRECTORY": kept,
            "TRANSIENTCAM_CALIBRATIONS__DIRECTORY": kept,
        }
        with (
            daemon("--camera", CAMERA, environment=environment) as process,
            Camera(process.url, timeout_s=60.0) as camera,
        ):
            yield table(camera, Path(downloads))
