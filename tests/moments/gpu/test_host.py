"""Devices: which is taken, how it is checked, and what becomes of a frame when it fails."""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.gpu_devices import CountingDevice, software_device
from transientcam_moments import _gpu
from transientcam_moments._gpu import Device, _device, _golden, _passes
from transientcam_moments._gpu._device import Adapter
from transientcam_moments._gpu._shader import shader

M = 2
SETTINGS = tm.Settings(
    estimator="pisarenko", base_frequency_hz=23e6, zeroth="low-frequency", takes=1
)
GPU = Adapter("Big GPU", "DiscreteGPU", "Vulkan", "1.0")
SOFTWARE = Adapter("llvmpipe", "CPU", "Vulkan", "1.0")


@pytest.fixture(scope="module")
def device() -> Iterator[CountingDevice]:
    with software_device("llvmpipe") as found:
        yield found


def frame() -> np.ndarray:
    """Return raw images (N, 24, 37) of three returns."""
    images: np.ndarray = _golden._images(M)
    return images


def on(device: CountingDevice, monkeypatch: pytest.MonkeyPatch, **given: Any) -> tm.Reconstructor:
    monkeypatch.setattr(_gpu, "device_of", lambda name: device)
    return tm.Reconstructor(SETTINGS, calibration=np.ones(M + 1), device="gpu", **given)


@pytest.mark.parametrize(
    ("driver", "hostile"), [("llvmpipe", True), ("SwiftShader", False), ("SwiftShader", True)]
)  # llvmpipe as it is: below
def test_two_drivers_are_right_with_the_worst_quotients_that_a_device_may_have(
    driver: str, hostile: bool
) -> None:
    with software_device(driver, hostile=hostile) as device:
        # SwiftShader takes long to compile quotients that are spoilt
        for m in (1, 2, 4, 5) if driver == "llvmpipe" else (1, 2) if hostile else (1, 3):
            device.require(m)


def test_each_order_is_right(device: CountingDevice) -> None:
    for m in range(1, 9):
        device.require(m)


@pytest.mark.parametrize(
    "change",
    [
        ("b0 *= norm", "b0 *= 1.001 * norm"),
        ("low * low", "low * high"),
        ("2.0 - b * near", "2.001 - b * near"),
        ("word >> 16u", "word >> 15u"),
        ("params.full_scale", "params.least"),
    ],
)
def test_a_device_whose_shader_is_spoilt_is_refused(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch, change: tuple[str, str]
) -> None:
    right = shader

    def spoilt(*args: Any, **given: Any) -> str:
        code = right(*args, **given)
        assert change[0] in code
        return code.replace(*change)

    monkeypatch.setattr(_passes, "shader", spoilt)
    device._checks.pop(("pass", M), None)
    try:
        with pytest.raises(tm.DeviceUnavailable, match=r"llvmpipe.*computes known frames wrongly"):
            device.require(M)
    finally:
        device._checks.pop(("pass", M), None)


