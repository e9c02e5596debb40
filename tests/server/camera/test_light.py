"""The light's guard, by a clock that the test moves, and the thread of the camera that reads it."""

import queue
from collections.abc import Callable
from contextlib import suppress
from typing import cast

import pytest

from tests.server.camera.test_acquisition import PATIENCE_S, ScriptedCamera
from tests.waiting import wait_until
from transientcam_driver import Camera, CameraError, CameraState, open_camera
from transientcam_server.camera import Acquisition, Dark, Event, LightGuard, LightOffEvent
from transientcam_server.camera._light import LATE_S


class Clock:
    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def guarded() -> tuple[LightGuard, Clock]:
    clock = Clock()
    return LightGuard(unserved_s=1.0, clock=clock), clock


def test_the_light_needs_a_loop_that_turned_within_the_time() -> None:
    guard, clock = guarded()
    clock.now_s += 1.0
    assert guard.unserved() is None
    clock.now_s += 0.01
    assert guard.unserved() == "none was served for 1 s"
    guard.turned()
    assert guard.unserved() is None


def test_a_lapse_is_acted_on_once_and_only_where_the_loop_is_late() -> None:
    guard, clock = guarded()
    guard.lapses_at(103.0)
    clock.now_s = 103.0 + 0.5 * LATE_S
    assert not guard.lapsed()
    clock.now_s = 103.0 + 2.0 * LATE_S
    assert [guard.lapsed(), guard.lapsed()] == [True, False]


def test_a_lease_that_is_renewed_or_ended_in_time_does_not_lapse() -> None:
    guard, clock = guarded()
    guard.lapses_at(103.0)
    guard.lapses_at(130.0)
    clock.now_s = 110.0
    assert not guard.lapsed()
    guard.lapses_at(None)
    clock.now_s = 1000.0
    assert not guard.lapsed()


def test_the_thread_of_the_camera_switches_it_off_until_somebody_starts() -> None:
    guard, clock = guarded()
    camera = ScriptedCamera()
    events: queue.SimpleQueue[Event] = queue.SimpleQueue()
    acquisition = Acquisition(
        cast("Camera", camera),
        report=events.put,
        light=guard,
        clock=cast("Callable[[], float]", clock),
    )
    acquisition.start()
    try:
        while camera.calls != ["start"]:
            acquisition.device_status().result(PATIENCE_S)
        clock.now_s += 2.0
        unserved = events.get(timeout=PATIENCE_S)
        guard.turned()
        for _ in range(3):
            acquisition.device_status().result(PATIENCE_S)
        off, status = list(camera.calls), acquisition.status()
        acquisition.set_running(True).result(PATIENCE_S)
        while camera.calls == off:
            acquisition.device_status().result(PATIENCE_S)

        clock.now_s += 0.5
        guard.lapses_at(clock.now_s - 1.0)  # with a loop that did not act on it
        while acquisition.status().running:
            acquisition.device_status().result(PATIENCE_S)
    finally:
        acquisition.stop()

    assert unserved == LightOffEvent(Dark("unserved", "none was served for 1 s"))
    assert off == ["start", "stop"]
    assert (status.state, status.off_because) == ("stopped", "unserved")
    assert camera.calls == ["start", "stop", "start", "stop", "safe_off"]


@pytest.mark.parametrize(
    "spec",
    [f"{name}:emulated?scene=wall" for name in ("kinect2", "tofcam660", "opt8241")] + ["sim:wall"],
)
def test_a_camera_that_is_stopped_while_it_is_lost_is_dark_when_it_is_found(spec: str) -> None:
    """What the acquisition relies on: `reconnect` resumes only what was not stopped."""
    with open_camera(spec) as camera:
        simulation = camera.simulation
        assert simulation is not None
        camera.start()
        simulation.unplug()
        with suppress(CameraError):
            for _ in range(1000):
                camera.read_frame(timeout_s=1.0)
        with pytest.raises(CameraError):
            camera.stop()
        simulation.replug()

        def found() -> bool:
            with suppress(CameraError):
                camera.reconnect()
            return camera.state is not CameraState.DISCONNECTED

        wait_until(found)
        assert camera.state is CameraState.IDLE
        assert not camera.status().light_on
