"""The lock on a recording that is being written.

Its writer holds a shared flock of the unfinished file, which the kernel releases with the writer,
however that ends. What recovers or deletes such a file asks for the exclusive one. The
writer's is shared because other programs' HDF5 takes a shared one to read. Linux passes flock on
to an NFS server, so that it holds between machines too, unless the directory is mounted with
``nolock`` or ``local_lock``. Where the file system has no locks, only one service may use it.
"""

import fcntl
import logging
import os
from pathlib import Path
from typing import Self

from transientcam_server.errors import RecordingInUse

_log = logging.getLogger("transientcam_server.recording.lock")


class Lock:
    """A lock that is held until `close`, or the death of the process."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor

    def is_of(self, path: Path) -> bool:
        """Return whether the file that is locked still has this name."""
        try:
            return os.path.samestat(os.fstat(self.descriptor), path.stat())
        except OSError:
            return False

    def close(self) -> None:
        """Release it."""
        os.close(self.descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def create(path: Path) -> Lock:
    """Make an empty file, locked for its writer; the descriptor can write.

    Raises OSError if it cannot be made, or is there already.
    """
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
    # another service may be looking whether this new file is in use: that is soon over
    held = _locked(descriptor, fcntl.LOCK_SH, path)
    if not held.is_of(path):
        held.close()
        raise FileNotFoundError(2, "it was deleted by another service", str(path))
    return held


def take(path: Path) -> Lock:
    """Lock an unfinished file that no process writes.

    Raises RecordingInUse if it is being written, recovered or deleted; OSError if there is no such
    file, or it may not be written.
    """
    held = _locked(os.open(path, os.O_RDWR | os.O_CLOEXEC), fcntl.LOCK_EX | fcntl.LOCK_NB, path)
    if not held.is_of(path):  # it was renamed or deleted in between
        held.close()
        raise FileNotFoundError(2, os.strerror(2), str(path))
    return held


def is_taken(path: Path) -> bool:
    """Return whether a file is being written, recovered or deleted."""
    try:
        take(path).close()
    except RecordingInUse:
        return True
    except OSError:
        return False
    return False


def _locked(descriptor: int, operation: int, path: Path) -> Lock:
    try:
        fcntl.flock(descriptor, operation)
    except BlockingIOError:
        os.close(descriptor)
        raise RecordingInUse(str(path)) from None
    except OSError as error:
        _log.warning("%s cannot be locked, so that only one service may use it: %s", path, error)
    return Lock(descriptor)