def test_only_frames_of_killed_processes_are_computed_here(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``TRANSIENTCAM_KILLS=100 pytest -k killed_processes`` kills it so often."""
    reconstructor = on(device, monkeypatch)
    alone = reconstructor(frame())
    run = _device.run

    for _ in range(int(os.environ.get("TRANSIENTCAM_KILLS", "2"))):
        before = device.frames
        monkeypatch.setattr(_device, "run", killed_in_it)
        fallen = reconstructor(frame())
        monkeypatch.setattr(_device, "run", run)
        again = reconstructor(frame())

        assert device.frames == before + 1
        assert np.array_equal(fallen.flags, alone.flags)
        assert np.allclose(fallen.direct, alone.direct, rtol=1e-2, atol=1)
        assert np.array_equal(again.range_m, alone.range_m, equal_nan=True)


def killed_in_it(key: int, tell: object) -> None:
    """Stand in for `run` in the device's process, which does not survive it."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_device_that_fails_three_times_in_a_row_is_asked_no_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with software_device("llvmpipe") as device:
        reconstructor = on(device, monkeypatch)
        reconstructor(frame())
        monkeypatch.setattr(_device, "run", killed_in_it)
        for _ in range(3):
            reconstructor(frame())
        monkeypatch.undo()
        asked: list[object] = []
        monkeypatch.setattr(device, "_begin", lambda: asked.append(0))

        found = reconstructor(frame())

    assert asked == []
    assert np.isfinite(found.range_m).any()


def chosen(wanted: str, found: list[Adapter], monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the adapter that a device takes where there are some, or why it takes none."""
    device = Device(wanted)
    monkeypatch.setattr(device, "_adapters", lambda: found)
    monkeypatch.setattr(device, "_call", lambda *_: 1)
    try:
        device.require(0)
    except tm.DeviceUnavailable as error:
        return str(error)
    finally:
        device.close()
    return device.adapter.name if device.adapter else ""


def test_software_is_taken_by_its_name_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    assert chosen("gpu", [GPU, SOFTWARE], monkeypatch) == "Big GPU"
    assert chosen("gpu:LLVM", [GPU, SOFTWARE], monkeypatch) == "llvmpipe"
    refused = chosen("gpu", [SOFTWARE], monkeypatch)
    assert refused == "device = 'gpu' cannot be used: llvmpipe computes on the processor"
    assert "no adapter was found" in chosen("gpu", [], monkeypatch)
    assert "there are: llvmpipe" in chosen("gpu:Big", [SOFTWARE], monkeypatch)


def test_another_device_is_refused_by_its_name() -> None:
    for name in ("GPU", "cuda", "gpu2"):
        with pytest.raises(tm.ParameterError, match="cpu, auto, gpu or gpu:NAME"):
            tm.Reconstructor(device=name)


def test_auto_keeps_whichever_computed_the_first_frames_faster() -> None:
    took_s = {"device": 9.0, "processor": 2.0}
    now_s, ways = [0.0], []

    def way(name: str) -> Any:
        def run() -> str:
            ways.append(name)
            now_s[0] += took_s[name]
            return name

        return run

    race = _gpu.Race(lambda: now_s[0])
    for _ in range(6):
        race.run("small", way("device"), way("processor"))
        took_s["device"] = 3.0  # the first one made things ready, and doesn't count
    assert sorted(ways) == 3 * ["device"] + 3 * ["processor"]
    assert race.run("small", way("device"), way("processor")) == "processor"

    took_s["processor"] = 8.0
    for _ in range(6):
        race.run("large", way("device"), way("processor"))
    assert race.run("large", way("device"), way("processor")) == "device"
    assert race.run("large", lambda: None, way("processor")) == "processor"
    assert race.run("small", way("device"), way("processor")) == "processor"


def test_frames_at_the_same_time_are_raced_before_the_device_has_given_two() -> None:
    """The processor may have had all its turns by then."""
    race, now_s = _gpu.Race(lambda: 0.0), iter(range(100))
    race.run("small", lambda: next(now_s), lambda: next(now_s))

    def meanwhile(depth: int) -> int:
        return race.run("small", lambda: 0, lambda: meanwhile(depth - 1)) if depth else 0

    meanwhile(5)
    assert len(race._took_s["small"][1]) >= 3
    race.run("small", lambda: 0, lambda: 0)


def test_auto_gives_the_same_frame_whatever_computes_it(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    device.require(M)
    monkeypatch.setattr(_gpu, "device_of", lambda name: device)
    reconstructor = tm.Reconstructor(SETTINGS, calibration=np.ones(M + 1), device="auto")
    before = device.frames

    found = [reconstructor(frame()) for _ in range(8)]

    assert device.frames > before
    for each in found[1:]:
        assert np.array_equal(each.flags, found[0].flags)
        assert np.allclose(each.direct, found[0].direct, rtol=1e-2, atol=1)


def test_sixteen_threads_get_their_own_frames(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    reconstructor = on(device, monkeypatch)
    frames = [frame() // (1 + at) for at in range(16)]
    alone = [reconstructor(each) for each in frames]
    before = device.frames

    with ThreadPoolExecutor(16) as executor:
        together = list(executor.map(reconstructor, frames))

    assert device.frames == before + 16
    for one, other in zip(alone, together, strict=True):
        assert np.array_equal(one.flags, other.flags)
        assert np.array_equal(one.range_m, other.range_m, equal_nan=True)
        assert np.array_equal(one.direct, other.direct)


@pytest.mark.parametrize("shape", [(1, 64), (64, 1), (9, 33), (163, 1), (1, 1)])
def test_odd_shapes_are_computed_alike(
    device: CountingDevice, monkeypatch: pytest.MonkeyPatch, shape: tuple[int, int]
) -> None:
    images = np.ascontiguousarray(np.resize(frame(), (4 * M + 4, *shape)))
    found = on(device, monkeypatch)(images)
    monkeypatch.undo()

    expected = tm.Reconstructor(SETTINGS, calibration=np.ones(M + 1))(images)

    assert np.array_equal(found.flags, expected.flags)
    assert np.allclose(found.brightness, expected.brightness, rtol=1e-4)
    assert np.allclose(found.direct, expected.direct, rtol=1e-2, atol=2)


def test_devices_are_listed_with_what_real_ones_make_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    class Wrong(Device):
        def adapters(self) -> list[Adapter]:
            return [GPU, SOFTWARE]

        def require(self, m: int) -> None:
            assert (self.wanted, m) == ("gpu:Big GPU", 4)
            raise tm.DeviceUnavailable(self.wanted, "phases are off")

    monkeypatch.setattr(_gpu, "Device", Wrong)

    assert tm.kernels.devices() == [GPU, SOFTWARE]
    assert [each.refused for each in tm.kernels.devices(check=4)] == ["phases are off", ""]
    with pytest.raises(tm.ParameterError, match="1 to 8"):
        tm.kernels.devices(check=9)


def test_reconstructors_use_what_was_said_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_gpu, "CHOICE", ["cpu"])
    monkeypatch.setattr(tm.kernels, "EVERYWHERE", [None])
    with pytest.raises(tm.DeviceUnavailable, match="no adapter has that name"):
        tm.kernels.use_device("gpu:none such")
    tm.kernels.use_device("auto")

    assert _gpu.CHOICE == ["auto"]
    assert tm.Reconstructor()._choice.automatic
    assert not tm.Reconstructor(device="cpu")._choice.automatic
