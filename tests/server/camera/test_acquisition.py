"""The acquisition's thread against a scripted camera."""

import math
import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from transientcam_driver import (
    AppliedSequence,
    Camera,
    CameraFault,
    CameraLost,
    CameraNotFound,
    DeviceRefused,
    FrameTimeout,
    ProtocolError,
    RawFrame,
    Sequence,
    SequenceError,
)
from transientcam_driver.errors import TransferStalled
from transientcam_server.camera import (
    Acquisition,
    CameraLostEvent,
    CameraRecoveredEvent,
    Captured,
    Dark,
    Event,
    LightArmingEvent,
    LightGuard,
    LightOffEvent,
    SequenceChanged,
)
from transientcam_server.camera._acquisition import STALLED_MIN_S
from transientcam_server.errors import JobCancelled, Problem, SequenceConflict, kinds

PATIENCE_S = 60.0
APPLIED = AppliedSequence(
    sequence=Sequence(),
    epoch=1,
    images=16,
    capture_s=0.09,
    frame_rate_hz=10.6,
    unambiguous_range_m=6.5,
    data_rate_bytes_s=6e6,
    low_frequency_hz=0.9e6,
)


class ScriptedCamera:
    """Delivers and fails in the scripted order; nothing in between."""

    def __init__(self) -> None:
        self.applied = APPLIED
        self.capabilities = SimpleNamespace(heartbeat_s=2.0)
        self.interlock_closed = True
        self.script: queue.SimpleQueue[RawFrame | Exception] = queue.SimpleQueue()
        self.absent: list[Exception] = []
        self.calls: list[str] = []
        self.gone = False

    def deliver(self, number: int, *, epoch: int = 1) -> None:
        self.script.put(
            cast("RawFrame", SimpleNamespace(number=number, epoch=epoch, captured_unix_s=0.0))
        )

    def read_frame(self, *, timeout_s: float) -> RawFrame:
        try:
            item = self.script.get(timeout=0.01)
        except queue.Empty:
            raise FrameTimeout(timeout_s) from None
        if isinstance(item, Exception):
            self.gone = isinstance(item, CameraLost)
            raise item
        return item

    def configure(self, sequence: Sequence) -> AppliedSequence:
        if sequence.harmonics > 30:
            raise SequenceError("harmonics", sequence.harmonics, "at most 30")
        self.applied = replace(self.applied, sequence=sequence, epoch=self.applied.epoch + 1)
        return self.applied

    def start(self) -> None:
        if not self.interlock_closed:
            raise DeviceRefused("START", "INTERLOCK_OPEN", "the interlock is open")
        self.calls.append("start")

    def stop(self) -> None:
        self.calls.append("stop")

    def safe_off(self) -> None:
        self.calls.append("safe_off")

    def status(self) -> SimpleNamespace:
        if self.gone:
            raise CameraLost("it is disconnected")
        return SimpleNamespace(interlock_closed=self.interlock_closed)

    def reconnect(self) -> None:
        self.calls.append("reconnect")
        if self.absent:
            raise self.absent.pop(0)
        self.gone = False


class Running:
    """An acquisition on a scripted camera, and what it reported."""

    def __init__(self, *, delay_s: float = 0.0, unused_s: float = math.inf) -> None:
        self.camera = ScriptedCamera()
        self.events: queue.SimpleQueue[Event] = queue.SimpleQueue()
        self.now_s = 0.0
        self.light = LightGuard(unserved_s=1e9, unused_s=unused_s, clock=lambda: self.now_s)
        self.acquisition = Acquisition(
            cast("Camera", self.camera),
            report=self.events.put,
            light=self.light,
            delay_s=delay_s,
            clock=lambda: self.now_s,
        )

    def event(self) -> Event:
        return self.events.get(timeout=PATIENCE_S)

    def settle(self) -> None:
        """Wait until the thread has come round twice: it has seen what was changed before."""
        for _ in range(2):
            self.acquisition.submit(lambda: None).result(PATIENCE_S)

    @property
    def lit(self) -> bool:
        """Whether the light was switched on last, and not off."""
        return [each for each in self.camera.calls if each != "reconnect"][-1:] == ["start"]


@contextmanager
def running(**options: float) -> Iterator[Running]:
    one = Running(**options)
    one.acquisition.start()
    try:
        yield one
    finally:
        one.acquisition.stop()


def numbers(*events: Event) -> list[int]:
    return [event.raw.number for event in events if isinstance(event, Captured)]


