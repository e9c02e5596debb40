"""The camera ``oak`` before a mocked depthai: the contract, a daemon, and what it refuses."""

import sys
from collections.abc import Iterator

import numpy as np
import pytest

from tests.oak import mocked_depthai as mocked
from tests.serving import serving
from transientcam import Camera
from transientcam_driver import (
    Camera as AnyCamera,
    CameraName,
    CameraNotFound,
    PluginError,
    ProtocolError,
)
from transientcam_driver.camera import _opening as opening
from transientcam_driver.clock import RealClock
from transientcam_driver.contract import CLAUSES, Bench, Clause, ContractSkipped
from transientcam_oak._device import taps_of
from transientcam_oak.plugin import PLUGIN

# as fast as a small machine can be sure to be
FAST = "oak:?fps=60"


@pytest.fixture(autouse=True)
def depthai(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setitem(sys.modules, "depthai", mocked.module())
    monkeypatch.setattr(mocked.Device, "unplugged", False)
    yield
    assert not mocked.Device.lit


def opened(spec: str = FAST) -> AnyCamera:
    return PLUGIN.open(CameraName.parse(spec), RealClock())


def test_frames_have_the_range_the_noise_and_the_times_of_the_device() -> None:
    with opened() as camera:
        camera.start()
        frames = [camera.read_frame(timeout_s=60.0) for _ in range(2)]
    factory = camera.factory

    assert factory is not None
    assert factory.sensor is None  # it is measured in the images
    assert factory.lens is not None
    assert factory.lens.fx == mocked.FX
    assert factory.lens.distortion == (0.1, -0.2, 0.001, 0.002, 0.05)
    assert [each.frequency_hz for each in frames[0].labels[::4]] == [80e6, 100e6]
    for frame in frames:
        since = (frame.device_time_s - mocked.BEGUN_S) * 60.0 / 4
        assert since == pytest.approx(round(since), abs=1e-4)
        assert frame.temperature_c == 44.5


def test_a_missing_image_costs_its_frame_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mocked.Device, "losing", frozenset({9}))  # of the second frame
    with opened() as camera:
        camera.start()
        frames = [camera.read_frame(timeout_s=60.0)]
        while camera.counters.lost == 0:
            frames.append(camera.read_frame(timeout_s=60.0))

    assert frames[-1].lost_images >= 8
    assert mocked.BEGUN_S + 8 / 60.0 not in [each.device_time_s for each in frames]


@pytest.mark.parametrize("clause", CLAUSES, ids=lambda each: each.name)
def test_it_keeps_the_contract(clause: Clause) -> None:
    def plug(there: bool) -> None:
        mocked.Device.unplugged = not there
        mocked.Device.lit &= there

    bench = Bench(
        opened,
        lit=lambda camera: mocked.Device.lit,
        unplug=lambda camera: plug(False),
        replug=lambda camera: plug(True),
        read_s=60.0,
    )
    if clause.name == "lost-images-are-counted":  # another test's
        with pytest.raises(ContractSkipped):
            clause.run(bench)
    else:
        clause.run(bench)


def test_a_daemon_serves_its_range(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = {"estimator": "automatic", "neighbours": "none"}
    monkeypatch.setattr(opening, "plugin_of", lambda spec: (CameraName.parse(spec), PLUGIN))
    with serving(FAST, reconstruction=settings) as daemon, Camera(daemon.url) as client:
        frame = client.frame("range", wait_s=10.0)
        flags = client.frame("flags").array
        absent = {each["name"]: each["reason"] for each in client.info["absent_products"]}
        stated_m = frame.meta["predicted_range_std_m"]

    off_m = frame.array - mocked.RANGE_M
    assert abs(np.median(off_m)) < 0.2e-3
    assert stated_m is not None
    assert 0.85 < stated_m["median"] / off_m.std() < 1.15
    assert np.mean(flags == 0) > 0.99
    assert "needs consecutive multiples" in absent["transient"]
    assert "needs 3 frequencies" in absent["indirect"]
    assert "direct" not in absent


def test_what_is_no_tof_camera_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CameraNotFound, match="no OAK ABC can be opened: "):
        opened("oak:ABC")
    monkeypatch.setattr(mocked.Device, "sensors", ())
    with pytest.raises(CameraNotFound, match="no ToF sensor"):
        opened()
    monkeypatch.setitem(sys.modules, "depthai", None)
    with pytest.raises(PluginError, match="depthai is not installed"):
        opened()


def test_raw_images_of_another_layout_are_refused() -> None:
    message = mocked.ImgFrame(0, 60.0, np.zeros((480, 640), np.uint16))
    with pytest.raises(ProtocolError, match=r"\(480, 640\), RAW12, not 960 rows of 1280"):
        taps_of(message)


def test_devices_are_found_by_their_ids() -> None:
    assert [each.spec for each in PLUGIN.find()] == ["oak:14442C10D1F8"]
