from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.server.recording.made import APPLIED, CAPABILITIES, SEQUENCE, assert_same, frame, record
from transientcam_driver import (
    CameraClosed,
    CameraLost,
    CameraName,
    FrameTimeout,
    NotStreaming,
    RawFrame,
    Sequence,
    SequenceError,
    SpecError,
    open_camera,
)
from transientcam_driver.clock import VirtualClock
from transientcam_server.errors import DamagedFrame, NotARecording
from transientcam_server.recording import ReplayCamera
from transientcam_server.recording._replay import ReplaySpec, parse_replay


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("replay") / "a.h5", 6)


def test_every_frame_is_replayed_bit_for_bit_and_then_the_camera_is_lost(path: Path) -> None:
    with ReplayCamera(path, clock=VirtualClock()) as camera:
        camera.start()
        for number in range(6):
            assert_same(camera.read_frame(), frame(number))
        for _ in range(2):
            with pytest.raises(CameraLost, match="over after 6 frames"):
                camera.read_frame()
        with pytest.raises(CameraLost, match="over after 6 frames"):
            camera.reconnect()


def test_two_replays_give_the_same_at_any_speed(path: Path) -> None:
    def replay(speed: float) -> list[RawFrame]:
        with ReplayCamera(path, speed=speed, clock=VirtualClock()) as camera:
            camera.start()
            return [camera.read_frame() for _ in range(6)]

    for one, other in zip(replay(1.0), replay(float("inf")), strict=True):
        assert_same(one, other)


@pytest.mark.parametrize(("speed", "between_s"), [(1.0, 0.1), (2.0, 0.05), (float("inf"), 0.0)])
def test_frames_come_at_the_times_of_the_device(path: Path, speed: float, between_s: float) -> None:
    clock = VirtualClock()
    with ReplayCamera(path, speed=speed, clock=clock) as camera:
        camera.start()
        times_s = []
        for _ in range(6):
            camera.read_frame()
            times_s.append(clock.now_s())

    assert times_s == pytest.approx([between_s * k for k in range(6)])


def test_who_reads_late_gets_the_next_frame_at_once_and_the_others_by_a_new_schedule(
    path: Path,
) -> None:
    clock = VirtualClock()
    came_s = []
    with ReplayCamera(path, clock=clock) as camera:
        camera.start()
        for busy_s in (0.0, 0.05, 0.07, 0.25, 0.0, 0.0):  # one frame each 0.1 s
            clock.sleep(busy_s)
            camera.read_frame()
            came_s.append(clock.now_s())

    # late by less than a frame, a reader keeps the schedule; by more, it begins anew
    assert came_s == pytest.approx([0.0, 0.1, 0.2, 0.45, 0.55, 0.65])


@pytest.mark.parametrize(("late_s", "next_s"), [(0.0, 0.1), (0.09, 0.1), (0.11, 0.21)])
def test_a_schedule_is_kept_by_who_is_late_by_less_than_a_frame(
    path: Path, late_s: float, next_s: float
) -> None:
    clock = VirtualClock()
    with ReplayCamera(path, clock=clock) as camera:
        camera.start()
        clock.sleep(late_s)
        camera.read_frame()
        camera.read_frame()

    assert clock.now_s() == pytest.approx(next_s)


def test_a_device_that_counts_its_time_anew_stops_no_replay(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 4)
    with h5py.File(path, "r+") as file:
        file["device_time_s"][()] = [5.0, 5.1, 0.0, 0.1]
    clock = VirtualClock()
    with ReplayCamera(path, clock=clock) as camera:
        camera.start()
        came_s = []
        for _ in range(4):
            camera.read_frame()
            came_s.append(clock.now_s())

    assert came_s == pytest.approx([0.0, 0.1, 0.1, 0.2])