def test_frames_are_reported_with_the_sequence_they_were_captured_with() -> None:
    with running() as one:
        one.camera.deliver(1)
        first = one.event()
        applied = one.acquisition.configure(Sequence(harmonics=4)).result(PATIENCE_S)
        changed = one.event()
        one.camera.deliver(2, epoch=applied.epoch)
        second = one.event()

    assert isinstance(first, Captured)
    assert first.applied == APPLIED
    assert changed == SequenceChanged(applied)
    assert isinstance(second, Captured)
    assert second.applied == applied


def test_a_change_of_a_sequence_that_was_changed_meanwhile_is_refused() -> None:
    with running() as one:
        configure = one.acquisition.configure
        first = configure(Sequence(harmonics=4), expected=APPLIED.epoch).result(PATIENCE_S)
        with pytest.raises(SequenceConflict) as late:
            configure(Sequence(harmonics=5), expected=APPLIED.epoch).result(PATIENCE_S)

        assert late.value.running == first == one.camera.applied


@pytest.mark.parametrize("command", ["safe_off", "stop"])
@pytest.mark.parametrize("stalled", range(7))
def test_a_request_to_switch_off_that_failed_is_sent_again_until_it_is_obeyed(
    monkeypatch: pytest.MonkeyPatch, stalled: int, command: str
) -> None:
    with running() as one:
        one.camera.deliver(1)
        one.event()
        left, obeyed = [stalled], threading.Event()

        def stalling(name: str) -> Callable[[], Any]:
            obey = getattr(one.camera, name)

            def request() -> Any:
                if left[0]:
                    left[0] -= 1
                    raise TransferStalled
                answer = obey()
                if name != "status":
                    obeyed.set()
                return answer

            return request

        for name in ("stop", "safe_off", "status"):
            monkeypatch.setattr(one.camera, name, stalling(name))
        if command == "safe_off":
            one.acquisition.safe_off()
        else:
            one.acquisition.set_running(False)

        assert obeyed.wait(PATIENCE_S)
        assert not one.lit
        monkeypatch.undo()


def test_a_refused_command_raises_in_its_caller_and_changes_nothing() -> None:
    with running() as one:
        future = one.acquisition.configure(Sequence(harmonics=31))
        with pytest.raises(SequenceError):
            future.result(PATIENCE_S)
        one.camera.deliver(1)

        assert numbers(one.event()) == [1]


def test_a_lost_camera_is_reported_once_looked_for_and_reported_back_with_its_first_frame() -> None:
    with running() as one:
        one.camera.absent = [CameraNotFound("SIM"), CameraNotFound("SIM")]
        one.camera.script.put(CameraLost("unplugged"))
        lost = one.event()
        one.camera.deliver(7)
        back, captured = one.event(), one.event()

    assert isinstance(lost, CameraLostEvent)
    assert "unplugged" in lost.reason
    assert isinstance(back, CameraRecoveredEvent)
    assert numbers(captured) == [7]
    assert one.camera.calls.count("reconnect") == 3
    # the light is on again only after the camera was found
    assert one.camera.calls[-2:] == ["start", "safe_off"]


def test_a_camera_that_fails_at_once_each_time_is_lost_all_along() -> None:
    with running() as one:
        for _ in range(3):
            one.camera.script.put(ProtocolError("an image of another size"))
        lost = one.event()
        one.camera.deliver(1)
        back = one.event()

    assert isinstance(lost, CameraLostEvent)
    assert isinstance(back, CameraRecoveredEvent)


def test_what_is_counted_anew_after_a_loss_is_reported_as_another_sequence() -> None:
    with running() as one:
        one.camera.script.put(CameraLost("unplugged"))
        one.event()
        one.camera.applied = replace(APPLIED, epoch=5)
        one.camera.deliver(1, epoch=5)

        assert one.event() == SequenceChanged(one.camera.applied)
        assert isinstance(one.event(), CameraRecoveredEvent)
        assert numbers(one.event()) == [1]


def test_stopping_stops_the_camera_and_starting_starts_it_again() -> None:
    with running() as one:
        one.camera.deliver(1)
        one.event()
        one.acquisition.set_running(False).result(PATIENCE_S)
        assert one.event() == LightOffEvent(Dark("stop"))
        assert one.acquisition.status().state == "stopped"
        assert one.camera.calls == ["start", "stop"]

        one.acquisition.set_running(True).result(PATIENCE_S)
        one.camera.deliver(2)
        assert numbers(one.event()) == [2]
        assert one.acquisition.status().state == "streaming"

    assert one.camera.calls == ["start", "stop", "start", "safe_off"]


