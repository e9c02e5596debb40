"""Cameras that expose on request: order, settling, losses, and no unrequested light."""

import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np
import pytest

from tests.driver.cameras.triggered.scripted import (
    CAPABILITIES,
    EXPOSED_S,
    SETTLES_S,
    Cable,
    ScriptedDevice,
)
from transientcam_driver import (
    CameraLost,
    CameraNotFound,
    Extrinsics,
    FactoryCalibration,
    FrameTimeout,
    ImageLabel,
    Lens,
    NotStreaming,
    ProtocolError,
    Sequence,
    SubPhases,
)
from transientcam_driver.camera import CameraState, Simulation
from transientcam_driver.cameras.streamed import _camera as streamed
from transientcam_driver.clock import VirtualClock

NONE = SubPhases("none")
ONE = Sequence(base_frequency_hz=10e6, harmonics=1, zeroth="estimated", sub_phases=NONE)
TWO = replace(ONE, harmonics=2, zeroth="low-frequency", takes=2)


def test_images_stand_where_their_labels_say() -> None:
    with Cable().camera() as camera:
        applied = camera.configure(TWO)
        camera.start()
        frame = camera.read_frame()

    assert frame.labels == applied.labels
    assert [int(image[0, 0]) for image in frame.images] == list(range(24))
    assert frame.temperature_c == 40.0


def test_each_frequency_settles_before_its_four_phases_are_exposed() -> None:
    cable = Cable()
    with cable.camera() as camera:
        camera.configure(TWO)
        camera.start()
        frame = camera.read_frame()

    assert [harmonic for harmonic, _ in cable.asked] == [0, 1, 2, 0, 1, 2]
    between_s = [b - a for (_, a), (_, b) in zip(cable.asked, cable.asked[1:], strict=False)]
    assert between_s == pytest.approx([SETTLES_S + EXPOSED_S] * 5)
    assert frame.capture_s == pytest.approx(5 * SETTLES_S + 6 * EXPOSED_S)


def test_the_time_to_settle_is_in_what_a_capture_is_said_to_take() -> None:
    with Cable().camera() as camera:
        two, one = camera.validate(TWO), camera.validate(ONE)

    exposed_s = 24 * (TWO.exposure_s + 1e-3)
    assert two.capture_s == pytest.approx(exposed_s + 6 * SETTLES_S)
    assert two.frame_rate_hz == pytest.approx(1 / two.capture_s)
    assert one.capture_s == pytest.approx(4 * (one.sequence.exposure_s + 1e-3))


def test_exposures_are_on_the_cameras_grid() -> None:
    with Cable().camera() as camera:
        applied = camera.configure(replace(ONE, exposure_s=25.4e-6))

    assert applied.sequence.exposure_s == 25e-6


def test_what_a_timeout_interrupts_goes_on() -> None:
    cable = Cable(delayed=3)
    with cable.camera() as camera:
        camera.configure(TWO)
        camera.start()
        for _ in range(3):
            with pytest.raises(FrameTimeout):
                camera.read_frame(timeout_s=0.04)
        camera.read_frame()

    assert [harmonic for harmonic, _ in cable.asked] == [0, 1, 2, 0, 1, 2]


def test_nothing_is_exposed_unless_a_frame_is_read() -> None:
    cable = Cable()
    with cable.camera() as camera:
        camera.start()
        camera.status()
        assert cable.asked == []
        camera.read_frame()
        asked = len(cable.asked)
        camera.stop()
        with pytest.raises(NotStreaming):
            camera.read_frame()

    assert len(cable.asked) == asked


def test_lost_images_cost_their_frame_alone() -> None:
    cable = Cable()
    with cable.camera() as camera:
        camera.configure(TWO)
        camera.start()
        camera.read_frame()
        cable.groups_to_lose = 2
        after, later = camera.read_frame(), camera.read_frame()

    assert (after.number, after.lost_images, later.number, later.lost_images) == (3, 8, 4, 0)
    counters = camera.counters
    assert (counters.lost, counters.incomplete_frames, counters.frames) == (8, 2, 3)


