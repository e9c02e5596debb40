"""The recordings of a service: one directory of files, and the one that is being written.

What clients call a recording never becomes a path: they name it by its id, which is looked up
among the files that are there.
"""

import fcntl
import json
import logging
import os
import re
import secrets
import shutil
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from transientcam_driver import AppliedSequence, RawFrame
from transientcam_server import problem_kinds as kinds
from transientcam_server.errors import NotARecording, Problem
from transientcam_server.recording import layout, recovery
from transientcam_server.recording.annotating import annotate
from transientcam_server.recording.layout import Header
from transientcam_server.recording.reader import Recording
from transientcam_server.recording.recorder import Limits, Recorder
from transientcam_server.recording.swmr import in_words
from transientcam_server.recording.writer import RecordingWriter
from transientcam_server.settings import RecordingSettings

_log = logging.getLogger(__name__)
_ID: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,127}")
_STOP_WITHIN_S: Final = 60.0
Tell = Callable[[str, Mapping[str, Any]], None]


@dataclass(frozen=True, slots=True)
class Wanted:
    """What somebody wants recorded; ``past`` for frames that have passed, see `Library.precede`."""

    name: str | None = None
    limits: Limits = field(default_factory=Limits)
    annotations: Mapping[str, Any] | None = None
    past: bool = False