def test_what_is_asked_for_once_it_has_ended_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with running() as one:
        reached, ending = threading.Event(), threading.Event()

        def safe_off() -> None:
            reached.set()
            ending.wait(PATIENCE_S)

        monkeypatch.setattr(one.camera, "safe_off", safe_off)
        stopping = threading.Thread(target=one.acquisition.stop)
        stopping.start()
        assert reached.wait(PATIENCE_S)  # no command is run behind that
        done: list[str] = []
        meanwhile = one.acquisition.submit(lambda: done.append("meanwhile"))
        job = one.acquisition.occupy("job", lambda *_: done.append("job"), offs=0)
        ending.set()
        stopping.join()
        after = one.acquisition.submit(lambda: done.append("after"))

        for refused in (meanwhile, job, after):
            with pytest.raises(Problem) as caught:
                refused.result(PATIENCE_S)
            assert caught.value.kind is kinds.SHUTTING_DOWN
        assert done == []


def test_a_loss_is_noticed_while_nothing_is_read() -> None:
    with running() as one:
        one.acquisition.set_running(False).result(PATIENCE_S)
        assert one.event() == LightOffEvent(Dark("stop"))
        one.camera.gone = True

        assert isinstance(one.event(), CameraLostEvent)
        assert isinstance(one.event(), CameraRecoveredEvent)


def test_an_unexpected_error_does_not_end_the_acquisition() -> None:
    with running() as one:
        one.camera.script.put(ZeroDivisionError())
        one.camera.deliver(1)

        assert numbers(one.event()) == [1]


def test_commands_are_run_on_the_one_thread_that_owns_the_camera() -> None:
    with running() as one:
        thread = one.acquisition.submit(threading.current_thread).result(PATIENCE_S)

    assert thread.name == "acquisition"


def test_a_command_that_was_taken_back_is_not_run() -> None:
    ran: list[Any] = []
    one = Running()
    future = one.acquisition.submit(lambda: ran.append(1))
    assert future.cancel()
    one.acquisition.start()
    one.acquisition.submit(lambda: None).result(PATIENCE_S)
    one.acquisition.stop()

    assert not ran


# -- while something has the camera for itself ---------------------------------------------------


def until(ended: threading.Event, go_on: Callable[[], None]) -> None:
    """Work that lasts until ``ended`` is set, or it is interrupted."""
    while not ended.wait(0.001):
        go_on()


def test_meanwhile_nothing_is_read_and_what_would_disturb_it_is_refused() -> None:
    with running() as one:
        begun, end = threading.Event(), threading.Event()

        def work(camera: Any, go_on: Callable[[], None]) -> None:
            begun.set()
            until(end, go_on)

        occupied = one.acquisition.occupy("job-1", work, offs=one.acquisition.offs)
        assert begun.wait(PATIENCE_S)
        one.camera.deliver(1)
        for disturb in (
            lambda: one.acquisition.configure(Sequence()),
            lambda: one.acquisition.set_running(True),
            lambda: one.acquisition.occupy(
                "job-2", lambda camera, go_on: None, offs=one.acquisition.offs
            ),
        ):
            with pytest.raises(Problem) as caught:
                disturb()
            assert caught.value.kind is kinds.CAMERA_BUSY
            assert caught.value.extensions["job"] == "job-1"
        assert one.acquisition.status().state == "calibrating"
        status: Any = one.acquisition.device_status().result(PATIENCE_S)
        assert status.interlock_closed
        assert one.events.empty()
        end.set()
        occupied.result(PATIENCE_S)

        assert numbers(one.event()) == [1]
        assert one.acquisition.status().state == "streaming"


@pytest.mark.parametrize("command", ["safe_off", "stop"])
def test_switching_the_light_off_breaks_it_off(command: str) -> None:
    with running() as one:
        occupied = one.acquisition.occupy(
            "job-1",
            lambda camera, go_on: until(threading.Event(), go_on),
            offs=one.acquisition.offs,
        )
        if command == "safe_off":
            one.acquisition.safe_off().result(PATIENCE_S)
        else:
            one.acquisition.set_running(False).result(PATIENCE_S)

        with pytest.raises(JobCancelled):
            occupied.result(PATIENCE_S)
        assert one.acquisition.status().state == "stopped"


def test_what_it_counted_anew_is_reported_and_frames_of_it_are_known() -> None:
    with running() as one:
        one.acquisition.occupy(
            "job-1",
            lambda camera, go_on: camera.configure(APPLIED.sequence),
            offs=one.acquisition.offs,
        ).result(PATIENCE_S)
        changed = one.event()
        one.camera.deliver(1, epoch=2)

        assert changed == SequenceChanged(one.camera.applied)
        assert numbers(one.event()) == [1]


