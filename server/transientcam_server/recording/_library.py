"""The recordings of a service: one directory of files, and the one that is being written.

An id from a client never becomes a path: it is looked up among the files that exist.
"""

import logging
import math
import secrets
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from transientcam_driver import AppliedSequence, RawFrame
from transientcam_server.errors import Problem, RecordingInUse, kinds
from transientcam_server.recording import (
    _layout as layout,
    _listing as names,
    _recovery as recovery,
)
from transientcam_server.recording._descriptions import Descriptions, of_recorder, of_removed
from transientcam_server.recording._directory import Directory, id_of
from transientcam_server.recording._disk_threads import DiskThreads
from transientcam_server.recording._layout import Header
from transientcam_server.recording._problems import (
    not_stored,
    require_annotations,
    unfinished,
    unknown,
)
from transientcam_server.recording._recorder import Limits, Recorder, Totals
from transientcam_server.recording._uploads import Upload
from transientcam_server.recording._writer import RecordingWriter, annotate
from transientcam_server.settings import RecordingSettings

_log = logging.getLogger("transientcam_server.recording.library")
_STOP_WITHIN_S: Final = 60.0
_END_S: Final = 2.0
"""What a disk that does nothing is waited for at the end of the service."""
_REMOVED: Final = 16
"""How many recordings whose files were removed are remembered."""
Notify = Callable[[str, Mapping[str, Any]], None]


@dataclass(frozen=True, slots=True)
class RecordingOptions:
    """What to record; ``past`` waits for frames from the history, see `Library.precede`."""

    name: str | None = None
    limits: Limits = field(default_factory=Limits)
    annotations: Mapping[str, Any] | None = None
    past: bool = False


