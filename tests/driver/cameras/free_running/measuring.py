"""What a daemon makes of a mock that runs by itself.

``python -m tests.driver.cameras.free_running`` prints it of all of them.
"""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

import transientcam
from tests.driver.cameras.free_running import argos_camera, moments_camera, odd_camera, taps_camera
from tests.serving import serving
from transientcam import Camera
from transientcam.cli import run as command
from transientcam_conformance import Device, chosen, run as check
from transientcam_driver import CameraName, CameraPlugin
from transientcam_driver.camera import _opening as opening

MOCKS: dict[str, ModuleType] = {
    "taps": taps_camera,
    "moments": moments_camera,
    "odd": odd_camera,
    "argos": argos_camera,
}


@contextmanager
def installed() -> Iterator[None]:
    """Offer the mocks by the names of their kinds, as distributions do."""
    offered = opening.plugin_of

    def with_mocks(spec: str) -> tuple[CameraName, CameraPlugin]:
        name = CameraName.parse(spec)
        return (name, MOCKS[name.kind].PLUGIN) if name.kind in MOCKS else offered(spec)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(opening, "plugin_of", with_mocks)
        yield


@dataclass(frozen=True)
class Measured:
    """What a daemon with a mock has measured and recorded.

    ``delivered``, ``produced``: Frames that were recorded, and those that the device counted from
    the first of them to the last.
    ``bias_mm``, ``most_mm``: How far the ranges are off in the median, and at most.
    ``scatter_mm``, ``stated_mm``: Deviation between frames, and the one that is stated.
    ``ticks_off_s``: How far a recorded time is from the mock's own, at most.
    ``mcap_off_s``: How far intervals in the .mcap are from the recorded ones, at most.
    ``frame``: The metadata of a recorded frame.
    ``mcap``: The recording as that.
    ``points``: A point cloud as PLY.
    ``failed``: Checks of the conformance suite, with their reasons.
    """

    module: ModuleType
    camera: dict[str, Any]
    sequence: dict[str, Any]
    frame: Mapping[str, Any]
    mcap: Path
    points: bytes
    failed: list[Any]
    delivered: int
    produced: int
    bias_mm: float
    most_mm: float
    scatter_mm: float
    stated_mm: float
    ticks_off_s: float
    mcap_off_s: float


def measure(name: str, directory: Path, frames: int = 10) -> Measured:
    """Serve a mock, record what comes, and check the daemon; call it while it is `installed`."""
    kept = {"directory": directory, "min_free_bytes": 0}
    settings = {"estimator": "automatic", "neighbours": "none"}
    path, module = directory / "copy.h5", MOCKS[name]
    with (
        serving(f"{name}:", recordings=kept, reconstruction=settings) as daemon,
        Camera(daemon.url, timeout_s=60.0) as client,
    ):
        frame = client.frame("range", wait_s=10.0)
        while frame.meta["frame"] < frames:
            frame = client.frame("range", after=frame.meta["frame"], wait_s=10.0)
        recording = client.stop_recording(client.record(history_s=600.0)["id"])["id"]
        with Device(daemon.url, timeout_s=60.0) as device:
            report = check(device, chosen(("parameters", "tags"), quick=True))
            path.write_bytes(device.send("GET", f"/api/v1/recordings/{recording}/file").content)
        about, sequence, points = client.camera, client.sequence, client.file("pointcloud", "ply")
    stated = frame.meta["predicted_range_std_m"]
    assert stated is not None
    with transientcam.open(str(path)) as recorded:
        range_m = np.array([each.range_m for each in recorded.frames[:frames]])
        device_s = np.array([each.meta["device_time_s"] for each in recorded.frames])
        numbers = np.array([each.raw_frame.number for each in recorded.frames])
        meta = recorded.frames[0].meta
    off_mm = 1e3 * (range_m - module.RANGE_M)
    ticks = device_s * module.RATE_HZ
    return Measured(
        module=module,
        camera=about,
        sequence=sequence,
        frame=meta,
        mcap=path.with_suffix(".mcap"),
        points=points,
        failed=[(each.check.name, each.reason) for each in report.failed],
        delivered=len(numbers),
        produced=int(numbers[-1] - numbers[0]) + 1,
        bias_mm=float(np.median(off_mm)),
        most_mm=float(abs(off_mm).max()),
        scatter_mm=math.sqrt(off_mm.var(axis=0, ddof=1).mean()),
        stated_mm=1e3 * stated["median"],
        ticks_off_s=float(abs(ticks - np.rint(ticks)).max()) / module.RATE_HZ,
        mcap_off_s=float(abs(np.diff(_stamps_s(path)) - np.diff(device_s)).max()),
    )


def _stamps_s(path: Path) -> np.ndarray[Any, Any]:
    """Return when the ranges of a recording were captured, as its .mcap has it."""
    output = path.with_suffix(".mcap")
    assert command(["convert", str(path), "-o", str(output), "--product", "range"]) == 0
    with output.open("rb") as file:
        found = make_reader(file).iter_messages(topics=["/range"])
        return np.array([message.log_time for _, _, message in found]) * 1e-9
