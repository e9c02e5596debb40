"""One recording while it runs: a thread that writes, and a short queue that the camera's fills.

The camera's thread never waits: a frame that finds the queue full is dropped and counted.
"""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal, get_args

from transientcam_driver import AppliedSequence, RawFrame
from transientcam_server.recording._layout import Header
from transientcam_server.recording._swmr import in_words
from transientcam_server.recording._writer import RecordingWriter

_log = logging.getLogger("transientcam_server.recording.recorder")
CHECK_S: Final = 0.2
"""Interval at which limits are checked while no frame comes."""
_REMOVED: Final = "its file was removed while it was written"
_CHECK_DISK_S: Final = 1.0

Reason = Literal[
    "stopped", "duration", "size", "frames", "disk-space", "sequence-changed", "failed", "shutdown"
]


@dataclass(frozen=True, slots=True)
class Limits:
    """When a recording ends by itself; None for never.

    ``free_bytes`` is what it leaves free on the disk.
    """

    duration_s: float | None = None
    size_bytes: int | None = None
    frames: int | None = None
    free_bytes: int = 0


@dataclass(frozen=True, slots=True)
class Progress:
    """Size of a recording so far; ``reason`` and ``problem`` once it has ended."""

    frames: int
    synchronised_frames: int
    dropped_frames: int
    size_bytes: int
    duration_s: float
    reason: Reason | None
    problem: str | None
    finished: bool


@dataclass(frozen=True, slots=True)
class Totals:
    """Frames and bytes of all recordings; ``ended`` counts recordings by why they ended."""

    frames: int = 0
    dropped_frames: int = 0
    size_bytes: int = 0
    ended: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(get_args(Reason), 0))

    def with_running(self, progress: Progress) -> "Totals":
        """Return the totals together with a recording that has not ended."""
        return replace(
            self,
            frames=self.frames + progress.frames,
            dropped_frames=self.dropped_frames + progress.dropped_frames,
            size_bytes=self.size_bytes + progress.size_bytes,
        )

    def after(self, progress: Progress) -> "Totals":
        """Return the totals after a recording has ended."""
        reason = progress.reason or "failed"
        ended = {**self.ended, reason: self.ended[reason] + 1}
        return replace(self.with_running(progress), ended=ended)