class Library:
    """Makes, lists and deletes recordings; its methods run on any thread and wait for the disk.

    ``header``: returns the header of a new recording for its id, name and time of start.
    ``notify``: called for ``recording-started``, ``recording-dropped``, ``recording-stopped`` and
    ``disk-stalled``, on the thread on which it happens.
    """

    def __init__(
        self,
        settings: RecordingSettings,
        *,
        header: Callable[[str, str, float], Header],
        notify: Notify = lambda kind, details: None,
        unix_s: Callable[[], float] = time.time,
    ) -> None:
        self._settings = settings
        self._directory = Directory(settings.directory)
        self._header = header
        self._notify = notify
        self._unix_s = unix_s
        self._starting = threading.Lock()
        self._active: Recorder | None = None
        self._problems: dict[str, dict[str, Any]] = {}
        self._removed: dict[str, dict[str, Any]] = {}
        self.known_free_bytes: int | None = None
        """Free space of the disk when it was last asked for."""
        self._stalled = False
        self.disk = DiskThreads(stalled_s=settings.stalled_s, activity=self._activity)
        """Where requests wait for what is here."""
        self._descriptions = Descriptions()
        self._counted: tuple[Totals, Recorder | None] = Totals(), None
        self._recovering: frozenset[str] = frozenset()
        self._closing = threading.Event()
        self._recovery: threading.Thread | None = None

    # -- life ----------------------------------------------------------------------------------

    def open(self) -> None:
        """Recover unfinished recordings of an earlier service, on a thread of its own."""
        directory = self._directory
        if not directory.path.is_dir():
            return
        try:
            parts = recovery.unfinished(directory.path)
        except OSError as error:
            _log.warning("recordings cannot be recovered: %s", error)
            return
        if parts:
            self._recovering = frozenset(map(id_of, parts))
            self._recovery = threading.Thread(
                target=self._recover, args=(parts,), name="recovery", daemon=True
            )
            self._recovery.start()

    def close(self) -> None:
        """Finish the recording that runs and wait for it, and the recovery, while the disk works.

        A recording whose disk does not answer is left to the next start.
        """
        self._closing.set()
        recorder = self._active
        if recorder is not None:
            recorder.stop("shutdown")
            if not self._wait(recorder, max(0.0, _END_S - recorder.waiting_s)):
                _log.warning("the disk does not answer: the recording is left to be recovered")
        if self._recovery is not None:
            self._recovery.join(_END_S)
        self.disk.close()

    # -- recording -----------------------------------------------------------------------------

    @property
    def directory(self) -> Path:
        """Directory of the recordings; created with the first one."""
        return self._directory.path

    @property
    def active_id(self) -> str | None:
        """Id of the recording that runs, None without one."""
        recorder = self._active
        if recorder is None or recorder.progress.finished:
            return None
        return recorder.header.recording_id

    def free_bytes(self) -> int | None:
        """Return the free space of the disk; None where there is no directory yet."""
        try:
            self.known_free_bytes = self._directory.free_bytes()
        except OSError:
            self.known_free_bytes = None
        return self.known_free_bytes

    @property
    def totals(self) -> Totals:
        """Totals since the service started, with the recording that runs."""
        recorder, (totals, last) = self._active, self._counted
        if recorder is None or recorder is last:
            return totals
        return totals.with_running(recorder.progress)

    def offer(self, raw: RawFrame, applied: AppliedSequence) -> None:
        """Take a captured frame; never waits."""
        recorder = self._active
        if recorder is not None:
            recorder.offer(raw, applied)
            if recorder.waiting_s < self._settings.stalled_s:
                self._stalled = False
            elif not self._stalled:
                self._stalled = True
                self._notify("disk-stalled", {"recording": recorder.header.recording_id})

    def start(self, options: RecordingOptions) -> dict[str, Any]:
        """Start a recording and describe it.

        Raises Problem ``recording-runs`` when there is one already, ``recording-not-stored`` where
        no file can be made.
        """
        require_annotations(options.annotations or {})
        with self._starting:
            if self._active is not None and not self._active.progress.finished:
                running = self._active.header.recording_id
                raise Problem(
                    kinds.RECORDING_RUNS, f"{running} is being recorded.", recording=running
                )
            started_s = self._unix_s()
            recorder = self._recorder(options, started_s)
            self._active = recorder
            recorder.start()
        self._notify("recording-started", {"recording": recorder.header.recording_id})
        return of_recorder(recorder)

    def precede(self, recording_id: str, past: Sequence[tuple[RawFrame, AppliedSequence]]) -> int:
        """Put frames of the history before a recording's own; return how many were taken.

        A recording started with ``past`` writes nothing before this call, which never waits.
        """
        recorder = self._recorder_of(recording_id)
        return 0 if recorder is None else recorder.precede(past)

    def stop(self, recording_id: str) -> dict[str, Any]:
        """End a recording, if it has not ended, and describe it."""
        recorder = self._recorder_of(recording_id)
        if recorder is not None:
            recorder.stop()
            self._wait(recorder, self._settings.stalled_s)
        return self.describe(recording_id)

    def receive(self, announced_bytes: int = 0) -> Upload:
        """Make room for a recording that is sent here.

        Raises Problem ``too-large``, ``recording-not-stored``.
        """
        return Upload(self._directory, self._settings, _new_id(self._unix_s()), announced_bytes)

    def take_in(self, upload: Upload, go_on: Callable[[], None]) -> dict[str, Any]:
        """Make a recording of what was sent, and describe it; one at a time.

        ``go_on``: called several times a second; what it raises ends it.
        Raises Problem ``invalid-recording``, ``too-large``, ``recording-not-stored``,
        ``shutting-down``.
        """

        def ask() -> None:
            if self._closing.is_set():
                raise Problem(kinds.SHUTTING_DOWN, "The service is shutting down.")
            go_on()

        return self.describe(upload.take_in(ask))

    # -- keeping -------------------------------------------------------------------------------

    def describe_all(self) -> list[dict[str, Any]]:
        """Describe all recordings, the newest first."""
        ids = self._directory.ids()
        self._descriptions.keep(ids)
        documents = [self._described(each) for each in ids | self._removed.keys()]
        found = [document for document in documents if document is not None]
        return sorted(found, key=lambda each: (each["started_s"] or 0.0, each["id"]), reverse=True)

    def describe(self, recording_id: str) -> dict[str, Any]:
        """Describe a recording.

        Raises Problem ``unknown-recording``.
        """
        document = self._described(recording_id)
        if document is None:
            raise unknown(recording_id)
        return document

    def find(self, recording_id: str) -> Path:
        """Return the file of a recording, also of one that is still being written.

        Raises
        ------
        Problem
            ``unknown-recording``, or ``recording-unfinished`` while it is being recovered.
        """
        path = self._directory.find(recording_id)
        if path is None:
            raise unknown(recording_id)
        if recording_id in self._recovering:
            raise unfinished(recording_id)
        return path

    def path(self, recording_id: str) -> Path:
        """Return the file of a whole recording.

        Raises Problem ``unknown-recording``, or ``recording-unfinished``.
        """
        path = self._directory.find(recording_id)
        if path is None:
            raise unknown(recording_id)
        if path.name.endswith(".part"):
            raise unfinished(recording_id)
        return path

    def download_name(self, recording_id: str) -> str:
        """Return what the file of a recording is called where it is downloaded.

        Raises Problem ``unknown-recording``.
        """
        return names.download_name(self.describe(recording_id)["name"], recording_id)

    def annotate(self, recording_id: str, annotations: Mapping[str, Any]) -> dict[str, Any]:
        """Replace a recording's annotations and describe it."""
        require_annotations(annotations)
        recorder = self._recorder_of(recording_id)
        if recorder is None or not recorder.annotate(annotations):
            if recorder is not None:
                self._wait(recorder, self._settings.stalled_s)
            path = self.path(recording_id)
            try:
                annotate(path, annotations)
            except OSError as error:
                raise not_stored(path, error) from error
        return self.describe(recording_id) | {"annotations": dict(annotations)}

    def delete(self, recording_id: str) -> dict[str, Any]:
        """Delete a recording and describe what it was."""
        if self._recorder_of(recording_id) is not None or recording_id in self._recovering:
            raise unfinished(recording_id)
        document = self.describe(recording_id)
        if self._removed.pop(recording_id, None) is None:
            try:
                self._directory.remove(recording_id)
            except RecordingInUse:
                raise unfinished(recording_id) from None
            except OSError as error:
                raise not_stored(self.directory, error) from error
        self._problems.pop(recording_id, None)
        self._descriptions.keep(self._directory.ids())
        return document

    @property
    def disk_waiting_s(self) -> float:
        """How long the disk has not answered what was asked of it longest ago."""
        recorder = self._active
        return max(self.disk.waiting_s, 0.0 if recorder is None else recorder.waiting_s)

    # -- inside --------------------------------------------------------------------------------

    def _activity(self) -> object:
        """Return what changes while the disk does something."""
        recorder = self._active
        return len(self._descriptions), recorder and recorder.progress.frames

    def _recorder(self, options: RecordingOptions, started_s: float) -> Recorder:
        recording_id = _new_id(started_s)
        name = options.name or names.default_name(layout.utc(started_s))
        header = self._header(recording_id, name, started_s)
        try:
            self._directory.make()
            self._directory.require_free(self._settings.min_free_bytes)
            path = self._directory.new(recording_id)
            writer = RecordingWriter(path, header, annotations=options.annotations)
        except OSError as error:
            raise not_stored(self.directory, error) from error
        return Recorder(
            writer,
            header,
            limits=self._limits(options.limits),
            annotations=options.annotations,
            queue_frames=self._queue_frames(header),
            free_bytes=self._directory.free_bytes,
            on_dropped=self._dropped,
            on_end=self._ended,
            awaits_past=options.past,
            unix_s=self._unix_s,
        )

    def _limits(self, requested: Limits) -> Limits:
        settings = self._settings
        return Limits(
            duration_s=_least(requested.duration_s, settings.max_duration_s),
            size_bytes=_least(requested.size_bytes, settings.max_bytes),
            frames=requested.frames,
            free_bytes=max(requested.free_bytes, settings.min_free_bytes),
        )

    def _queue_frames(self, header: Header) -> int:
        frame_bytes = header.applied.images * header.capabilities.image_bytes
        return max(2, self._settings.queue_bytes // frame_bytes)

    def _dropped(self, count: int, total: int) -> None:
        self._notify("recording-dropped", {"count": count, "total": total})

    def _ended(self, recorder: Recorder) -> None:
        progress, recording_id = recorder.progress, recorder.header.recording_id
        if progress.problem is not None:
            self._problems[recording_id] = {
                "reason": "failed",
                "problem": progress.problem,
                "synced_frames": progress.synchronised_frames,
            }
            if self._directory.find(recording_id) is None:
                self._removed[recording_id] = of_removed(recorder)  # it stays listed
                while len(self._removed) > _REMOVED:
                    del self._removed[next(iter(self._removed))]
        self._counted = self._counted[0].after(progress), recorder
        details = {
            "recording": recording_id,
            "reason": progress.reason,
            "problem": progress.problem,
            "frames": progress.frames,
            "dropped_frames": progress.dropped_frames,
        }
        self._notify("recording-stopped", details)

    def _wait(self, recorder: Recorder, stalled_s: float) -> bool:
        """Wait until a recorder has ended, or its disk does nothing; return whether it has."""
        for _ in range(math.ceil(_STOP_WITHIN_S / max(stalled_s, 0.1))):
            before = recorder.progress.frames
            if recorder.wait(stalled_s):
                return True
            if recorder.progress.frames == before:
                break
        return False

    def _recorder_of(self, recording_id: str) -> Recorder | None:
        """Return the recorder of a recording that has not ended."""
        recorder = self._active
        if recorder is None or recorder.header.recording_id != recording_id:
            return None
        return None if recorder.progress.finished else recorder

    def _described(self, recording_id: str) -> dict[str, Any] | None:
        recorder = self._recorder_of(recording_id)
        if recorder is not None:
            return of_recorder(recorder)
        document = self._of_file(recording_id)
        if document is None:
            return self._removed.get(recording_id)
        if recording_id in self._recovering:
            document["state"] = "recovering"
        if recording_id in self._problems:
            document |= self._problems[recording_id]
        return document

    def _of_file(self, recording_id: str) -> dict[str, Any] | None:
        for _ in range(2):  # one that was unfinished may have been finished, and renamed, since
            path = self._directory.find(recording_id)
            if path is None:
                return None
            document = self._descriptions.of_file(path)
            if document is not None:
                return document
        return None

    def _recover(self, parts: list[Path]) -> None:
        for part in parts:
            recovery.recover_all([part], stop=self._closing.is_set)
            self._recovering -= {id_of(part)}


def _new_id(unix_s: float) -> str:
    return f"{layout.utc(unix_s):%Y%m%dT%H%M%SZ}-{secrets.token_hex(3)}"


def _least(requested: Any, allowed: Any) -> Any:
    given = [each for each in (requested, allowed) if each is not None]
    return min(given, default=None)
