"""Recordings that are sent here: another process reads them, and writes them anew.

libhdf5 is a large parser in C. A file that it does not expect may make it crash, wait for ever or
allocate all memory, and none of that may reach the process that controls the light. That one only
opens what the other has written, with this program's own writer. The other has the same rights, so
that it is no sandbox for code.
"""

import contextlib
import errno
import os
import resource
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from transientcam_compiled import ChildProcess, ProcessEnded, Tell
from transientcam_server.errors import DamagedFrame, NotARecording, Problem, kinds
from transientcam_server.recording import _layout as layout, _lock as lock, _swmr as swmr
from transientcam_server.recording._directory import Directory, is_id
from transientcam_server.recording._problems import not_stored
from transientcam_server.recording._reader import Recording
from transientcam_server.recording._salvage import write_whole
from transientcam_server.settings import RecordingSettings

_START_S: Final = 120.0
"""For a process to start, also on a laden machine."""
_NICE: Final = 5
"""Frames go before it, and a user waits for it."""
_SLOWEST_BYTES_S: Final = 1e6
_REASON_CHARACTERS: Final = 300


class Upload:
    """What is sent, until `close`; its methods wait for the disk.

    Both of its files are scratch: where this process ends, the next start deletes them.
    ``fresh_id``: of the recording, where its own is taken.
    Raises Problem ``too-large``, ``recording-not-stored``.
    """

    def __init__(
        self, directory: Directory, settings: RecordingSettings, fresh_id: str, announced_bytes: int
    ) -> None:
        self._directory, self._settings, self._fresh_id = directory, settings, fresh_id
        if announced_bytes > settings.max_upload_bytes:
            raise self._too_large(f"The body has {announced_bytes} bytes.")
        self._using = threading.Lock()
        self._size_bytes = 0
        self._open = contextlib.ExitStack()
        try:
            directory.make()
            directory.require_free(settings.min_free_bytes, more_bytes=announced_bytes)
            self._sent, self._file = self._scratch("sent")
            self._anew, _ = self._scratch("anew")
        except OSError as error:
            self._open.close()
            raise not_stored(directory.path, error) from error

    def write(self, piece: bytes) -> None:
        """Take the next bytes. Raises Problem ``recording-not-stored``."""
        try:
            with self._using:
                self._directory.require_free(self._settings.min_free_bytes, more_bytes=len(piece))
                self._file.write(piece)
                self._file.flush()
                self._size_bytes += len(piece)
        except OSError as error:
            raise not_stored(self._directory.path, error) from error

    def take_in(self, go_on: Callable[[], None]) -> str:
        """Make a recording of it and return its id.

        ``go_on``: called several times a second; what it raises ends it.
        Raises Problem ``invalid-recording``, ``too-large``, ``recording-not-stored``.
        """
        limit_s = _START_S + self._size_bytes / _SLOWEST_BYTES_S
        ends_s = time.monotonic() + limit_s
        most, least = self._settings.max_upload_bytes, self._settings.min_free_bytes

        def ask() -> None:
            go_on()
            if time.monotonic() > ends_s:
                raise _invalid(f"it was not read within {limit_s:.0f} s")

        child = ChildProcess(nice=_NICE)
        with self._using:
            try:
                files = self._sent, self._anew
                found = child.call(rewrite, *files, self._fresh_id, most, least, ask=ask)
                is_new = self._anew.stat().st_size > 0
                if not is_id(found) or (self._directory.find(found) is None) != is_new:
                    raise OSError(errno.EEXIST, "another recording has its id")
                if is_new:
                    self._anew.rename(self._directory.new(found))
                    swmr.synchronise(self._directory.path)
            except ValueError as error:
                raise _invalid(str(error)) from None
            except ProcessEnded:
                raise _invalid("the process that read it has ended") from None
            except MemoryError:
                raise _invalid("reading it takes too much memory") from None
            except OSError as error:
                if error.errno == errno.EFBIG:
                    raise self._too_large("Written anew it is longer.") from None
                raise not_stored(self._directory.path, error) from error
            finally:
                child.end()
        return str(found)

    def close(self) -> None:
        """Delete what is left of it."""
        with self._using, contextlib.suppress(OSError):  # what could not be written is gone
            self._open.close()

    def _scratch(self, kind: str) -> tuple[Path, Any]:
        path = self._directory.path / f"{self._fresh_id}-{kind}{layout.SCRATCH_SUFFIX}"
        held = lock.create(path)
        file = self._open.enter_context(os.fdopen(held.descriptor, "wb"))
        self._open.callback(path.unlink, missing_ok=True)
        return path, file

    def _too_large(self, detail: str) -> Problem:
        most = self._settings.max_upload_bytes
        return Problem(kinds.TOO_LARGE, f"{detail} {most} are allowed.", field="body", limit=most)


def rewrite(
    sent: Path, anew: Path, fresh_id: str, most_bytes: int, least_free_bytes: int, _: Tell
) -> str:
    """Write a recording anew, in a process of its own, and return its id.

    Nothing is written of one whose frames are here already under its id.

    Raises ValueError where it cannot be read; OSError where it cannot be written, or grows beyond
    ``most_bytes``.
    """
    with contextlib.suppress(OSError, ValueError):  # less is allowed anyway
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash is to leave nothing
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))
    directory = Directory(sent.parent)
    try:
        with Recording(sent) as recording:
            found = recording.header.recording_id
            known = directory.find(found)
            if known is not None and _has_frames_of(recording, known):
                return found
            if known is not None or not is_id(found):
                found = fresh_id
            header = replace(recording.header, recording_id=found)
            end, annotations = recording.end, recording.annotations
            for document, most in (
                (annotations, layout.ANNOTATIONS_BYTES),
                (end, layout.END_BYTES),
            ):
                if (size := len(layout.encoded(document))) > most:
                    raise ValueError(f"a text of {size} bytes has room for {most}")
            empty = layout.image(header, annotations, labels=recording.labels, end=end)
            write_whole(anew, empty, _frames(recording, directory, least_free_bytes))
    except (OSError, MemoryError):
        raise
    except Exception as error:  # h5py raises anything of a damaged file
        raise ValueError(_reason(error)[:_REASON_CHARACTERS]) from None
    return found


def _has_frames_of(recording: Recording, known: Path) -> bool:
    with contextlib.suppress(NotARecording, OSError), Recording(known) as here:
        return np.array_equal(recording.series("crc32"), here.series("crc32"))
    return False


def _frames(
    recording: Recording, directory: Directory, least_free_bytes: int
) -> Iterator[tuple[bytes, Mapping[str, Any]]]:
    dropped = recording.series("dropped_frames")
    for index, raw in enumerate(recording):
        chunk = swmr.compressed(np.ascontiguousarray(raw.images, "<u2"))
        directory.require_free(least_free_bytes, more_bytes=len(chunk))
        yield chunk, layout.row(raw, dropped_frames=int(dropped[index]))


def _reason(error: Exception) -> str:
    if isinstance(error, DamagedFrame):
        return f"frame {error.frame} is damaged: {error.reason}"
    return error.reason if isinstance(error, NotARecording) else str(error)


def _invalid(reason: str) -> Problem:
    return Problem(kinds.INVALID_RECORDING, f"It is no whole recording: {reason}.", field="body")
