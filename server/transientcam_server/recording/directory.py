"""The directory of the recordings: its files, its free space, and the lock that marks it in use."""

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
        """Create it, and lock it so that no other service recovers what is written in it.

        Raises
        ------
        OSError
            If it cannot be created.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        self.share()

    def free_bytes(self) -> int:
        """Return the free space of its disk.

        Raises
        ------
        OSError
            If it does not exist yet.
        """
        return shutil.disk_usage(self.path).free

    def new(self, recording_id: str) -> Path:
        """Return the path of a new recording."""
        return self.path / (recording_id + layout.SUFFIX)

    def files(self) -> list[Path]:
        """Return the files named like recordings, finished or not."""
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
        """Return the file of a recording, found among those that exist."""
        found = [path for path in self.files() if id_of(path) == recording_id]
        return min(found, key=lambda path: len(path.name), default=None)  # the finished one first

    def is_ours_alone(self) -> bool:
        """Return whether no other service records here; one that does may still write its files."""
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
        """Lock it, so that no other service takes a file being written for abandoned."""
        if self._lock is None:
            try:
                self._lock = os.open(self.path, os.O_RDONLY)
                fcntl.flock(self._lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except OSError as error:  # some file systems have no locks
                _log.info("%s cannot be locked: %s", self.path, error)

    def close(self) -> None:
        """Release the lock."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def id_of(path: Path) -> str:
    """Return the id of the recording in a file."""
    return path.name.removesuffix(".part").removesuffix(layout.SUFFIX)
