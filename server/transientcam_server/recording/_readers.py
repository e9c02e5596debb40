"""Readers in this process of files that it writes.

HDF5 has one state of a file for all in a process that have it open. Where the writer closes it
while another reads it, the file stays marked as one that is written until the last one closes it,
and nobody can open it meanwhile.
"""

import os
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, TypeAlias

_File: TypeAlias = tuple[int, int]
PATIENCE_S: Final = 10.0
"""How long a writer waits: a frame is read in well under a second."""


class Readers:
    """Has the writer of a file close it when no reader has it open; thread-safe."""

    def __init__(self, *, patience_s: float = PATIENCE_S) -> None:
        self._patience_s = patience_s
        self._changed = threading.Condition()
        self._open: Counter[_File] = Counter()
        self._ending: set[_File] = set()

    @contextmanager
    def reading(self, path: Path) -> Iterator[None]:
        """Open and close a file inside the block; it begins when no writer is closing the file.

        Raises OSError if there is no such file.
        """
        file = _identity(path)
        with self._changed:
            self._changed.wait_for(lambda: file not in self._ending)
            self._open[file] += 1
        try:
            yield
        finally:
            with self._changed:
                self._open[file] -= 1
                self._open += Counter()  # drops what is 0
                self._changed.notify_all()

    @contextmanager
    def ending(self, descriptor: int) -> Iterator[None]:
        """Close a file that was written, and rename it, inside the block.

        It begins when no reader has the file open, or after `PATIENCE_S`.
        """
        file = _identity(descriptor)
        with self._changed:
            self._ending.add(file)
            self._changed.wait_for(lambda: not self._open[file], self._patience_s)
        try:
            yield
        finally:
            with self._changed:
                self._ending.discard(file)
                self._changed.notify_all()


READERS: Final = Readers()
"""Those of this process."""


def _identity(file: Path | int) -> _File:
    status = os.stat(file)  # noqa: PTH116  (a path has no stat of a descriptor)
    return status.st_dev, status.st_ino
