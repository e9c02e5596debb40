"""The one thread that owns the camera: reads frames, runs commands, survives an unplug.

Events are reported through ``report``, called on this thread; commands come from any thread, and
their results are futures.
"""

import logging
import math
import queue
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final, TypeVar

from transientcam_driver import (
    AppliedSequence,
    Camera,
    CameraError,
    CameraFault,
    FrameTimeout,
    NotStreaming,
    RawFrame,
    Sequence,
    Status,
)
from transientcam_driver.camera import CaptureClock
from transientcam_server.camera._darkness import Dark, Darkness, KeptCause
from transientcam_server.camera._events import (
    CameraLostEvent,
    CameraRecoveredEvent,
    Captured,
    Event,
    LightArmingEvent,
    LightOffEvent,
    SequenceChanged,
)
from transientcam_server.camera._light import Announcement, LightGuard
from transientcam_server.camera._off_switch import OffSwitch
from transientcam_server.camera._status import AcquisitionStatus, State
from transientcam_server.camera._supervision import Supervision
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


def outdated() -> Problem:
    """Return the problem of a start that was asked for before the light was to go off."""
    return Problem(kinds.START_OUTDATED, "The light was switched off after this was asked for.")


class Acquisition:
    """Owns ``camera`` from `start` to `stop`, on a thread of its own.

    Light begins ``delay_s`` after it was announced; ``darkness`` keeps that it is off.
    """

    def __init__(
        self,
        camera: Camera,
        *,
        report: Callable[[Event], None],
        light: LightGuard | None = None,
        delay_s: float = 0.0,
        darkness: Darkness | None = None,
        supervision: Supervision | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._light = LightGuard(unserved_s=math.inf, clock=clock) if light is None else light
        self._announcement = Announcement(delay_s, clock=clock)
        self._darkness = darkness
        self._supervision = supervision or Supervision(None, silence_s=math.inf)
        self._dark: Dark | None = None
        self._offs = self._allowed = secrets.randbits(31)  # not those of before a restart
        self._camera = camera
        self._off_switch = OffSwitch(camera.safe_off)
        self._report = report
        self._clock = clock
        self._commands: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._occupied = threading.Lock()
        self._occupant: str | None = None
        self._restored: Sequence | None = None
        self._stopping = threading.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="acquisition", daemon=True)
        self._running = True
        self._connected = True
        self._lost: str | None = None
        self._failed: str | None = None
        self._started = False
        self._attempts = 0
        self._frames = 0
        self._moved_s = self._read_s = clock()
        self._arrivals_s: deque[float] = deque(maxlen=_RATE_FRAMES)
        self._applied: dict[int, AppliedSequence] = {}
        self._capture_clock = CaptureClock()
        self._remember(camera.applied)

    # -- from any thread -----------------------------------------------------------------------

    def start(self, *, dark: Dark | None = None) -> None:
        """Start the thread; it captures unless there is a reason to stay ``dark``."""
        if dark is not None:
            self._dark, self._running = dark, False
        self._thread.start()

    def stop(self) -> None:
        """Stop the camera, its light and the thread; waits for it."""
        self._stopping.set()
        self._offs += 1
        self._commands.put(lambda: None)
        self._thread.join()

    def configure(
        self, sequence: Sequence, *, expected: int | None = None
    ) -> "Future[AppliedSequence]":
        """Change the sequence; with ``expected``, only if the running one still has that epoch.

        The future raises `SequenceConflict` where it has another one.

        Raises Problem ``camera-busy`` while a job has exclusive use of the camera.
        """
        with self._occupied:
            self.require_free()
            return self.submit(lambda: self._configure(sequence, expected))

    def set_running(
        self, running: bool, *, cause: KeptCause = "stop", offs: int | None = None
    ) -> "Future[None]":
        """Start or stop capturing; stopping also ends jobs that have the camera or wait for it.

        ``offs`` is what `offs` was when a start was asked for, None for now.

        Raises Problem ``start-outdated``, by the future, if the light was to go off since;
        ``camera-busy`` if it is to start while a job has exclusive use of the camera.
        """
        with self._occupied:
            if running:
                self.require_free()
                self._light.turned()  # as this was served
                asked = self.offs if offs is None else offs
                return self.submit(lambda: self._start(asked))
            return self._begin_stop(cause)

    def _begin_stop(self, cause: KeptCause) -> "Future[None]":
        self._offs += 1
        return self.submit(lambda: self._stop(cause))

    def safe_off(self) -> "Future[None]":
        """Stop capturing and switch the light off, by the request that no state refuses.

        Done once the device has taken that request, which waits for no thread. The thread of the
        camera repeats it, in case that it was starting the capture just then.
        """
        self._offs += 1
        self._running, self._dark = False, Dark("safe-off")
        if self._darkness is not None:
            self._darkness.keep(self._dark)
        off = self._off_switch.begin()
        self.submit(lambda: self._go_dark(Dark("safe-off")))
        return off

    @property
    def offs(self) -> int:
        """Counts how often the light was to go off: what was asked for before does not light."""
        return self._offs

    def device_status(self) -> "Future[Status]":
        """Read the status of the device."""
        return self.submit(self._camera.status)

    def occupy(
        self, job_id: str, work: Callable[[Camera, Callable[[], None]], _T], *, offs: int
    ) -> "Future[_T]":
        """Run ``work`` with exclusive use of the camera until it returns, once light is announced.

        No frames are reported meanwhile, and the sequence is restored afterwards. ``work`` must
        call its second argument several times a second; it raises `JobCancelled` once the light
        has to go off. ``offs`` is what `offs` was when the job was asked for.

        Raises Problem ``camera-busy`` if another job has it.
        """
        with self._occupied:
            self.require_free()
            self._occupant = job_id
            occupied = self.submit(lambda: self._occupy(job_id, work, offs))
        occupied.add_done_callback(self._occupied_done)  # also where it was taken back
        return occupied

    def require_free(self) -> None:
        """Refuse what would disturb a job with exclusive use of the camera.

        Raises Problem ``camera-busy``, with the job that has it.
        """
        job_id = self._occupant
        if job_id is not None:
            raise Problem(kinds.CAMERA_BUSY, f"The job {job_id} has the camera.", job=job_id)

    def submit(self, command: Callable[[], _T]) -> "Future[_T]":
        """Run a command between two reads of the camera.

        The future raises Problem ``shutting-down`` where the thread has ended.
        """
        future: Future[_T] = Future()

        def run() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                if self._ended:
                    raise Problem(kinds.SHUTTING_DOWN, "The camera is not served any more.")
                result = command()
            except Exception as error:
                future.set_exception(error)
            else:
                future.set_result(result)

        self._commands.put(run)
        if self._ended:
            self._run_commands(wait_s=0.0)  # no thread would
        return future

    def status(self) -> AcquisitionStatus:
        """Return the present status; never waits."""
        arrivals_s = list(self._arrivals_s)
        rate_hz = None
        if len(arrivals_s) > 1 and arrivals_s[-1] > arrivals_s[0]:
            rate_hz = (len(arrivals_s) - 1) / (arrivals_s[-1] - arrivals_s[0])
        age_s = self._clock() - self._moved_s
        stalled_s = max(STALLED_MIN_S, STALLED_PERIODS / self._camera.applied.frame_rate_hz)
        state, darkness = self._state(), self._darkness
        dark = None if state in ("arming", "calibrating") else self._dark
        return AcquisitionStatus(
            state=state,
            running=self._running,
            rate_hz=rate_hz,
            frames=self._frames,
            frame_age_s=age_s,
            reason=self._lost or (self._failed if dark is None else str(dark)),
            stalled=state in ("starting", "streaming") and age_s > stalled_s,
            light_on_in_s=self._announcement.light_on_in_s,
            off_because=None if dark is None else dark.cause,
            off_kept=None if dark is None or darkness is None else darkness.written.done(),
            offs=self.offs,
        )

    def _state(self) -> State:
        if self._lost is not None:
            return "lost"
        if self._announcement.light_on_in_s is not None:
            return "arming"
        if self._occupant is not None:
            return "calibrating"
        if not self._running:
            return "stopped"
        return "streaming" if self._started else "starting"

    # -- on the thread -------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                self._run_commands(wait_s=0.0)
                self._beat()
                self._step()
            except NotStreaming:  # the off switch was faster than the command behind it
                self._started = False
            except CameraError as error:
                if not self._shut_off_by_device(error):
                    self._camera_lost(str(error))
            except Exception as error:
                # no failure with one frame may end the acquisition
                self._failed = f"the acquisition failed and is continued: {error!r:.200}"
                _log.exception("the acquisition failed and is continued")
                self._run_commands(wait_s=BACKOFF_S[-1])
        self._run_commands(wait_s=0.0)
        self._switch_off_at_end()
        self._ended = True
        self._run_commands(wait_s=0.0)  # what was asked for meanwhile is refused

    def _beat(self) -> None:
        """Tell the supervisor that the light is under control, and hear what it has done."""
        connected, supervision = self._connected, self._supervision
        self._act_on_supervisor(
            supervision.beat(lit=self._started) if connected else supervision.lost()
        )

    def _act_on_supervisor(self, reason: str | None) -> None:
        """Stay dark until somebody starts, where the supervisor has switched off or is gone."""
        if reason is not None:
            self._offs += 1
            self._go_dark(Dark("supervisor", reason))

    def _step(self) -> None:
        self._end_uncontrolled()
        if not self._connected:
            self._look_for_camera()
        elif self._restored is not None:
            self._configure(self._restored)
            self._restored = None
        elif not self._running:
            self._end_light()  # again where that has failed
            self._run_commands(wait_s=IDLE_S)
            self._camera.status()  # detects an unplug while nothing is read
            self._camera_works()
        elif not self._started:
            if self._may_light(self._allowed):
                self._camera.start()
                self._started = True
                self._moved_s = self._read_s = self._clock()
            else:
                self._require_interlock()
                self._camera_works()
                self._run_commands(wait_s=READ_TIMEOUT_S)
        else:
            self._read()

    def _may_light(self, offs: int) -> bool:
        """Announce the light; return whether it may begin, watched: the one gate of all light."""
        self._announce()
        return (
            self._announcement.light_on_in_s is None and self._is_watched() and self._offs == offs
        )

    def _announce(self) -> None:
        if self._announcement.begin() and self._announcement.delay_s:
            _log.warning("the light goes on in %g s", self._announcement.delay_s)
            self._report(LightArmingEvent(self._announcement.delay_s))

    def _is_watched(self) -> bool:
        """Have the supervisor watch the light; return whether it does."""
        reason = self._supervision.starting()
        self._act_on_supervisor(reason)
        return reason is None

    def _end_uncontrolled(self) -> None:
        """End a capture that may not go on: nobody uses it, or nobody could stop it."""
        self._act_on_lapse()
        if self._running and (unserved := self._light.unserved()) is not None:
            self._offs += 1
            self._go_dark(Dark("unserved", unserved))
        elif self._running and (unused := self._light.unused()) is not None:
            self._go_dark(Dark("unused", unused))

    def _act_on_lapse(self) -> None:
        if self._light.lapsed():
            _log.warning("a lease lapsed, and the loop that serves clients is late to act on it")
            self._offs += 1
            self._stop("lapse")

    def _end_light(self, *, safe: bool = False) -> None:
        """Switch the light off, and again where that failed; the next one is announced anew."""
        self._announcement.withdraw()
        self._started |= safe
        if self._started:
            # `safe`: no request comes before the one that no state refuses
            (self._camera.safe_off if safe else self._camera.stop)()
            self._started = False

    def _read(self) -> None:
        if self._is_missed():
            self._end_light()
            return
        try:
            raw = self._camera.read_frame(timeout_s=READ_TIMEOUT_S)
        except FrameTimeout:
            return
        self._camera_works()
        self._frames += 1
        self._moved_s = self._clock()
        self._arrivals_s.append(self._moved_s)
        self._report_frame(raw)

    def _is_missed(self) -> bool:
        """Return whether the device went dark as it was not read, so that reading would light it.

        That includes a read that took so long, as where the process was stopped.
        """
        now_s, read_s = self._clock(), self._read_s
        heartbeat_s = self._camera.capabilities.heartbeat_s
        self._read_s = now_s
        return now_s - read_s >= heartbeat_s > 0.0

    def _report_frame(self, raw: RawFrame) -> None:
        if raw.captured_unix_s is None:
            captured_s = raw.device_time_s
            if self._camera.capabilities.clock != "ptp":
                captured_s = self._capture_clock.unix_s(
                    device_time_s=raw.device_time_s,
                    capture_s=raw.capture_s,
                    host_time_s=raw.host_time_s,
                )
            raw = replace(raw, captured_unix_s=captured_s)
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

    def _stop(self, cause: KeptCause = "stop") -> None:
        if self._running or cause == "stop":  # a lapse ends nothing that has ended already
            self._go_dark(Dark(cause))

    def _start(self, offs: int) -> None:
        if self._running and self._offs == offs:
            return
        try:
            self._require_interlock()
        except CameraFault:
            raise
        except CameraError as error:  # it starts once it is found, or answers
            _log.info("whether the interlock is closed is not known: %s", error)
        if self._offs != offs:
            raise outdated()
        self._light.used()
        self._arrivals_s.clear()
        self._moved_s = self._clock()
        self._running, self._dark, self._allowed = True, None, offs
        if self._darkness is not None:
            self._darkness.keep(None)
        if self._connected:
            self._announce()  # by the time it is answered

    def _go_dark(self, dark: Dark) -> None:
        """End the capture, and keep that it ended, also where the camera fails."""
        self._running, self._dark = False, dark
        self._arrivals_s.clear()
        self._moved_s = self._clock()
        try:
            self._end_light(safe=dark.cause in ("safe-off", "supervisor"))
        finally:
            _log.warning("%s", dark)
            if self._darkness is not None:
                self._darkness.keep(dark)
            self._report(LightOffEvent(dark))

    def _require_interlock(self) -> None:
        if not self._camera.status().interlock_closed:
            raise CameraFault("the interlock is open")

    def _shut_off_by_device(self, error: CameraError) -> bool:
        """Go dark where a failure is the device's own protection, and return whether it is."""
        opened = isinstance(error, CameraFault)
        try:
            self._require_interlock()
        except CameraError as now:
            opened = opened or isinstance(now, CameraFault)
        if opened and self._running:
            self._started = False  # by the device
            self._go_dark(Dark("device", str(error)))
        return opened

    def _occupied_done(self, occupied: "Future[Any]") -> None:
        if occupied.cancelled():
            self._occupant = None

    def _occupy(
        self, job_id: str, work: Callable[[Camera, Callable[[], None]], _T], offs: int
    ) -> _T:
        def go_on() -> None:
            self._act_on_lapse()
            self._is_watched()
            self._run_commands(wait_s=0.0)  # those that do not need the camera, or cancel this job
            # behind the commands: one of them may have switched the light off
            if self._offs != offs or self._light.unserved() is not None:
                raise JobCancelled(job_id)

        before = self._camera.applied
        try:
            go_on()
            while not self._may_light(offs):
                self._run_commands(wait_s=READ_TIMEOUT_S)
                go_on()
            self._arrivals_s.clear()
            if self._started:
                self._camera.stop()
                self._started = False
            return work(self._camera, go_on)
        except CameraError as error:
            self._started = True  # as far as anybody knows
            if self._offs == offs:
                raise
            raise JobCancelled(job_id) from error  # the off switch was faster than this thread
        finally:
            self._occupant = None
            if not self._running:
                self._announcement.withdraw()
            self._arrivals_s.clear()
            self._moved_s = self._clock()
            applied = self._camera.applied
            if applied.sequence != before.sequence:
                self._restored = before.sequence  # once the camera is reachable
            elif applied.epoch != before.epoch:
                self._remember(applied)
                self._report(SequenceChanged(applied))

    def _camera_lost(self, reason: str) -> None:
        self._connected = False
        self._started = True
        with suppress(CameraError):
            self._end_light()  # or it would light by itself once it is found again
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
        self._end_light()  # where that has failed when it was lost
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
        self._failed = None
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

    def _switch_off_at_end(self) -> None:
        dark = True
        try:
            self._camera.safe_off()
        except CameraError as error:
            # it is unplugged, or its light goes off by its heartbeat or by its supervisor
            _log.info("the camera could not be stopped: %s", error)
            dark = False
        self._supervision.close(dark=dark)
