"""The one thread that owns the camera: reads frames, runs commands, survives an unplug.

Events are reported through ``report``, called on this thread; commands come from any thread, and
their results are futures.
"""

import logging
import math
import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final, TypeVar

from transientcam_driver import (
    AppliedSequence,
    Camera,
    CameraError,
    FrameTimeout,
    NotStreaming,
    RawFrame,
    Sequence,
    Status,
)
from transientcam_server.camera._events import (
    CameraLostEvent,
    CameraRecoveredEvent,
    Captured,
    Event,
    LightHeldEvent,
    LightReleasedEvent,
    SequenceChanged,
)
from transientcam_server.camera._light import LightGuard
from transientcam_server.camera._off_switch import OffSwitch
from transientcam_server.camera._status import AcquisitionStatus, State
from transientcam_server.errors import JobCancelled, Problem, SequenceConflict, kinds

_log = logging.getLogger("transientcam_server.camera.acquisition")
_T = TypeVar("_T")

READ_TIMEOUT_S: Final = 0.1
"""How long a read, and so a command behind it, may wait for a frame."""
IDLE_S: Final = 0.5
"""Interval at which a camera that captures nothing is checked for an unplug."""
BACKOFF_S: Final = (0.1, 0.2, 0.5, 1.0)
"""Pauses between attempts to find a lost camera; the last one repeats."""
STALLED_PERIODS: Final = 5.0
STALLED_MIN_S: Final = 2.0
_RATE_FRAMES = 32