def test_a_sequence_that_it_left_behind_is_put_back() -> None:
    """As if the camera was lost meanwhile, and not configured."""

    def leave(camera: Any, go_on: Callable[[], None]) -> None:
        camera.configure(Sequence(harmonics=7))
        raise CameraLost("unplugged")

    with running() as one:
        with pytest.raises(CameraLost):
            one.acquisition.occupy("job-1", leave, offs=one.acquisition.offs).result(PATIENCE_S)
        changed = one.event()

    assert isinstance(changed, SequenceChanged)
    assert changed.applied.sequence == APPLIED.sequence


def test_one_that_was_taken_back_has_the_camera_no_more() -> None:
    one = Running()
    occupied = one.acquisition.occupy(
        "job-1", lambda camera, go_on: None, offs=one.acquisition.offs
    )
    assert occupied.cancel()

    one.acquisition.require_free()


def test_the_rate_is_measured_over_the_last_frames() -> None:
    with running() as one:
        for number in range(1, 6):
            one.now_s = number / 20.0
            one.camera.deliver(number)
            one.event()
        status = one.acquisition.status()

    assert status.frames == 5
    assert status.rate_hz == pytest.approx(20.0)


def test_silence_for_much_longer_than_a_frame_takes_is_a_stall() -> None:
    with running() as one:
        one.camera.deliver(1)
        one.event()
        one.now_s += STALLED_MIN_S - 0.1
        early = one.acquisition.status()
        one.now_s += 0.2
        late = one.acquisition.status()
        # a capture of ten seconds has all the time it needs
        one.camera.applied = replace(APPLIED, frame_rate_hz=0.1)
        patient = one.acquisition.status()

    assert [each.stalled for each in (early, late, patient)] == [False, True, False]


def test_the_camera_is_switched_off_at_the_end_even_when_it_is_gone() -> None:
    one = Running()

    def gone() -> None:
        one.camera.calls.append("safe_off")
        raise CameraLost("unplugged")

    one.camera.safe_off = gone  # type: ignore[method-assign]  # the script's last line
    one.acquisition.start()
    one.acquisition.stop()

    assert one.camera.calls[-1] == "safe_off"


# -- the one gate of the light ------------------------------------------------------------------


def test_light_is_announced_before_it_begins() -> None:
    with running(delay_s=3.0) as one:
        announced = one.event()
        one.now_s = 2.0
        one.settle()
        waiting, early = one.acquisition.status(), one.lit
        one.now_s = 3.0
        one.camera.deliver(1)
        captured = one.event()

    assert announced == LightArmingEvent(3.0)
    assert (waiting.state, waiting.running, waiting.light_on_in_s) == ("arming", True, 1.0)
    assert not early
    assert numbers(captured) == [1]


@pytest.mark.parametrize("command", ["safe_off", "stop"])
def test_light_that_is_announced_can_be_called_off(command: str) -> None:
    with running(delay_s=3.0) as one:
        one.event()
        if command == "safe_off":
            one.acquisition.safe_off().result(PATIENCE_S)
        else:
            one.acquisition.set_running(False).result(PATIENCE_S)
        off = one.event()
        one.now_s = 100.0
        one.settle()
        status = one.acquisition.status()

    assert isinstance(off, LightOffEvent)
    assert (status.state, status.light_on_in_s) == ("stopped", None)
    assert "start" not in one.camera.calls


def test_a_restart_is_announced_anew_but_nothing_while_the_light_is_on() -> None:
    with running(delay_s=3.0) as one:
        assert one.event() == LightArmingEvent(3.0)
        one.now_s = 3.0
        one.camera.deliver(1)
        assert numbers(one.event()) == [1]
        one.acquisition.occupy(
            "job", lambda camera, go_on: go_on(), offs=one.acquisition.offs
        ).result(PATIENCE_S)
        one.camera.deliver(2)
        assert numbers(one.event()) == [2]

        one.acquisition.set_running(False).result(PATIENCE_S)
        assert one.event() == LightOffEvent(Dark("stop"))
        one.acquisition.set_running(True).result(PATIENCE_S)

        assert one.event() == LightArmingEvent(3.0)
        assert not one.lit


def test_a_camera_that_was_lost_does_not_light_where_it_is_found_but_is_announced() -> None:
    with running(delay_s=3.0) as one:
        one.event()
        one.now_s = 3.0
        one.camera.deliver(1)
        one.event()
        one.camera.script.put(CameraLost("unplugged"))
        lost, announced = one.event(), one.event()
        found = list(one.camera.calls)

    assert isinstance(lost, CameraLostEvent)
    assert announced == LightArmingEvent(3.0)
    assert found == ["start", "stop", "reconnect"]


