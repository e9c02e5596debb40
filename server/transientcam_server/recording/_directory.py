"""The directory of the recordings: its files and its free space."""

import contextlib
import re
import shutil
from pathlib import Path
from typing import Final

from transientcam_server.recording import _layout as layout, _lock as lock, _swmr as swmr

_ID: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,127}")


class Directory:
    """Files of recordings, found by their ids; an id that a client sends never becomes a path."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def make(self) -> None:
        """Create it. Raises OSError if it cannot be created."""
        self.path.mkdir(parents=True, exist_ok=True)

    def free_bytes(self) -> int:
        """Return the free space of its disk. Raises OSError if it does not exist yet."""
        return shutil.disk_usage(self.path).free

    def require_free(self, least_bytes: int, *, more_bytes: int = 0) -> None:
        """Refuse to write so many bytes more where less than ``least_bytes`` would stay free.

        Raises OSError then, and where it does not exist yet.
        """
        if (free := self.free_bytes()) - more_bytes < least_bytes:
            more = f" of which {more_bytes} are wanted," * (more_bytes > 0)
            raise OSError(28, f"{free} bytes are free,{more} {least_bytes} have to stay so")

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
        named = {path for path in entries if path.name.endswith(suffixes) and is_id(id_of(path))}
        found = {path for path in named if _is_plain(path)}
        # what was unfinished when it was listed may have been finished, and renamed, since
        finished = {self.new(id_of(path)) for path in named - found}
        return [*found, *(path for path in finished - found if _is_plain(path))]

    def ids(self) -> set[str]:
        """Return the ids of all recordings."""
        return {id_of(path) for path in self.files()}

    def find(self, recording_id: str) -> Path | None:
        """Return the file of a recording, found among those that exist."""
        found = [path for path in self.files() if id_of(path) == recording_id]
        return min(found, key=lambda path: len(path.name), default=None)  # the finished one first

    def remove(self, recording_id: str) -> None:
        """Delete all files of a recording, finished or not, for good.

        Raises RecordingInUse if it is being written or recovered; OSError if one cannot be deleted.
        """
        path = self.new(recording_id)
        part = path.with_name(path.name + ".part")
        with contextlib.ExitStack() as held:
            with contextlib.suppress(FileNotFoundError):
                held.enter_context(lock.take(part))
            # the finished one last: of an unfinished one the next start would make it anew
            for each in (part, path.with_suffix(layout.SCRATCH_SUFFIX), path):
                each.unlink(missing_ok=True)
            swmr.synchronise(self.path)


def is_id(text: str) -> bool:
    """Return whether a recording may have this id."""
    return bool(_ID.fullmatch(text))


def _is_plain(path: Path) -> bool:
    """Return whether it is a file of its own, and no link to one."""
    return path.is_file() and not path.is_symlink()


def id_of(path: Path) -> str:
    """Return the id of the recording in a file."""
    return path.name.removesuffix(".part").removesuffix(layout.SUFFIX)
