"""Documents that describe a recording: one that runs, or a file."""

import os
from collections.abc import Set
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from transientcam_server.errors import fenced
from transientcam_server.recording import _lock as lock
from transientcam_server.recording._directory import id_of
from transientcam_server.recording._layout import Header
from transientcam_server.recording._reader import Recording
from transientcam_server.recording._recorder import Recorder

_UNREADABLE: Final[dict[str, Any]] = {
    "name": "", "started_s": None, "frames": 0, "synced_frames": None, "dropped_frames": 0,
    "duration_s": 0.0, "reason": None, "annotations": {}, "sequence": None, "camera": {},
    "calibration": {}, "width": None, "height": None, "versions": {}, "limits": None,
}  # fmt: skip
"""The fields of a file that cannot be read."""


class Descriptions:
    """Describes files; a file is read again only when it has changed."""

    def __init__(self) -> None:
        self._known: dict[Path, tuple[tuple[int, int], dict[str, Any]]] = {}

    def __len__(self) -> int:
        """Return how many files are remembered."""
        return len(self._known)

    def of_file(self, path: Path) -> dict[str, Any] | None:
        """Describe a file; None where it no longer exists."""
        try:
            status = path.stat()
        except FileNotFoundError:  # deleted, or recovered, this moment
            return None
        document = self._of_content(path, status) | {"size_bytes": status.st_size}
        if document["state"] == "damaged" and not path.exists():  # while it was read
            return None
        if document["state"] == "interrupted" and lock.is_taken(path):
            document["state"] = "recording"  # by another service
        return document

    def keep(self, ids: Set[str]) -> None:
        """Forget all but these recordings."""
        for path in list(self._known):  # other threads describe meanwhile
            if id_of(path) not in ids:
                self._known.pop(path, None)

    def _of_content(self, path: Path, status: os.stat_result) -> dict[str, Any]:
        stamp = status.st_mtime_ns, status.st_size
        known = self._known.get(path)
        if known is None or known[0] != stamp:
            known = self._known[path] = stamp, _read(path)
        return known[1]


def of_recorder(recorder: Recorder) -> dict[str, Any]:
    """Describe a recording that runs."""
    progress = recorder.progress
    return _of_header(recorder.header) | {
        "state": "recording" if progress.reason is None else "finishing",
        "frames": progress.frames,
        "synced_frames": progress.synchronised_frames,
        "dropped_frames": progress.dropped_frames,
        "duration_s": progress.duration_s,
        "size_bytes": progress.size_bytes,
        "reason": progress.reason,
        "problem": progress.problem,
        "limits": asdict(recorder.limits),
        "annotations": recorder.annotations,
    }


def of_removed(recorder: Recorder) -> dict[str, Any]:
    """Describe a recording that failed because its file was removed."""
    progress = recorder.progress
    return (
        _UNREADABLE
        | _of_header(recorder.header)
        | {
            "state": "damaged",
            "size_bytes": 0,
            "dropped_frames": progress.dropped_frames,
            "duration_s": progress.duration_s,
            "reason": progress.reason,
            "problem": progress.problem,
        }
    )


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
    damaged = {"id": id_of(path), "state": "damaged"} | _UNREADABLE
    return fenced(_of_recording, path, lambda reason: damaged | {"problem": reason})


def _of_recording(path: Path) -> dict[str, Any]:
    unfinished = path.name.endswith(".part")
    with Recording(path) as recording:
        end, captured_s = recording.end, recording.captured_unix_s
        between_s = float(captured_s[-1] - captured_s[0]) if len(captured_s) else 0.0
        return _of_header(recording.header) | {
            "id": id_of(path),
            "state": "interrupted" if unfinished else "complete",
            "frames": recording.frames,
            # what its writer brought to the disk of an unfinished one, nobody else knows
            "synced_frames": None if unfinished else recording.frames,
            "dropped_frames": int(recording.series("dropped_frames").sum()),
            "duration_s": float(end.get("duration_s", between_s)),
            "reason": end.get("reason", "interrupted"),
            "problem": end.get("problem"),
            "annotations": recording.annotations,
        }