class Acquisition:
    """Owns ``camera`` from `start` to `stop`, on a thread of its own."""

    def __init__(
        self,
        camera: Camera,
        *,
        report: Callable[[Event], None],
        light: LightGuard | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._light = LightGuard(unserved_s=math.inf, clock=clock) if light is None else light
        self._camera = camera
        self._off_switch = OffSwitch(camera.safe_off)
        self._report = report
        self._clock = clock
        self._commands: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._occupied = threading.Lock()
        self._occupant: str | None = None
        self._interrupted = threading.Event()
        self._restored: Sequence | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="acquisition", daemon=True)
        self._running = True
        self._connected = True
        self._lost: str | None = None
        self._held: str | None = None
        self._started = False
        self._attempts = 0
        self._frames = 0
        self._moved_s = clock()
        self._arrivals_s: deque[float] = deque(maxlen=_RATE_FRAMES)
        self._applied: dict[int, AppliedSequence] = {}
        self._remember(camera.applied)

    # -- from any thread -----------------------------------------------------------------------

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Stop the camera, its light and the thread; waits for it."""
        self._stopping.set()
        self._interrupted.set()
        self._commands.put(lambda: None)
        self._thread.join()

    def configure(
        self, sequence: Sequence, *, expected: int | None = None
    ) -> "Future[AppliedSequence]":
        """Change the sequence; with ``expected``, only if the running one still has that epoch.

        The future raises `SequenceConflict` where it has another one.

        Raises
        ------
        Problem
            ``camera-busy`` while a job has exclusive use of the camera.
        """
        with self._occupied:
            self.require_free()
            return self.submit(lambda: self._configure(sequence, expected))

    def set_running(self, running: bool) -> "Future[None]":
        """Start or stop capturing; stopping also interrupts a job that has the camera.

        Raises
        ------
        Problem
            ``camera-busy`` if it is to start while a job has exclusive use of the camera.
        """
        with self._occupied:
            if running:
                self.require_free()
            self._interrupted.set()
            return self.submit(lambda: self._set_running(running))

    def safe_off(self) -> "Future[None]":
        """Stop capturing and switch the light off, by the request that no state refuses.

        Done once the device has taken that request, which waits for no thread. The thread of the
        camera repeats it, in case that it was starting the capture just then.
        """
        self._interrupted.set()
        self._running = False
        off = self._off_switch.begin()
        self.submit(self._safe_off)
        return off

    def device_status(self) -> "Future[Status]":
        """Read the status of the device."""
        return self.submit(self._camera.status)

    def occupy(self, job_id: str, work: Callable[[Camera, Callable[[], None]], _T]) -> "Future[_T]":
        """Run ``work`` with exclusive use of the camera until it returns.

        No frames are reported meanwhile, and the sequence is restored afterwards. ``work`` must
        call its second argument several times a second; it raises `JobCancelled` once the light
        has to go off.

        Raises
        ------
        Problem
            ``camera-busy`` if another job has it.
        """
        with self._occupied:
            self.require_free()
            self._occupant = job_id
            self._interrupted.clear()
            occupied = self.submit(lambda: self._occupy(job_id, work))
        occupied.add_done_callback(self._occupied_done)  # also where it was taken back
        return occupied

    def require_free(self) -> None:
        """Refuse what would disturb a job with exclusive use of the camera.

        Raises
        ------
        Problem
            ``camera-busy``, with the job that has it.
        """
        job_id = self._occupant
        if job_id is not None:
            raise Problem(kinds.CAMERA_BUSY, f"The job {job_id} has the camera.", job=job_id)

    def submit(self, command: Callable[[], _T]) -> "Future[_T]":
        """Run a command between two reads of the camera."""
        future: Future[_T] = Future()

        def run() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                result = command()
            except Exception as error:
                future.set_exception(error)
            else:
                future.set_result(result)

        self._commands.put(run)
        return future

    def status(self) -> AcquisitionStatus:
        """Return the present status; never waits."""
        arrivals_s = list(self._arrivals_s)
        rate_hz = None
        if len(arrivals_s) > 1 and arrivals_s[-1] > arrivals_s[0]:
            rate_hz = (len(arrivals_s) - 1) / (arrivals_s[-1] - arrivals_s[0])
        age_s = self._clock() - self._moved_s
        state = self._state()
        return AcquisitionStatus(
            state=state,
            running=self._running,
            rate_hz=rate_hz,
            frames=self._frames,
            frame_age_s=age_s,
            reason=self._lost or self._held,
            stalled=state in ("starting", "streaming") and age_s > self._stall_after_s(),
        )

    def _state(self) -> State:
        if self._lost is not None:
            return "lost"
        if self._occupant is not None:
            return "calibrating"
        if not self._running:
            return "stopped"
        if self._held is not None:
            return "held"
        return "streaming" if self._started else "starting"

    def _stall_after_s(self) -> float:
        applied = self._camera.applied
        return max(STALLED_MIN_S, STALLED_PERIODS / applied.frame_rate_hz)

    # -- on the thread -------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self._run_commands(wait_s=0.0)
                self._step()
            except NotStreaming:  # the off switch was faster than the command behind it
                self._started = False
            except CameraError as error:
                self._camera_lost(str(error))
            except Exception:
                # no failure with one frame may end the acquisition
                _log.exception("the acquisition failed and is continued")
                self._run_commands(wait_s=BACKOFF_S[-1])
        self._shut_down()

    def _step(self) -> None:
        if self._light_is_held():
            self._run_commands(wait_s=READ_TIMEOUT_S)
        elif not self._connected:
            self._look_for_camera()
        elif self._restored is not None:
            self._configure(self._restored)
            self._restored = None
        elif not self._running:
            self._run_commands(wait_s=IDLE_S)
            self._camera.status()  # detects an unplug while nothing is read
            self._camera_works()
        elif not self._started:
            self._camera.start()
            self._started = True
            self._moved_s = self._clock()
        else:
            self._read()

    def _light_is_held(self) -> bool:
        """Switch the light off where it may not stay on; return whether it has to stay off."""
        self._act_on_lapse()
        reason = self._light.unserved()
        if reason is None or not self._running:
            if self._held is not None:
                self._held = None
                self._moved_s = self._clock()
                self._report(LightReleasedEvent())
            return False
        if self._held is None:
            self._held = reason
            _log.error("the light is switched off: %s", reason)
            self._arrivals_s.clear()
            self._report(LightHeldEvent(reason))
            if self._started:
                self._started = False
                self._camera.stop()
        return True

    def _act_on_lapse(self) -> None:
        if self._light.lapsed():
            _log.warning("a lease lapsed, and the loop that serves clients is late to act on it")
            self._interrupted.set()
            self._set_running(False)

    def _read(self) -> None:
        try:
            raw = self._camera.read_frame(timeout_s=READ_TIMEOUT_S)
        except FrameTimeout:
            return
        self._camera_works()
        self._frames += 1
        self._moved_s = self._clock()
        self._arrivals_s.append(self._moved_s)
        self._report_frame(raw)

    def _report_frame(self, raw: RawFrame) -> None:
        self._report(Captured(raw, self._applied[raw.epoch]))

    def _remember(self, applied: AppliedSequence) -> None:
        self._applied[applied.epoch] = applied
        while len(self._applied) > 8:  # frames of older sequences have long been read
            del self._applied[next(iter(self._applied))]

    def _configure(self, sequence: Sequence, expected: int | None = None) -> AppliedSequence:
        running = self._camera.applied
        if expected is not None and running.epoch != expected:
            raise SequenceConflict(running)
        applied = self._camera.configure(sequence)
        self._remember(applied)
        self._arrivals_s.clear()
        self._moved_s = self._clock()
        self._report(SequenceChanged(applied))
        return applied

    def _set_running(self, running: bool) -> None:
        if running != self._running:
            self._running = running
            self._arrivals_s.clear()
            self._moved_s = self._clock()
            if not running and self._started:
                self._started = False
                self._camera.stop()

    def _occupied_done(self, occupied: "Future[Any]") -> None:
        if occupied.cancelled():
            self._occupant = None

    def _occupy(self, job_id: str, work: Callable[[Camera, Callable[[], None]], _T]) -> _T:
        def go_on() -> None:
            self._act_on_lapse()
            if self._interrupted.is_set() or self._light.unserved() is not None:
                raise JobCancelled(job_id)
            self._run_commands(wait_s=0.0)  # those that do not need the camera, or cancel this job

        before = self._camera.applied
        try:
            go_on()
            self._arrivals_s.clear()
            if self._started:
                self._started = False
                self._camera.stop()
            return work(self._camera, go_on)
        finally:
            self._occupant = None
            self._arrivals_s.clear()
            self._moved_s = self._clock()
            applied = self._camera.applied
            if applied.sequence != before.sequence:
                self._restored = before.sequence  # once the camera is reachable
            elif applied.epoch != before.epoch:
                self._remember(applied)
                self._report(SequenceChanged(applied))

    def _safe_off(self) -> None:
        # first, so that it is not started again even if the request fails
        self._running = False
        self._started = False
        self._arrivals_s.clear()
        self._moved_s = self._clock()
        self._camera.safe_off()

    def _camera_lost(self, reason: str) -> None:
        self._connected = False
        self._started = False
        if self._lost is None:
            _log.warning("%s", reason)
            self._attempts = 0
            self._arrivals_s.clear()
            self._report(CameraLostEvent(reason))
        self._lost = reason

    def _look_for_camera(self) -> None:
        self._run_commands(wait_s=BACKOFF_S[min(self._attempts, len(BACKOFF_S) - 1)])
        if self._stopping.is_set():
            return
        self._attempts += 1
        self._camera.reconnect()
        self._connected = True
        self._moved_s = self._clock()
        self._report_sequence()  # the same, but the device counts it anew

    def _report_sequence(self) -> None:
        """Report the sequence of the camera where it is not known yet."""
        applied = self._camera.applied
        if applied.epoch not in self._applied:
            self._remember(applied)
            self._report(SequenceChanged(applied))

    def _camera_works(self) -> None:
        """Report a lost camera as back only once it has completed a request."""
        if self._lost is not None:
            _log.info("the camera is back after %d attempts", self._attempts)
            self._lost = None
            self._report(CameraRecoveredEvent())

    def _run_commands(self, *, wait_s: float) -> None:
        """Run all queued commands; with none, wait up to ``wait_s`` for one."""
        try:
            command = self._commands.get(timeout=wait_s) if wait_s else self._commands.get_nowait()
            while True:
                command()
                command = self._commands.get_nowait()
        except queue.Empty:
            return

    def _shut_down(self) -> None:
        self._run_commands(wait_s=0.0)
        self._switch_off_at_end()

    def _switch_off_at_end(self) -> None:
        try:
            self._camera.safe_off()
        except CameraError as error:
            # it is unplugged, or its heartbeat ends and it turns its light off by itself
            _log.info("the camera could not be stopped: %s", error)