def test_images_and_losses_are_counted_and_the_status_goes_on(path: Path) -> None:
    with ReplayCamera(path, loop=True, clock=VirtualClock()) as camera:
        images = APPLIED.images
        assert camera.status().next_image == 0
        assert camera.status().temperature_c is None
        camera.start()
        frames = [camera.read_frame() for _ in range(4)]
        status = camera.status()

        assert (camera.counters.frames, camera.counters.images) == (4, 4 * images)
        assert camera.counters.lost == sum(frame(number).lost_images for number in range(4)) > 0
        assert (status.epoch, status.next_image) == (APPLIED.epoch, 4 * images)
        assert status.temperature_c == frames[-1].temperature_c
        assert status.device_time_s == pytest.approx(0.4)
        assert camera.device_time_s() == pytest.approx(0.4)


@pytest.mark.parametrize(("name", "known"), [("factory", True), ("nominal", False), ("c1", False)])
def test_gains_of_the_factory_are_those_of_the_camera(
    tmp_path: Path, name: str, *, known: bool
) -> None:
    gains = np.array([1, 2j, 3], np.complex64)
    path = record(tmp_path / "a.h5", 1, calibration={"id": name}, calibration_planes=gains)

    with ReplayCamera(path) as camera:
        assert (camera.factory is not None) == known
        if camera.factory is not None:
            np.testing.assert_array_equal(camera.factory.gains, gains)


def test_where_the_pixels_look_is_what_was_recorded(tmp_path: Path, path: Path) -> None:
    lens = {"fx_px": 200.0}
    with ReplayCamera(record(tmp_path / "a.h5", 1, camera={"intrinsics": lens})) as camera:
        assert camera.intrinsics == lens
        assert camera.factory is None
    with ReplayCamera(path) as camera:
        assert camera.intrinsics is None


def test_a_frame_that_is_not_due_yet_is_a_timeout_and_comes_later(path: Path) -> None:
    with ReplayCamera(path, clock=VirtualClock()) as camera:
        camera.start()
        camera.read_frame()
        with pytest.raises(FrameTimeout):
            camera.read_frame(timeout_s=0.06)
        assert_same(camera.read_frame(timeout_s=0.06), frame(1))


def test_a_looped_recording_that_fits_into_memory_is_read_once(path: Path) -> None:
    with ReplayCamera(path, loop=True, clock=VirtualClock()) as camera:
        camera.start()
        first, *_, again = [camera.read_frame() for _ in range(7)]
        assert again.images is first.images
        assert not again.images.flags.writeable

    with ReplayCamera(path, clock=VirtualClock()) as camera:
        camera.start()
        assert camera.read_frame().images is not first.images


def test_in_a_loop_numbers_and_device_times_go_on(path: Path) -> None:
    with ReplayCamera(path, loop=True, clock=VirtualClock()) as camera:
        camera.start()
        frames = [camera.read_frame() for _ in range(13)]

    assert [each.number for each in frames] == list(range(13))
    times_s = [each.device_time_s for each in frames]
    assert times_s == sorted(times_s)
    period_s = 0.5 + 1 / APPLIED.frame_rate_hz
    assert times_s[6] == pytest.approx(period_s)
    assert times_s[12] == pytest.approx(2 * period_s)
    shifted = replace(frames[7], number=1, device_time_s=frame(1).device_time_s)
    assert_same(shifted, frame(1))


def test_it_is_what_was_recorded(path: Path) -> None:
    with ReplayCamera(path) as camera:
        assert camera.capabilities == CAPABILITIES
        assert camera.applied == APPLIED
        assert camera.simulation is None


def test_its_sequence_is_read_only(path: Path) -> None:
    with ReplayCamera(path) as camera:
        assert camera.configure(SEQUENCE) == APPLIED
        assert camera.validate(SEQUENCE) == replace(APPLIED, epoch=0)
        with pytest.raises(SequenceError, match=r"exposure_s .* cannot be changed"):
            camera.configure(replace(SEQUENCE, exposure_s=2e-3))
        with pytest.raises(SequenceError, match="base_frequency_hz"):
            camera.configure(Sequence(base_frequency_hz=1.0))


