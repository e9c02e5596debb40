"""Recovers recordings whose writer died: killed, or by a power cut."""

import logging
import shutil
from collections.abc import Callable
from pathlib import Path

from transientcam_server.errors.exceptions import DamagedFrame, NotARecording
from transientcam_server.recording import layout, swmr
from transientcam_server.recording.reader import Recording
from transientcam_server.recording.writer import synchronise_directory

_log = logging.getLogger(__name__)


def recover(part: Path, *, target: Path | None = None) -> Path:
    """Turn an unfinished recording into a finished one, delete the former, return the path.

    Frames are kept up to the first that is torn; a writer's death tears at most the last, which
    was not acknowledged.

    Raises
    ------
    NotARecording
        If nothing can be read of it; it stays where it is.
    OSError
        If the copy cannot be written; it stays where it is.
    """
    path = target or part.with_name(part.name.removesuffix(".part"))
    if path == part:
        raise NotARecording(str(part), "an unfinished recording ends in .part")
    if path.exists():
        raise FileExistsError(17, "there is a recording already", str(path))
    scratch = path.with_name(path.name + ".recovering")
    try:
        with Recording(part) as recording:
            frames = whole_frames(recording)
        _require_room(part, path.parent)
        with swmr.open_file(part, "r", libver="latest", swmr=True) as source:
            swmr.salvage(source, scratch, frames, row_axis=layout.ROW_AXIS)
        with Recording(scratch) as copy:
            if copy.frames != frames:
                raise NotARecording(str(part), "its copy lacks frames")
        synchronise_directory(path.parent)
        scratch.rename(path)
    except RuntimeError as error:  # h5py's of a file damaged beyond this
        raise NotARecording(str(part), str(error)) from error
    finally:
        scratch.unlink(missing_ok=True)
    part.unlink()
    synchronise_directory(path.parent)
    return path


def whole_frames(recording: Recording) -> int:
    """Return how many frames from the first on are as they were written."""
    for index in range(recording.frames):
        try:
            recording.frame(index)
        except DamagedFrame as error:
            _log.warning("%s", error)
            return index
    return recording.frames


def recover_all(
    directory: Path, *, parts: list[Path] | None = None, stop: Callable[[], bool] = lambda: False
) -> list[Path]:
    """Recover every unfinished recording of a directory; one that fails is logged and stays."""
    recovered = []
    for part in unfinished(directory) if parts is None else parts:
        if stop():
            break
        try:
            recovered.append(recover(part))
        except (NotARecording, OSError) as error:
            _log.warning("%s could not be recovered: %s", part, error)
        else:
            _log.info("recovered %s", recovered[-1])
    return recovered


def unfinished(directory: Path) -> list[Path]:
    """Return the unfinished recordings of a directory."""
    return sorted(each for each in directory.glob("*" + layout.PART_SUFFIX) if each.is_file())


def _require_room(part: Path, directory: Path) -> None:
    needed, free = part.stat().st_size, shutil.disk_usage(directory).free
    if needed > free:
        raise OSError(28, f"{needed} bytes are needed to recover it, {free} are free", str(part))