def test_images_that_arrive_after_another_sequence_was_set_are_dropped() -> None:
    cable = Cable(delayed=1)
    with cable.camera() as camera:
        camera.start()
        with pytest.raises(FrameTimeout):
            camera.read_frame(timeout_s=0.0)
        applied = camera.configure(TWO)
        frame = camera.read_frame()

    assert frame.epoch == applied.epoch
    assert len(frame.images) == 24


def test_another_device_at_the_same_address_is_not_taken_for_it() -> None:
    cable = Cable()
    with cable.camera() as camera:
        camera.start()
        cable.plugged = False
        with pytest.raises(Exception, match="cable"):
            camera.read_frame()
        cable.plugged, cable.serial = True, "S-2"
        with pytest.raises(CameraNotFound, match="S-1"):
            camera.reconnect()
        cable.serial = "S-1"
        camera.reconnect()
        assert camera.state == CameraState.STREAMING
        camera.read_frame()


def test_time_is_the_clocks() -> None:
    cable = Cable(clock=VirtualClock(start_s=50.0, unix_s=1.7e9))
    with cable.camera() as camera:
        camera.start()
        camera.read_frame()
        frame = camera.read_frame()

    assert frame.device_time_s == pytest.approx(cable.asked[len(cable.asked) // 2][1] - 50.0)
    assert frame.host_time_s == pytest.approx(1.7e9 + cable.clock.now_s() - 50.0)


def test_a_camera_whose_images_never_come_is_lost_with_the_reason() -> None:
    cable = Cable(groups_to_lose=5)
    with cable.camera() as camera:
        camera.start()
        with pytest.raises(CameraLost, match="5 times in a row images were lost: as the test"):
            camera.read_frame()
        assert camera.state == CameraState.DISCONNECTED
        camera.reconnect()
        assert camera.read_frame().lost_images == 20


ODD: dict[str, object] = {}


@pytest.mark.parametrize(
    ("returned", "reason"),
    [
        (lambda: np.zeros((4, 2, 2), np.uint16), r"5 times in a row .* does not fit: \(4, 2, 2\)"),
        (lambda: 7, r"does not fit: \(\) of int64; allowed: \(4, 3, 4\) of uint16"),
        (lambda: np.zeros((4, 3, 4), complex), "does not fit: .* of complex128"),
        (lambda: np.full((4, 3, 4), np.nan), "values beyond 0 to 65535"),
        (lambda: np.full((4, 3, 4), -1), "values beyond 0 to 65535"),
        (lambda: ODD["lut"], r"receive\(\) raised KeyError\('lut'\)"),
    ],
)
def test_a_device_that_returns_or_raises_something_else_is_lost_with_the_reason(
    monkeypatch: pytest.MonkeyPatch, returned: Callable[[], object], reason: str
) -> None:
    monkeypatch.setattr(ScriptedDevice, "receive", lambda self, timeout_s: returned())
    with Cable().camera() as camera:
        camera.start()
        with pytest.raises(CameraLost, match=reason):
            camera.read_frame()


CALLS = ["configure", "prepare", "trigger", "receive", "temperature_c", "light_off"]


@pytest.mark.parametrize("call", CALLS)
def test_a_call_that_hangs_is_left_behind_and_the_camera_comes_back(
    monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    """Also where giving the device back hangs: the next one is another."""
    ends = threading.Event()
    with Cable().camera() as camera:
        camera.start()
        with monkeypatch.context() as hung:
            hung.setattr(streamed, "HANGS_S", 0.05)
            for each in (call, "close"):
                hung.setattr(ScriptedDevice, each, lambda self, *_: ends.wait())
            with pytest.raises(CameraLost, match=rf"{call}\(\) has not returned for 0.05 s"):
                {"configure": lambda: camera.configure(ONE), "light_off": camera.stop}.get(
                    call, camera.read_frame
                )()
            assert camera.state == CameraState.DISCONNECTED
            with pytest.raises(CameraLost, match=rf"{call}\(\) has not returned"):
                camera.status()
        ends.set()
        camera.reconnect()
        camera.start()
        assert camera.read_frame().images.shape


def test_a_simulated_device_takes_as_long_as_it_is_computed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # a busy machine, or a scene of many surfaces: no plug-in hangs
    prepare = ScriptedDevice.prepare

    def slowly(self: ScriptedDevice, labels: tuple[ImageLabel, ...]) -> float:
        threading.Event().wait(0.2)
        return prepare(self, labels)

    monkeypatch.setattr(streamed, "HANGS_S", 0.02)
    monkeypatch.setattr(ScriptedDevice, "prepare", slowly)
    simulation = mock.create_autospec(Simulation, instance=True)
    simulation.lens.return_value = Lens(1.0, 1.0, 0.0, 0.0)
    with Cable().camera(simulation) as camera:
        camera.start()
        assert camera.read_frame().images.shape


@pytest.mark.parametrize("settles_s", [None, "soon", float("nan"), float("inf"), -1.0])
def test_what_is_no_time_to_settle_is_a_loss_that_says_so(
    monkeypatch: pytest.MonkeyPatch, settles_s: object
) -> None:
    monkeypatch.setattr(ScriptedDevice, "prepare", lambda self, _: settles_s)
    with Cable().camera() as camera:
        camera.start()
        with pytest.raises(CameraLost, match=rf"prepare\(\) returned {settles_s!r}, no number"):
            camera.read_frame()


def test_a_call_that_ends_the_program_ends_the_camera_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with Cable().camera() as camera:
        monkeypatch.setattr(ScriptedDevice, "temperature_c", lambda self: sys.exit(3))
        with pytest.raises(CameraLost, match=r"temperature_c\(\) raised SystemExit\(3\)"):
            camera.status()


@pytest.mark.parametrize(
    ("stated", "refused"),
    [
        ({"width": 4.0}, "width is 4.0; allowed: a whole number"),
        ({"height": 5000}, "height is 5000; allowed: 1 to 4096 pixels"),
        ({"serial": "S\x001"}, r"serial is 'S\\x001'; allowed: a printable text"),
        ({"readout_s": float("nan")}, "readout_s is nan; allowed: a finite number"),
        ({"clock": "sundial"}, "clock is 'sundial'; allowed: .*'device', 'ptp'"),
    ],
)
def test_what_a_device_cannot_be_is_refused_by_name(
    monkeypatch: pytest.MonkeyPatch, stated: dict[str, Any], refused: str
) -> None:
    monkeypatch.setattr(ScriptedDevice, "capabilities", replace(CAPABILITIES, **stated))

    with pytest.raises(ProtocolError, match=refused):
        Cable().camera()


def test_a_temperature_that_is_no_number_is_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    with Cable().camera() as camera:
        for answer in ("warm", float("nan")):
            monkeypatch.setattr(ScriptedDevice, "temperature_c", lambda self, it=answer: it)
            assert camera.status().temperature_c is None


def test_what_any_call_raises_is_a_loss_with_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    with Cable().camera() as camera:
        camera.start()
        monkeypatch.setattr(ScriptedDevice, "prepare", lambda self, _: ODD["settle"])
        with pytest.raises(CameraLost, match=r"prepare\(\) raised KeyError\('settle'\)"):
            camera.read_frame()


def test_what_a_device_states_of_itself_is_the_cameras(monkeypatch: pytest.MonkeyPatch) -> None:
    stated = FactoryCalibration(extrinsics=Extrinsics("base_link"))
    monkeypatch.setattr(ScriptedDevice, "factory", stated, raising=False)
    with Cable().camera() as camera:
        assert camera.factory is stated