def test_a_pause_ends_the_wait_and_loses_no_frame(path: Path) -> None:
    with ReplayCamera(path, clock=VirtualClock()) as camera:
        with pytest.raises(NotStreaming):
            camera.read_frame()
        camera.start()
        camera.read_frame()
        camera.safe_off()
        with pytest.raises(NotStreaming):
            camera.read_frame()
        camera.start()
        assert_same(camera.read_frame(), frame(1))
        assert not camera.status().light_on


def test_a_damaged_frame_hurts_no_other(path: Path, tmp_path: Path) -> None:
    damaged = record(tmp_path / "b.h5", 3)
    with h5py.File(damaged, "r+") as file:
        file["crc32"][1] ^= 1
    with ReplayCamera(damaged, clock=VirtualClock()) as camera:
        camera.start()
        assert_same(camera.read_frame(), frame(0))
        with pytest.raises(DamagedFrame):
            camera.read_frame()
        assert_same(camera.read_frame(), frame(2))


def test_frames_counted_anew_after_an_unplug_are_of_the_one_sequence(tmp_path: Path) -> None:
    path = record(tmp_path / "a.h5", 2)
    with h5py.File(path, "r+") as file:
        file["epoch"][1] = 1
    with ReplayCamera(path, clock=VirtualClock()) as camera:
        camera.start()
        assert [camera.read_frame().epoch for _ in range(2)] == [APPLIED.epoch] * 2


def test_a_recording_without_a_frame_is_over_at_once(tmp_path: Path) -> None:
    with ReplayCamera(record(tmp_path / "a.h5", 0), loop=True) as camera:
        camera.start()
        with pytest.raises(CameraLost, match="over after 0 frames"):
            camera.read_frame()


def test_a_closed_replay_says_so(path: Path) -> None:
    camera = ReplayCamera(path)
    camera.close()
    camera.close()
    for method in (camera.start, camera.stop, camera.read_frame, camera.status, camera.reconnect):
        with pytest.raises(CameraClosed):
            method()


@pytest.mark.parametrize(
    ("spec", "wanted"),
    [
        ("recording:/a/b.h5", ReplaySpec(Path("/a/b.h5"))),
        ("recording:b.h5?speed=fast", ReplaySpec(Path("b.h5"), speed=float("inf"))),
        ("recording:b.h5?speed=2.0&loop=on", ReplaySpec(Path("b.h5"), speed=2.0, loop=True)),
        ("recording:b.h5?speed=original&loop=off", ReplaySpec(Path("b.h5"))),
    ],
)
def test_a_name_says_how_to_replay(spec: str, wanted: ReplaySpec) -> None:
    assert parse_replay(CameraName.parse(spec)) == wanted


@pytest.mark.parametrize(
    ("spec", "reason"),
    [
        ("recording:", "names no recording"),
        ("recording:a.h5?speed=0", "speed = '0'"),
        ("recording:a.h5?speed=nan", "speed = 'nan'"),
        ("recording:a.h5?speed=quick", "original, fast or a factor"),
        ("recording:a.h5?loop=yes", "one of off, on"),
    ],
)
def test_a_name_that_cannot_be_read_says_why(spec: str, reason: str) -> None:
    with pytest.raises(SpecError, match=reason):
        parse_replay(CameraName.parse(spec))


def test_cameras_opens_recordings_and_what_the_driver_opens(path: Path) -> None:
    with open_camera(f"recording:{path}?speed=fast") as replayed:
        assert isinstance(replayed, ReplayCamera)
    with open_camera("sim:mirrors?noise=off") as simulated:
        assert simulated.simulation is not None
    with pytest.raises(NotARecording):
        open_camera(f"recording:{__file__}")
    with pytest.raises(FileNotFoundError):
        open_camera("recording:/nowhere.h5")
