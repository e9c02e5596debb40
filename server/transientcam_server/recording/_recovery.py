"""Recovers recordings whose writer died: killed, or by a power cut."""

import logging
import shutil
from collections.abc import Callable
from pathlib import Path

from transientcam_server.errors import DamagedFrame, NotARecording, RecordingInUse
from transientcam_server.recording import _layout as layout, _lock as lock, _swmr as swmr
from transientcam_server.recording._heaps import require_sound_heaps
from transientcam_server.recording._reader import Recording
from transientcam_server.recording._salvage import rebuild, salvage
from transientcam_server.recording._seal import sealed_frames

_log = logging.getLogger("transientcam_server.recording.recovery")


def recover(part: Path) -> Path:
    """Turn an unfinished recording into a finished one and return its path.

    Frames are kept up to the first that is torn; a writer's death tears at most the last, which
    was not acknowledged. Whenever this is interrupted, there is one file to begin with anew.
    Raises NotARecording if nothing can be read of it; it stays where it is. Raises RecordingInUse
    if it is being written, or another program recovers it. Raises OSError if the copy cannot be
    written; it stays where it is.
    """
    path = part.with_name(part.name.removesuffix(".part"))
    if path == part:
        raise NotARecording(str(part), "an unfinished recording ends in .part")
    with lock.take(part):
        if path.exists():
            _require_nothing_more(part, path)
            part.unlink()
        else:
            copy = _copied(part)
            with lock.take(copy):
                # first the place of the original, then the name: never one beside the other
                copy.replace(part)
                part.rename(path)
        swmr.synchronise(path.parent)
    return path


def recover_all(parts: list[Path], *, stop: Callable[[], bool] = lambda: False) -> list[Path]:
    """Recover unfinished recordings; one that fails is logged and stays."""
    recovered = []
    for part in parts:
        if stop():
            break
        try:
            recovered.append(recover(part))
        except (NotARecording, RecordingInUse, OSError) as error:
            _log.warning("%s could not be recovered: %s", part, error)
        else:
            _log.info("recovered %s", recovered[-1])
    return recovered


def unfinished(directory: Path) -> list[Path]:
    """Return the unfinished recordings of a directory that no process writes.

    What a writer or a recovery left half made is deleted where the recording itself is gone.
    """
    for scratch in directory.glob("*" + layout.SCRATCH_SUFFIX):
        id_ = scratch.name.removesuffix(layout.SCRATCH_SUFFIX)
        part = scratch.with_name(id_ + layout.PART_SUFFIX)
        if not part.exists() and not lock.is_taken(scratch):
            scratch.unlink(missing_ok=True)
    parts = sorted(each for each in directory.glob("*" + layout.PART_SUFFIX) if each.is_file())
    return [part for part in parts if not lock.is_taken(part)]


def _copied(part: Path) -> Path:
    """Copy what is whole of an unfinished recording; the copy is on the disk."""
    copy = part.with_name(part.name.removesuffix(layout.PART_SUFFIX) + layout.SCRATCH_SUFFIX)
    try:
        needed, free = part.stat().st_size, shutil.disk_usage(part.parent).free
        if needed > free:
            reason = f"{needed} bytes are needed to recover it, {free} are free"
            raise OSError(28, reason, str(part))
        with part.open("rb") as stream:
            require_sound_heaps(stream)
        sealed = sealed_frames(part)
        frames = len(sealed) if sealed else _salvaged(part, copy)
        if sealed:
            rebuild(part, copy, sealed)
        with Recording(copy) as made:
            if made.frames != frames:
                raise NotARecording(str(part), "its copy lacks frames")
    except BaseException as error:
        copy.unlink(missing_ok=True)
        if isinstance(error, OSError | NotARecording) or not isinstance(error, Exception):
            raise
        raise NotARecording(str(part), str(error)) from error  # h5py's, of a damaged one
    return copy


def _salvaged(part: Path, copy: Path) -> int:
    """Copy a recording that has no frame yet, or is of a version without seals."""
    try:
        with Recording(part) as recording:
            frames = _whole_frames(recording)
    except NotARecording:  # torn before its first frame was on the disk
        rebuild(part, copy, [])
        return 0
    with swmr.open_unfinished(part) as source:
        salvage(source, copy, frames, row_axis=layout.ROW_AXIS)
    return frames


def _whole_frames(recording: Recording) -> int:
    """Return how many frames from the first on are as they were written."""
    for index in range(recording.frames):
        try:
            recording.frame(index)
        except DamagedFrame as error:
            _log.warning("%s", error)
            return index
    return recording.frames


def _require_nothing_more(part: Path, path: Path) -> None:
    """Raise FileExistsError unless a finished recording has every frame of an unfinished one."""
    try:
        with Recording(path) as whole, Recording(part) as rest:
            frames = _whole_frames(rest)
            checksums = [each.series("crc32")[:frames].tolist() for each in (whole, rest)]
            if checksums[0] == checksums[1]:
                return
    except NotARecording as error:
        _log.warning("%s", error)
    raise FileExistsError(17, "there is a recording already", str(path))
