"""Writes one recording: ``<file>.part`` while it grows, ``<file>`` once it is finished.

It gets the first of these names when HDF5 has it open to write. HDF5 refuses that of a file that it
has open to read, as when another thread lists the recordings meanwhile.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from transientcam_driver import RawFrame
from transientcam_server.recording import _layout as layout, _lock as lock, _swmr as swmr
from transientcam_server.recording._layout import Header
from transientcam_server.recording._readers import READERS
from transientcam_server.recording._seal import seal


class RecordingWriter:
    """An open recording; all methods on one thread.

    ``path``: of the finished recording; must not exist.
    Raises OSError if the file cannot be made.
    """

    def __init__(
        self, path: Path, header: Header, *, annotations: Mapping[str, Any] | None = None
    ) -> None:
        self.path = path
        self.part = path.with_name(path.name + ".part")
        empty = layout.image(header, annotations or {})
        made = path.with_suffix(layout.SCRATCH_SUFFIX)
        self._lock = lock.create(made)
        try:
            for each in (path, self.part):
                if each.exists():
                    raise FileExistsError(17, "there is a recording already", str(each))
            _write(self._lock.descriptor, empty)
            self._rows = swmr.Appender(made, ["raw"], [*layout.SERIES, *layout.NUMBERS], seal=seal)
            made = made.rename(self.part)
            swmr.synchronise(path.parent)
        except BaseException:
            made.unlink(missing_ok=True)
            self._lock.close()
            raise

    @property
    def is_there(self) -> bool:
        """Whether the file still has its name; it may have been removed meanwhile."""
        return self._lock.is_of(self.part)

    @property
    def frames(self) -> int:
        """How many frames are written."""
        return self._rows.rows

    @property
    def synchronised_frames(self) -> int:
        """How many frames are on the disk, which a power cut does not take back."""
        return self._rows.synchronised_rows

    @property
    def bytes_written(self) -> int:
        """Size of the file."""
        return self._rows.size_bytes

    def append(self, raw: RawFrame, *, dropped_frames: int = 0) -> None:
        """Write a frame; once this returns, the death of this process does not take it back.

        Raises OSError if it cannot be written; the frames before are safe.
        """
        row = layout.row(raw, dropped_frames=dropped_frames)
        self._rows.append({"raw": raw.images}, row | {layout.ROW_AXIS: self.frames + 1})

    def synchronise(self, now_s: float) -> None:
        """Bring the file to the disk once a second, which bounds what a power cut takes."""
        self._rows.synchronise(now_s)

    def annotate(self, annotations: Mapping[str, Any]) -> None:
        """Replace the annotations."""
        self._rows.overwrite("annotations", layout.encoded(annotations))

    def close(self, end: Mapping[str, Any]) -> None:
        """Finish the file and give it its name.

        Raises OSError if it cannot be finished; ``.part`` stays, and recovery makes a recording of
        it.
        """
        # the lock is held also while it gets its name
        with self._lock, READERS.ending(self._lock.descriptor):
            try:
                self._rows.overwrite("end", layout.encoded(end))
            finally:
                self._rows.close()
            self.part.rename(self.path)
            swmr.synchronise(self.path.parent)


def annotate(path: Path, annotations: Mapping[str, Any]) -> None:
    """Replace the annotations of a finished recording, in place.

    HDF5 is not used: a file that it has open for writing is lost if this process dies meanwhile.
    The annotations have a fixed place and size, so that their bytes can be replaced without it;
    the worst is then that the annotations themselves are torn.
    Raises OSError if the file cannot be written; ValueError if they are too long.
    """
    data = layout.encoded(annotations)
    if len(data) > layout.ANNOTATIONS_BYTES:
        raise ValueError(f"annotations of {len(data)} bytes")
    with swmr.open_file(path, "r") as file:
        offset = file["annotations"].id.get_offset()
    if offset is None:
        raise OSError(95, "its annotations have no fixed place", str(path))
    descriptor = os.open(path, os.O_WRONLY)
    try:
        os.pwrite(descriptor, data.ljust(layout.ANNOTATIONS_BYTES, b"\0"), offset)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _write(descriptor: int, data: bytes) -> None:
    """Write all of ``data``, to the disk."""
    left = memoryview(data)
    while left:
        left = left[os.write(descriptor, left) :]
    os.fsync(descriptor)
