"""Cameras that run by themselves: three mocks keep the contract, and are measured by a daemon."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
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
from transientcam_driver import (
    CameraName,
    CameraPlugin,
    Description,
    Exposure,
    FreeRunningCamera,
    Moment,
    ProtocolError,
)
from transientcam_driver.camera import _opening as opening
from transientcam_driver.cameras.free_running._frequencies import common_base
from transientcam_driver.clock import RealClock
from transientcam_driver.contract import CLAUSES, Bench, Clause

FRAMES = 10
MOCKS: dict[str, Any] = {"taps": taps_camera, "moments": moments_camera, "odd": odd_camera}


@pytest.fixture(scope="module", autouse=True)
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
        stated = frame.meta["predicted_range_std_m"]
        assert stated is not None
        return Measured(
            MOCKS[request.param],
            path,
            about,
            client.sequence,
            1e3 * stated["median"],
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


@pytest.mark.parametrize("clause", CLAUSES, ids=lambda each: each.name)
def test_the_contract_is_kept(clause: Clause) -> None:
    taps_camera.Device.unplugged.clear()
    bench = Bench(
        lambda: taps_camera.PLUGIN.open(CameraName.parse("taps:"), RealClock()),
        lit=lambda camera: (
            taps_camera.Device.lit == 1 and not taps_camera.Device.unplugged.is_set()
        ),
        unplug=lambda camera: taps_camera.Device.unplugged.set(),
        replug=lambda camera: taps_camera.Device.unplugged.clear(),
        lose_image=lambda camera: taps_camera.Device.spoilt.set(),
        read_s=60.0,
    )
    clause.run(bench)


@pytest.mark.parametrize(
    ("frequencies_hz", "max_range_m", "multiples"),
    [
        ((20e6, 100e6), None, (1, 5)),
        ((120e6, 16e6, 80e6), None, (2, 10, 15)),
        ((14.9e6, 100.1e6), 7.5, (149, 1001)),
        ((60e6,), None, (1,)),
    ],
)
def test_a_base_is_the_largest_that_there_is(
    frequencies_hz: tuple[float, ...], max_range_m: float | None, multiples: tuple[int, ...]
) -> None:
    base_hz, found = common_base(frequencies_hz, max_range_m)

    assert found == multiples
    assert base_hz * np.array(found) == pytest.approx(sorted(frequencies_hz), rel=1e-12)


def test_incommensurable_frequencies_are_off_by_less_than_shows() -> None:
    wanted_hz = 20e6 * np.sqrt([1.0, 7.0, 10.0])
    base_hz, multiples = common_base(wanted_hz, 10.0)

    delay_s = 2 * 10.0 / 299_792_458.0
    assert abs(2 * np.pi * delay_s * (base_hz * np.array(multiples) - wanted_hz)).max() < 2e-4


def described(*measurements: Exposure | Moment, **others: Any) -> Description:
    return Description(
        model="x", serial="1", firmware="1", width=4, height=3, frame_rate_hz=10.0,
        measurements=measurements, **others,
    )  # fmt: skip


THREE = tuple(Exposure(80e6, 2 * math.pi * k / 3) for k in range(3))
FOUR = tuple(Exposure(100e6, math.pi * k / 2) for k in range(4))
NOT_POSSIBLE: dict[str, Callable[[], Description]] = {
    "at least one": described,
    "three different ones": lambda: described(*THREE[:2], sensor=taps_camera.SENSOR),
    "one moment, or exposures": lambda: described(*THREE, Moment(80e6, 1.0, 9.0)),
    "stated, for phases that differ": lambda: described(*THREE, *FOUR),
    "or max_range_m stated": lambda: described(Moment(2e7, 1.0, 9.0), Moment(7.1e7, 1.0, 9.0)),
    r"std is -1.0": lambda: described(Moment(2e7, -1.0, 9.0)),
    r"one or \(3, 4\)": lambda: described(Moment(2e7, 1.0, 9.0, np.ones((2, 2)))),
    "finite and not 0": lambda: described(replace(THREE[0], gain=0.0)),
}


@pytest.mark.parametrize("limit", NOT_POSSIBLE)
def test_what_cannot_be_measured_is_refused_by_name(limit: str) -> None:
    class Device(moments_camera.Device):
        def __init__(self) -> None:
            super().__init__()
            self.description = NOT_POSSIBLE[limit]()

    with pytest.raises(ProtocolError, match=limit):
        FreeRunningCamera(Device)