class Library:
    """Records, lists, and keeps recordings; methods from any thread, and they wait for the disk.

    Parameters
    ----------
    header
        Makes the header of a new recording from its id, name and time of start.
    tell
        Told of ``recording-started``, ``recording-dropped`` and ``recording-stopped``, on
        whichever thread it happens.
    """

    def __init__(
        self,
        settings: RecordingSettings,
        *,
        header: Callable[[str, str, float], Header],
        tell: Tell = lambda kind, details: None,
        unix_s: Callable[[], float] = time.time,
    ) -> None:
        self._settings = settings
        self._directory = settings.directory
        self._header = header
        self._tell = tell
        self._unix_s = unix_s
        self._starting = threading.Lock()
        self._active: Recorder | None = None
        self._problems: dict[str, dict[str, Any]] = {}
        self._known: dict[Path, tuple[tuple[int, int], dict[str, Any]]] = {}
        self._recovering: frozenset[str] = frozenset()
        self._closing = threading.Event()
        self._recovery: threading.Thread | None = None
        self._lock: int | None = None

    # -- life ----------------------------------------------------------------------------------

    def open(self) -> None:
        """Recover, on a thread of its own, what the last service left unfinished."""
        if not self._directory.is_dir():
            return
        parts = recovery.unfinished(self._directory) if self._is_ours_alone() else []
        self._share()
        if parts:
            self._recovering = frozenset(map(_id_of, parts))
            self._recovery = threading.Thread(
                target=self._recover, args=(parts,), name="recovery", daemon=True
            )
            self._recovery.start()

    def close(self) -> None:
        """Finish the recording that runs, and wait for everything."""
        self._closing.set()
        recorder = self._active
        if recorder is not None:
            recorder.stop("shutdown")
            recorder.join()
        if self._recovery is not None:
            self._recovery.join()
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    # -- recording -----------------------------------------------------------------------------

    @property
    def directory(self) -> Path:
        """Where recordings are kept; made with the first one."""
        return self._directory

    @property
    def active_id(self) -> str | None:
        """The recording that runs."""
        recorder = self._active
        if recorder is None or recorder.progress.finished:
            return None
        return recorder.header.recording_id

    def free_bytes(self) -> int | None:
        """Return what the disk has left; None where there is no directory yet."""
        try:
            return self._free_bytes()
        except OSError:
            return None

    def offer(self, raw: RawFrame, applied: AppliedSequence) -> None:
        """Take a captured frame; never waits."""
        recorder = self._active
        if recorder is not None:
            recorder.offer(raw, applied)

    def start(self, wanted: Wanted) -> dict[str, Any]:
        """Start a recording and describe it.

        Raises
        ------
        Problem
            ``recording-runs`` when there is one already, ``recording-not-stored`` where no file
            can be made.
        """
        _check(wanted.annotations or {})
        with self._starting:
            if self._active is not None and not self._active.progress.finished:
                running = self._active.header.recording_id
                raise Problem(
                    kinds.RECORDING_RUNS, f"{running} is being recorded.", recording=running
                )
            started_s = self._unix_s()
            recorder = self._recorder(wanted, started_s)
            self._active = recorder
            recorder.start()
        document = self._describe_active(recorder)
        self._tell("recording-started", {"recording": recorder.header.recording_id})
        return document

    def precede(
        self, recording_id: str, past: Sequence[tuple[RawFrame, AppliedSequence]]
    ) -> int:
        """Let a recording begin with frames that have passed; return how many those are.

        One that wants them waits for this call, which itself never waits.
        """
        recorder = self._recorder_of(recording_id)
        return 0 if recorder is None else recorder.precede(past)

    def stop(self, recording_id: str) -> dict[str, Any]:
        """End a recording, if it has not ended, and describe it."""
        recorder = self._recorder_of(recording_id)
        if recorder is not None:
            recorder.stop()
            recorder.wait(_STOP_WITHIN_S)
        return self.describe(recording_id)

    # -- keeping -------------------------------------------------------------------------------

    def describe_all(self) -> list[dict[str, Any]]:
        """Describe all recordings, the newest first."""
        ids = {_id_of(path) for path in self._files()}
        documents = [self._described(each) for each in ids]
        found = [document for document in documents if document is not None]
        return sorted(found, key=lambda each: (each["started_s"] or 0.0, each["id"]), reverse=True)

    def describe(self, recording_id: str) -> dict[str, Any]:
        """Describe a recording.

        Raises
        ------
        Problem
            ``unknown-recording``.
        """
        document = self._described(recording_id)
        if document is None:
            raise _unknown(recording_id)
        return document

    def find(self, recording_id: str) -> Path:
        """Return the file of a recording, also of one that is still being written.

        Raises
        ------
        Problem
            ``unknown-recording``, or ``recording-unfinished`` while it is being recovered.
        """
        path = self._path(recording_id)
        if path is None:
            raise _unknown(recording_id)
        if recording_id in self._recovering:
            raise _unfinished(recording_id)
        return path

    def path(self, recording_id: str) -> Path:
        """Return the file of a whole recording.

        Raises
        ------
        Problem
            ``unknown-recording``, or ``recording-unfinished``.
        """
        path = self._path(recording_id)
        if path is None:
            raise _unknown(recording_id)
        if path.name.endswith(".part"):
            raise _unfinished(recording_id)
        return path

    def annotate(self, recording_id: str, annotations: Mapping[str, Any]) -> dict[str, Any]:
        """Replace a recording's annotations and describe it."""
        _check(annotations)
        recorder = self._recorder_of(recording_id)
        if recorder is None or not recorder.annotate(annotations):
            if recorder is not None:
                recorder.wait(_STOP_WITHIN_S)
            path = self.path(recording_id)
            try:
                annotate(path, annotations)
            except OSError as error:
                raise _not_stored(path, error) from error
        return self.describe(recording_id) | {"annotations": dict(annotations)}

    def delete(self, recording_id: str) -> dict[str, Any]:
        """Delete a recording and describe what it was."""
        if self._recorder_of(recording_id) is not None or recording_id in self._recovering:
            raise _unfinished(recording_id)
        document = self.describe(recording_id)
        path = self._path(recording_id)
        if path is None:
            raise _unknown(recording_id)
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise _not_stored(path, error) from error
        return document

    # -- inside --------------------------------------------------------------------------------

    def _recorder(self, wanted: Wanted, started_s: float) -> Recorder:
        moment = datetime.fromtimestamp(started_s, UTC)
        recording_id = f"{moment:%Y%m%dT%H%M%SZ}-{secrets.token_hex(3)}"
        name = wanted.name or f"Recording of {moment:%Y-%m-%d %H:%M:%S} UTC"
        header = self._header(recording_id, name, started_s)
        path = self._directory / (recording_id + layout.SUFFIX)
        try:
            self._directory.mkdir(parents=True, exist_ok=True)
            self._share()
            self._require_room()
            writer = RecordingWriter(path, header, annotations=wanted.annotations)
        except OSError as error:
            raise _not_stored(self._directory, error) from error
        return Recorder(
            writer,
            header,
            limits=self._limits(wanted.limits),
            queue_frames=self._queue_frames(header),
            free_bytes=self._free_bytes,
            on_dropped=self._dropped,
            on_end=self._ended,
            awaits_past=wanted.past,
            unix_s=self._unix_s,
        )

    def _limits(self, wanted: Limits) -> Limits:
        settings = self._settings
        return Limits(
            duration_s=_least(wanted.duration_s, settings.max_duration_s),
            size_bytes=_least(wanted.size_bytes, settings.max_bytes),
            frames=wanted.frames,
            free_bytes=max(wanted.free_bytes, settings.min_free_bytes),
        )

    def _queue_frames(self, header: Header) -> int:
        frame_bytes = header.applied.images * header.capabilities.image_bytes
        return max(2, self._settings.queue_bytes // frame_bytes)

    def _free_bytes(self) -> int:
        return shutil.disk_usage(self._directory).free

    def _require_room(self) -> None:
        free, least = self._free_bytes(), self._settings.min_free_bytes
        if free < least:
            raise OSError(28, f"{free} bytes are free, {least} have to stay so")

    def _dropped(self, count: int, total: int) -> None:
        self._tell("recording-dropped", {"count": count, "total": total})

    def _ended(self, recorder: Recorder) -> None:
        progress, recording_id = recorder.progress, recorder.header.recording_id
        if progress.problem is not None:
            self._problems[recording_id] = {"reason": "failed", "problem": progress.problem}
        details = {
            "recording": recording_id,
            "reason": progress.reason,
            "problem": progress.problem,
            "frames": progress.frames,
            "dropped_frames": progress.dropped_frames,
        }
        self._tell("recording-stopped", details)

    def _recorder_of(self, recording_id: str) -> Recorder | None:
        """Return the recorder of a recording that has not ended."""
        recorder = self._active
        if recorder is None or recorder.header.recording_id != recording_id:
            return None
        return None if recorder.progress.finished else recorder

    def _files(self) -> list[Path]:
        try:
            entries = list(self._directory.iterdir())
        except OSError:
            return []
        suffixes = (layout.SUFFIX, layout.PART_SUFFIX)
        return [
            path
            for path in entries
            if path.name.endswith(suffixes)
            and _ID.fullmatch(_id_of(path))
            and path.is_file()
            and not path.is_symlink()
        ]

    def _path(self, recording_id: str) -> Path | None:
        """Return the file of a recording, found among those that are there."""
        found = [path for path in self._files() if _id_of(path) == recording_id]
        return min(found, key=lambda path: len(path.name), default=None)  # the whole one first

    def _described(self, recording_id: str) -> dict[str, Any] | None:
        recorder = self._recorder_of(recording_id)
        if recorder is not None:
            return self._describe_active(recorder)
        path = self._path(recording_id)
        if path is None:
            return None
        try:
            status = path.stat()
        except FileNotFoundError:  # deleted, or recovered, this moment
            return None
        stamp = status.st_mtime_ns, status.st_size
        known = self._known.get(path)
        if known is None or known[0] != stamp:
            known = self._known[path] = stamp, _read(path)
        document = known[1] | {"size_bytes": status.st_size}
        if recording_id in self._recovering:
            document["state"] = "recovering"
        if recording_id in self._problems:
            document |= self._problems[recording_id]
        return document

    def _describe_active(self, recorder: Recorder) -> dict[str, Any]:
        progress = recorder.progress
        document = _of_header(recorder.header) | {
            "state": "recording" if progress.reason is None else "finishing",
            "frames": progress.frames,
            "dropped_frames": progress.dropped_frames,
            "duration_s": progress.duration_s,
            "size_bytes": progress.size_bytes,
            "reason": progress.reason,
            "problem": progress.problem,
            "limits": asdict(recorder.limits),
        }
        part = self._directory / (recorder.header.recording_id + layout.PART_SUFFIX)
        try:
            with Recording(part) as recording:
                document["annotations"] = recording.annotations
        except (NotARecording, OSError):  # it was finished this moment
            document["annotations"] = {}
        return document

    def _recover(self, parts: list[Path]) -> None:
        for part in parts:
            recovery.recover_all(self._directory, parts=[part], stop=self._closing.is_set)
            self._recovering -= {_id_of(part)}

    def _is_ours_alone(self) -> bool:
        """Whether no other service records here; else what is unfinished may be alive."""
        try:
            descriptor = os.open(self._directory, os.O_RDONLY)
        except OSError as error:
            _log.warning("recordings cannot be read: %s", error)
            return False
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            _log.info("another service records in %s; recovery is left to it", self._directory)
            return False
        finally:
            os.close(descriptor)
        return True

    def _share(self) -> None:
        """Keep others from taking what is written here for abandoned."""
        if self._lock is None:
            try:
                self._lock = os.open(self._directory, os.O_RDONLY)
                fcntl.flock(self._lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except OSError as error:  # some file systems know no locks
                _log.info("%s cannot be locked: %s", self._directory, error)


def _id_of(path: Path) -> str:
    return path.name.removesuffix(".part").removesuffix(layout.SUFFIX)


def _of_header(header: Header) -> dict[str, Any]:
    return {
        "id": header.recording_id,
        "name": header.name,
        "started_s": header.started_s,
        "sequence": header.applied.to_document(),
        "camera": {
            "model": header.capabilities.model,
            "serial": header.capabilities.serial,
            **header.camera,
        },
        "calibration": dict(header.calibration),
        "width": header.capabilities.width,
        "height": header.capabilities.height,
        "versions": dict(header.versions),
        "limits": None,
        "problem": None,
    }


def _read(path: Path) -> dict[str, Any]:
    """Describe a file."""
    unfinished = path.name.endswith(".part")
    try:
        with Recording(path) as recording:
            end, host_time_s = recording.end, recording.series("host_time_s")
            between_s = float(host_time_s[-1] - host_time_s[0]) if len(host_time_s) else 0.0
            return _of_header(recording.header) | {
                "id": _id_of(path),
                "state": "interrupted" if unfinished else "complete",
                "frames": recording.frames,
                "dropped_frames": int(recording.series("dropped_frames").sum()),
                "duration_s": float(end.get("duration_s", between_s)),
                "reason": end.get("reason", "interrupted"),
                "problem": end.get("problem"),
                "annotations": recording.annotations,
            }
    except (NotARecording, OSError) as error:
        return {"id": _id_of(path), "state": "damaged", "problem": str(error)} | _NOTHING


_NOTHING: Final[dict[str, Any]] = {
    "name": "",
    "started_s": None,
    "frames": 0,
    "dropped_frames": 0,
    "duration_s": 0.0,
    "reason": None,
    "annotations": {},
    "sequence": None,
    "camera": {},
    "calibration": {},
    "width": None,
    "height": None,
    "versions": {},
    "limits": None,
}


def _check(annotations: Mapping[str, Any]) -> None:
    """Refuse annotations that have no place in the file, or no JSON."""
    try:
        size = len(layout.encoded(annotations))
        json.dumps(annotations, ensure_ascii=False).encode()
    except (ValueError, RecursionError):
        raise Problem(
            kinds.INVALID_REQUEST,
            "The annotations hold something that JSON has not: NaN, or half a character.",
            field="annotations",
            limit="JSON",
        ) from None
    if size > layout.ANNOTATIONS_BYTES:
        raise Problem(
            kinds.INVALID_REQUEST,
            f"The annotations take {size} bytes as JSON.",
            field="annotations",
            value=size,
            limit=f"at most {layout.ANNOTATIONS_BYTES} bytes",
        )


def _least(wanted: Any, allowed: Any) -> Any:
    given = [each for each in (wanted, allowed) if each is not None]
    return min(given, default=None)


def _unknown(recording_id: str) -> Problem:
    shown = recording_id[:64]
    return Problem(
        kinds.UNKNOWN_RECORDING, f"There is no recording {shown!r}.", field="recording", value=shown
    )


def _unfinished(recording_id: str) -> Problem:
    return Problem(
        kinds.RECORDING_UNFINISHED, f"{recording_id} is not finished.", recording=recording_id
    )


def _not_stored(place: Path, error: OSError) -> Problem:
    _log.warning("recording into %s failed: %s", place, error)
    return Problem(kinds.RECORDING_NOT_STORED, f"The disk does not take it: {in_words(error)}.")
