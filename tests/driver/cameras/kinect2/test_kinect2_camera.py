"""A Kinect v2 as a camera: frames, takes, losses, and a light that no reader needs."""

import threading
from collections.abc import Callable

import numpy as np
import pytest

from tests.driver.cameras.kinect2.standing import (
    LENS,
    READ_S,
    SERIAL,
    STILL,
    TABLES,
    camera_of,
    emulated,
    firmware,
)
from transientcam_driver import CameraError, CameraLost, CameraNotFound, Sequence
from transientcam_driver.cameras.kinect2 import Kinect2Camera, codes
from transientcam_simulation.emulated._kinect2 import EmulatedKinect2

IMAGES = codes.frame_images(STILL.data)


def read_on(camera: Kinect2Camera) -> None:
    """What had arrived before a loss is delivered first."""
    while True:
        camera.read_frame(timeout_s=READ_S)


def test_a_frame_is_what_the_device_sent_with_the_gains_and_the_lens_it_reports() -> None:
    with camera_of(emulated()) as camera:
        camera.start()
        frame = camera.read_frame(timeout_s=READ_S)

    assert np.array_equal(frame.images, IMAGES)
    labels = [(label.frequency_hz, round(label.phase_rad, 3)) for label in frame.labels]
    assert labels == [(f, p) for f in (16e6, 80e6, 120e6) for p in (0.0, 2.094, 4.189)]
    assert camera.factory is not None
    assert camera.factory.gains is not None
    assert np.array_equal(camera.factory.gains, TABLES.gains())
    assert camera.factory.lens == LENS.lens("top")


def test_rows_can_be_counted_from_the_bottom() -> None:
    with camera_of(emulated(), rows="bottom") as camera:
        assert camera.factory is not None
        assert camera.factory.lens == LENS.lens("bottom")


def test_takes_are_frames_of_the_device() -> None:
    with camera_of(emulated()) as camera:
        applied = camera.configure(camera.capabilities.sequence_of({"takes": 3}))
        camera.start()
        frame = camera.read_frame(timeout_s=READ_S)

    assert frame.labels == applied.labels
    assert np.array_equal(frame.by_take, np.stack([IMAGES] * 3))
    assert frame.capture_s > 1 / 30
    assert applied.frame_rate_hz == pytest.approx(10.0, rel=1e-5)


def test_two_cameras_run_at_once() -> None:
    devices = emulated("0001"), emulated("0002")
    with camera_of(devices[0]) as one, camera_of(devices[1]) as other:
        one.start()
        other.start()
        assert one.read_frame(timeout_s=READ_S).images.shape == (9, 424, 512)
        assert other.read_frame(timeout_s=READ_S).images.shape == (9, 424, 512)
        one.stop()
        assert (devices[0].lit, devices[1].lit) == (False, True)
        assert {one.capabilities.serial, other.capabilities.serial} == {"0001", "0002"}


def test_the_light_goes_off_without_a_reader_and_on_again_with_one() -> None:
    device = emulated()
    with camera_of(device, unread_s=0.2) as camera:
        camera.start()
        with device.changed:
            device.changed.wait_for(lambda: not device.lit)

        assert not camera.status().light_on
        assert camera.state == "streaming"
        camera.read_frame(timeout_s=READ_S)


def test_the_light_goes_off_where_a_program_ends_without_closing_the_camera() -> None:
    device = emulated()
    camera = camera_of(device)
    camera.start()
    camera.read_frame(timeout_s=READ_S)
    assert camera._release.atexit

    with pytest.warns(ResourceWarning, match="left open"):
        camera._release()

    assert not device.lit
    camera.close()


class Silent:
    """A device that is there and sends nothing, or nothing whole."""

    def __init__(self, device: EmulatedKinect2, keep: Callable[[bytes], bytes | None]) -> None:
        frame = device.frame
        device.frame = lambda: (  # type: ignore[method-assign]
            kept for packet in frame() if (kept := keep(packet)) is not None
        )
        self.device = device


@pytest.mark.parametrize(
    ("keep", "reason"),
    [(lambda packet: None, "nothing"), (lambda packet: packet[1:], "pieces of images")],
)
def test_a_camera_that_sends_nothing_whole_is_lost_with_its_light_off(
    keep: Callable[[bytes], bytes | None], reason: str
) -> None:
    silent = Silent(emulated(), keep)
    with camera_of(silent.device, silence_s=0.2) as camera:
        camera.start()
        while reason != "nothing" and not camera.counters.resyncs:
            threading.Event().wait(0.01)
        with pytest.raises(CameraLost, match=reason):
            camera.read_frame(timeout_s=READ_S)
        assert camera.state == "disconnected"
        assert not silent.device.lit


def test_another_camera_in_the_same_port_is_not_taken_for_it() -> None:
    device = emulated()
    with camera_of(device) as camera:
        camera.start()
        camera.read_frame(timeout_s=READ_S)
        device.unplug()
        with pytest.raises(CameraLost):
            read_on(camera)
        device._firmware_of_power_on = lambda: firmware("999")
        device.replug()
        with pytest.raises(CameraNotFound, match=SERIAL):
            camera.reconnect()
        assert not device.lit


def test_a_waiting_reader_ends_when_another_thread_closes_the_camera() -> None:
    silent = Silent(emulated(), lambda packet: None)
    camera = camera_of(silent.device)
    camera.start()
    ended: list[BaseException] = []

    def read() -> None:
        try:
            camera.read_frame(timeout_s=READ_S)
        except CameraError as error:
            ended.append(error)

    reader = threading.Thread(target=read)
    reader.start()
    camera.close()
    reader.join(READ_S)

    assert not reader.is_alive()
    assert len(ended) == 1
    assert not silent.device.lit


def test_the_sequence_is_the_cameras_own() -> None:
    with camera_of(emulated()) as camera:
        possible = camera.capabilities.nearest(Sequence())
        applied = camera.validate(possible)

    assert applied.sequence.multiples == (2, 10, 15)
    assert applied.unambiguous_range_m == pytest.approx(18.74, abs=0.01)
    assert applied.frame_rate_hz == pytest.approx(30.0, rel=1e-5)
