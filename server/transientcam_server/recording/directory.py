"""The directory that recordings are kept in: what is there, what room there is, and whose it is."""

import fcntl
import logging
import os
import re
import shutil
from pathlib import Path
from typing import Final

from transientcam_server.recording import layout

_log = logging.getLogger(__name__)
_ID: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,127}")


class Directory:
    """Files of recordings, found by their ids; an id that a client sends never becomes a path."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock: int | None = None

    def make(self) -> None:
        """Make it, and keep others from taking what is written in it for abandoned.

        Raises
        ------
        OSError
            If it cannot be made.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        self.share()

    def free_bytes(self) -> int:
        """Return what its disk has left.

        Raises
        ------
        OSError
            If it is not there yet.
        """
        return shutil.disk_usage(self.path).free

    def new(self, recording_id: str) -> Path:
        """Return where a recording is to be written."""
        return self.path / (recording_id + layout.SUFFIX)

    def files(self) -> list[Path]:
        """Return the files that are recordings by their names, whole or not."""
        try:
            entries = list(self.path.iterdir())
        except OSError:
            return []
        suffixes = (layout.SUFFIX, layout.PART_SUFFIX)
        return [
            path
            for path in entries
            if path.name.endswith(suffixes)
            and _ID.fullmatch(id_of(path))
            and path.is_file()
            and not path.is_symlink()
        ]

    def ids(self) -> set[str]:
        """Return the ids of all recordings."""
        return {id_of(path) for path in self.files()}

    def find(self, recording_id: str) -> Path | None:
        """Return the file of a recording, found among those that are there."""
        found = [path for path in self.files() if id_of(path) == recording_id]
        return min(found, key=lambda path: len(path.name), default=None)  # the whole one first

    def is_ours_alone(self) -> bool:
        """Return whether no other service records here; else what is unfinished may be alive."""
        try:
            descriptor = os.open(self.path, os.O_RDONLY)
        except OSError as error:
            _log.warning("recordings cannot be read: %s", error)
            return False
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            _log.info("another service records in %s; recovery is left to it", self.path)
            return False
        finally:
            os.close(descriptor)
        return True

    def share(self) -> None:
        """Keep others from taking what is written here for abandoned."""
        if self._lock is None:
            try:
                self._lock = os.open(self.path, os.O_RDONLY)
                fcntl.flock(self._lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except OSError as error:  # some file systems know no locks
                _log.info("%s cannot be locked: %s", self.path, error)

    def close(self) -> None:
        """Let others have it."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def id_of(path: Path) -> str:
    """Return the id of the recording in a file."""
    return path.name.removesuffix(".part").removesuffix(layout.SUFFIX)
