"""The off switch, beside a camera whose thread waits on and on."""

import queue
import threading
from typing import Any, cast

import pytest

from tests.server.camera.test_acquisition import PATIENCE_S, ScriptedCamera
from transientcam_driver import Camera, CameraLost, NotStreaming, RawFrame
from transientcam_driver.camera import CameraState
from transientcam_server.camera import Acquisition, LightOffEvent
from transientcam_server.camera._off_switch import OffSwitch


class StuckCamera(ScriptedCamera):
    """Reads until it is switched off, however short the time it is given."""

    def __init__(self) -> None:
        super().__init__()
        self.reading = threading.Event()
        self.off = threading.Event()

    def read_frame(self, *, timeout_s: float) -> RawFrame:
        self.reading.set()
        assert self.off.wait(PATIENCE_S)
        raise NotStreaming(CameraState.IDLE)

    def safe_off(self) -> None:
        super().safe_off()
        self.off.set()


def test_the_light_goes_off_though_the_thread_of_the_camera_waits() -> None:
    camera = StuckCamera()
    events: queue.SimpleQueue[Any] = queue.SimpleQueue()
    acquisition = Acquisition(cast("Camera", camera), report=events.put)
    acquisition.start()
    try:
        assert camera.reading.wait(PATIENCE_S)
        acquisition.safe_off().result(PATIENCE_S)
        assert camera.calls[:2] == ["start", "safe_off"]
        assert acquisition.status().state == "stopped"
        acquisition.submit(lambda: None).result(PATIENCE_S)  # the thread goes on
        assert acquisition.status().state == "stopped"
        assert isinstance(events.get_nowait(), LightOffEvent)
        assert events.empty()  # it is no camera that was lost
    finally:
        acquisition.stop()
    assert "start" not in camera.calls[1:]


class Device:
    """Takes each request when the test lets it."""

    def __init__(self) -> None:
        self.asked = threading.Semaphore(0)
        self.answers: queue.SimpleQueue[Exception | None] = queue.SimpleQueue()

    def switch_off(self) -> None:
        self.asked.release()
        error = self.answers.get(timeout=PATIENCE_S)
        if error is not None:
            raise error


def test_all_who_ask_meanwhile_share_one_request_that_follows() -> None:
    device = Device()
    switch = OffSwitch(device.switch_off)
    first = switch.begin()
    assert device.asked.acquire(timeout=PATIENCE_S)
    others = [switch.begin() for _ in range(100)]
    device.answers.put(CameraLost("unplugged"))

    with pytest.raises(CameraLost, match="unplugged"):
        first.result(PATIENCE_S)
    assert device.asked.acquire(timeout=PATIENCE_S)
    assert not any(each.done() for each in others)
    device.answers.put(None)
    for each in others:
        each.result(PATIENCE_S)
    assert not device.asked.acquire(blocking=False)


def test_it_can_be_used_again_and_again() -> None:
    done: list[str] = []
    switch = OffSwitch(lambda: done.append("off"))
    for count in range(1, 4):
        switch.begin().result(PATIENCE_S)
        assert len(done) == count