class Recorder:
    """Writes what is offered until a limit is reached or it is stopped.

    ``writer``: closed by the recorder.
    ``queue_frames``: how many frames may wait for the disk.
    ``free_bytes``: returns the free space of the disk.
    ``on_dropped``: called on the writing thread, at most once a second, with how many frames were
    dropped since the call before, and in all.
    ``on_end``: called last, on the writing thread.
    ``awaits_past``: write nothing before `precede` was called.
    """

    def __init__(
        self,
        writer: RecordingWriter,
        header: Header,
        *,
        limits: Limits,
        annotations: Mapping[str, Any] | None = None,
        queue_frames: int,
        free_bytes: Callable[[], int],
        on_dropped: Callable[[int, int], None] = lambda count, total: None,
        on_end: Callable[["Recorder"], None] = lambda recorder: None,
        awaits_past: bool = False,
        clock: Callable[[], float] = time.monotonic,
        unix_s: Callable[[], float] = time.time,
    ) -> None:
        self.header = header
        self.limits = limits
        self._writer = writer
        self.annotations = dict(annotations or {})
        """What people wrote about it, as JSON."""
        self._depth = queue_frames
        self._free_bytes = free_bytes
        self._on_dropped = on_dropped
        self._on_end = on_end
        self._clock = clock
        self._unix_s = unix_s
        self._changed = threading.Condition()
        self._waiting: deque[tuple[RawFrame, int]] = deque()
        self._past: deque[RawFrame] = deque()
        self._past_s = 0.0
        self._awaits_past = awaits_past
        self._work: deque[Callable[[], None]] = deque()
        self._reason: Reason | None = None
        self._problem: str | None = None
        self._dropped = 0
        self._dropped_before_next = 0
        self._reported_dropped = 0
        self._began_s = clock()
        self._ended_s: float | None = None
        self._busy_since_s: float | None = None
        self._checked_s = -float("inf")
        self._size_bytes = writer.bytes_written
        self._finished = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)

    # -- from any thread -----------------------------------------------------------------------

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def precede(self, past: Sequence[tuple[RawFrame, AppliedSequence]]) -> int:
        """Write frames that were captured before it began first; return how many were taken.

        ``past`` is oldest first; frames of another sequence and those already offered are left out.
        """
        with self._changed:
            offered = {id(raw) for raw, _ in self._waiting}
            if self._reason is None:
                for raw, applied in past:
                    if id(raw) in offered:
                        break
                    if self._is_ours(applied):
                        self._past.append(raw)
            if self._past:
                self._past_s = max(0.0, self.header.started_s - self._past[0].host_time_s)
            self._awaits_past = False
            self._changed.notify()
            return len(self._past)

    def offer(self, raw: RawFrame, applied: AppliedSequence) -> None:
        """Take a frame; never waits for the disk."""
        if not self._is_ours(applied):
            self.stop("sequence-changed")
            return
        with self._changed:
            if self._reason is not None:
                return
            if len(self._waiting) >= self._depth:
                self._dropped += 1
                self._dropped_before_next += 1
                return
            self._waiting.append((raw, self._dropped_before_next))
            self._dropped_before_next = 0
            self._changed.notify()

    def stop(self, reason: Reason = "stopped") -> None:
        """Take no more frames; those in the queue are still written."""
        with self._changed:
            self._reason = self._reason or reason
            self._changed.notify()

    def annotate(self, annotations: Mapping[str, Any]) -> bool:
        """Replace the annotations on the writing thread; false when it has ended already."""
        with self._changed:
            if self._reason is not None:
                return False
            self.annotations = dict(annotations)
            self._work.append(lambda: self._writer.annotate(annotations))
            self._changed.notify()
            return True

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait until it has ended; return whether it has."""
        return self._finished.wait(timeout_s)

    @property
    def waiting_s(self) -> float:
        """How long it has waited for the disk; 0 while it does not."""
        since_s = self._busy_since_s
        return 0.0 if since_s is None else self._clock() - since_s

    @property
    def progress(self) -> Progress:
        """Its present progress; never waits."""
        until_s = self._clock() if self._ended_s is None else self._ended_s
        return Progress(
            frames=self._writer.frames,
            synchronised_frames=self._writer.synchronised_frames,
            dropped_frames=self._dropped,
            size_bytes=self._size_bytes,
            duration_s=self._past_s + until_s - self._began_s,
            reason=self._reason,
            problem=self._problem,
            finished=self._finished.is_set(),
        )

    # -- on the thread -------------------------------------------------------------------------

    def _run(self) -> None:
        while self._turn():
            pass
        self._finish()

    def _turn(self) -> bool:
        """Do one step; false after the last, which may have failed."""
        try:
            return self._step()
        except Exception as error:
            self._fail(error)
            return False

    def _finish(self) -> None:
        self._ended_s = self._busy_since_s = self._clock()
        try:
            self._writer.close(self._end())
        except Exception as error:
            self._fail(error)
        self._report_dropped()
        try:
            self._on_end(self)
        finally:
            self._busy_since_s = None
            self._finished.set()

    def _step(self) -> bool:
        """Write the next frame; false once there are no more to come."""
        self._busy_since_s = None
        with self._changed:
            idle = self._awaits_past or not (self._past or self._waiting)
            if idle and not (self._work or self._reason):
                self._changed.wait(CHECK_S)
            work = list(self._work)
            self._work.clear()
            ending = self._reason is not None
            frame = self._next() if ending or not self._awaits_past else None
        self._busy_since_s = self._clock()
        for each in work:
            each()
        if frame is not None:
            self._writer.append(frame[0], dropped_frames=frame[1])
        self._check_limits()
        return frame is not None or not ending

    def _next(self) -> tuple[RawFrame, int] | None:
        if self._past:
            return self._past.popleft(), 0
        return self._waiting.popleft() if self._waiting else None

    def _is_ours(self, applied: AppliedSequence) -> bool:
        own = self.header.applied
        return (applied.sequence, applied.low_frequency_hz) == (own.sequence, own.low_frequency_hz)

    def _check_limits(self) -> None:
        """Flush to the disk, and stop at the limits."""
        now_s = self._clock()
        # HDF5 releases some space again; the reported size never shrinks
        self._size_bytes = max(self._size_bytes, self._writer.bytes_written)
        if now_s - self._checked_s >= _CHECK_DISK_S:
            self._checked_s = now_s
            if not self._writer.is_there:
                raise FileNotFoundError
            self._writer.synchronise(now_s)
            self._report_dropped()
            if self._free_bytes() < self.limits.free_bytes:
                self._end_at_once("disk-space")
        limits = self.limits
        if limits.frames is not None and self._writer.frames >= limits.frames:
            self._end_at_once("frames")
        if limits.size_bytes is not None and self._size_bytes >= limits.size_bytes:
            self._end_at_once("size")
        if limits.duration_s is not None and now_s - self._began_s >= limits.duration_s:
            self.stop("duration")

    def _end_at_once(self, reason: Reason) -> None:
        with self._changed:
            if self._reason is None:
                self._reason = reason
            self._past.clear()
            self._waiting.clear()

    def _fail(self, error: Exception) -> None:
        # the first failure is the cause; one while closing follows from it
        if self._problem is None:
            # whatever is looked for first, file or directory, was there when it began
            gone = isinstance(error, FileNotFoundError)
            self._problem = _REMOVED if gone else in_words(error)
            _log.error("recording %s failed: %s", self.header.recording_id, self._problem)
        with self._changed:
            self._reason = "failed"
            self._past.clear()
            self._waiting.clear()

    def _report_dropped(self) -> None:
        total = self._dropped
        if total > self._reported_dropped:
            self._on_dropped(total - self._reported_dropped, total)
            self._reported_dropped = total

    def _end(self) -> dict[str, Any]:
        return {
            "reason": self._reason,
            "problem": self._problem,
            "ended_s": self._unix_s(),
            "duration_s": self.progress.duration_s,
            "frames": self._writer.frames,
            "dropped_frames": self._dropped,
        }