def test_a_capture_that_was_not_read_for_as_long_as_the_heartbeat_is_announced_anew() -> None:
    with running(delay_s=1.0) as one:
        one.event()
        one.now_s = 1.0
        one.camera.deliver(1)
        one.event()

        def stand_still() -> None:
            one.now_s += 2.0

        one.acquisition.submit(stand_still).result(PATIENCE_S)

        assert one.event() == LightArmingEvent(1.0)
        assert one.camera.calls == ["start", "stop"]


def test_a_job_announces_its_light_and_a_safe_off_before_it_ends_the_job() -> None:
    one = Running(delay_s=3.0)
    began = threading.Event()
    one.acquisition.start(dark=Dark("start"))
    try:
        occupied = one.acquisition.occupy(
            "job", lambda camera, go_on: began.set(), offs=one.acquisition.offs
        )
        assert one.event() == LightArmingEvent(3.0)
        status = one.acquisition.status()
        assert (status.state, status.running, status.reason) == ("arming", False, None)
        one.acquisition.safe_off().result(PATIENCE_S)
        with pytest.raises(JobCancelled):
            occupied.result(PATIENCE_S)
        assert one.acquisition.status().state == "stopped"
    finally:
        one.acquisition.stop()

    assert not began.is_set()


def test_a_job_that_waited_when_the_light_was_switched_off_does_not_light() -> None:
    with running() as one:
        asked = one.acquisition.offs
        one.acquisition.safe_off().result(PATIENCE_S)
        began = threading.Event()
        waited = one.acquisition.occupy("job", lambda camera, go_on: began.set(), offs=asked)
        with pytest.raises(JobCancelled):
            waited.result(PATIENCE_S)
        one.acquisition.occupy(
            "job", lambda camera, go_on: began.set(), offs=one.acquisition.offs
        ).result(PATIENCE_S)

    assert began.is_set()


@pytest.mark.parametrize("command", ["safe_off", "stop"])
def test_a_start_that_waited_when_the_light_was_switched_off_does_not_light(command: str) -> None:
    with running() as one:
        one.acquisition.set_running(False).result(PATIENCE_S)
        began, go_on = threading.Event(), threading.Event()

        def hold() -> None:
            began.set()
            go_on.wait(PATIENCE_S)

        one.acquisition.submit(hold)
        assert began.wait(PATIENCE_S)
        start = one.acquisition.set_running(True)
        off = (
            one.acquisition.safe_off()
            if command == "safe_off"
            else one.acquisition.set_running(False)
        )
        go_on.set()
        off.result(PATIENCE_S)
        with pytest.raises(Problem) as refused:
            start.result(PATIENCE_S)
        one.settle()
        calls = list(one.camera.calls)
        one.acquisition.set_running(True).result(PATIENCE_S)
        one.settle()

    assert refused.value.kind is kinds.START_OUTDATED
    assert calls.count("start") == 1
    assert one.camera.calls.count("start") == 2


def test_a_device_that_shuts_its_light_off_stays_dark_until_somebody_starts() -> None:
    with running() as one:
        one.camera.script.put(CameraFault("the interlock was opened"))
        off = one.event()
        one.settle()
        status = one.acquisition.status()
        one.camera.interlock_closed = False
        with pytest.raises(CameraFault):
            one.acquisition.set_running(True).result(PATIENCE_S)
        assert one.camera.calls == ["start"]
        one.camera.interlock_closed = True
        one.acquisition.set_running(True).result(PATIENCE_S)
        one.camera.deliver(1)
        captured = one.event()

    assert isinstance(off, LightOffEvent)
    assert (status.state, status.off_because) == ("stopped", "device")
    assert "the interlock was opened" in str(status.reason)
    assert numbers(captured) == [1]


def test_an_interlock_that_opens_before_announced_light_calls_it_off() -> None:
    with running(delay_s=3.0) as one:
        one.event()
        one.camera.interlock_closed = False
        off = one.event()
        one.camera.interlock_closed = True
        one.now_s = 3.0
        one.settle()

    assert isinstance(off, LightOffEvent)
    assert off.dark.cause == "device"
    assert "start" not in one.camera.calls


def test_a_capture_that_nobody_uses_ends() -> None:
    with running(unused_s=60.0) as one:
        one.camera.deliver(1)
        one.event()
        one.now_s = 60.0
        one.light.used()
        one.now_s = 120.0
        one.settle()
        used = one.acquisition.status().running
        one.now_s = 121.0
        off = one.event()

    assert used
    assert isinstance(off, LightOffEvent)
    assert off.dark.cause == "unused"
    assert one.camera.calls[-2:] == ["stop", "safe_off"]
