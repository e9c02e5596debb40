"""Cameras that run by themselves: three mocks keep the contract, and are measured by a daemon."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

import transientcam
from tests.driver.cameras.free_running import moments_camera, odd_camera, taps_camera
from tests.serving import serving
from transientcam import Camera
from transientcam.cli import run as command
from transientcam_conformance import Device, chosen, run as check
from transientcam_driver.camera import _opening as opening

FRAMES = 10
MOCKS: dict[str, Any] = {"taps": taps_camera, "moments": moments_camera, "odd": odd_camera}
UNTRIED = {"moments", "odd"}


@pytest.fixture(scope="module", autouse=True)
def installed() -> Iterator[None]:
    """Offer the mocks as distributions do, by the names of their kinds."""
    points = {
        name: opening.EntryPoint(name, f"{module.__name__}:PLUGIN", opening.GROUP)
        for name, module in MOCKS.items()
    }
    offered = opening.entry_points

    def with_mocks(*, group: str, name: str | None = None) -> Any:
        own = [each for each in points.values() if name in (None, each.name)]
        return own or offered(group=group, name=name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(opening, "entry_points", with_mocks)
        yield


@dataclass(frozen=True)
class Measured:
    """What a daemon with a mock has measured and recorded."""

    module: ModuleType
    file: Path
    camera: dict[str, Any]
    sequence: dict[str, Any]
    stated_mm: float
    failed: list[Any]


@pytest.fixture(scope="module", params=list(MOCKS))
def measured(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Measured:
    directory = tmp_path_factory.mktemp(request.param)
    kept = {"directory": directory, "min_free_bytes": 0}
    settings = {"estimator": "automatic", "neighbours": "none"}
    served = serving(f"{request.param}:", recordings=kept, reconstruction=settings)
    with served as daemon, Camera(daemon.url) as client:
        frame = client.frame("range", wait_s=10.0)
        while frame.meta["frame"] < FRAMES:
            frame = client.frame("range", after=frame.meta["frame"], wait_s=10.0)
        recording = client.stop_recording(client.record(history_s=600.0)["id"])["id"]
        with Device(daemon.url, timeout_s=60.0) as device:
            about = device.send("GET", "/api/v1/camera").json()
            report = check(device, chosen(("parameters", "tags"), quick=True))
            path = directory / "copy.h5"
            path.write_bytes(device.send("GET", f"/api/v1/recordings/{recording}/file").content)
        failed = [(each.check.name, each.reason) for each in report.failed]
        return Measured(
            MOCKS[request.param],
            path,
            about,
            client.sequence,
            1e3 * frame.meta["predicted_range_std_m"]["median"],
            failed,
        )


def test_a_daemon_serves_them_and_no_check_fails(measured: Measured) -> None:
    asked = [each.frequency_hz for each in measured.module.MEASURED]
    multiples = np.array(measured.sequence["sampling"]["multiples"])
    measured_hz = multiples * measured.sequence["base_frequency_hz"]

    assert measured.failed == []
    assert measured_hz == pytest.approx(sorted(set(asked)), rel=3e-6)
    assert measured.camera["sensor"]["bits"] == 16


def test_their_range_is_right_and_their_noise_is_as_stated(measured: Measured) -> None:
    with transientcam.open(str(measured.file)) as recording:
        range_m = np.array([frame.range_m for frame in recording.frames[:FRAMES]])
    off_mm = 1e3 * (range_m - measured.module.RANGE_M)
    scatter_mm = math.sqrt(off_mm.var(axis=0, ddof=1).mean())

    assert abs(np.median(off_mm)) < 0.2
    assert abs(off_mm).max() < 10 * scatter_mm  # no turn is wrong
    assert 0.85 < measured.stated_mm / scatter_mm < 1.15


def test_times_in_mcap_are_those_of_the_device(measured: Measured) -> None:
    output = measured.file.with_suffix(".mcap")
    with transientcam.open(str(measured.file)) as recording:
        device_s = np.array([frame.meta["device_time_s"] for frame in recording.frames])
    assert command(["convert", str(measured.file), "-o", str(output), "--product", "range"]) == 0
    with output.open("rb") as file:
        found = make_reader(file).iter_messages(topics=["/range"])
        stamps_s = np.array([message.log_time for _, _, message in found]) * 1e-9

    ticks = device_s * measured.module.RATE_HZ
    assert abs(ticks - np.rint(ticks)).max() < 1e-4  # the mock's own
    assert np.diff(stamps_s) == pytest.approx(np.diff(device_s), abs=1e-6)
