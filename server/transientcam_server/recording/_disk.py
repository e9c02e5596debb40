"""A file that HDF5 writes, and that never fails it, whatever the disk does.

libhdf5 keeps what it could not write, and crashes when that is closed or the process ends (issues
914 and 2160 of h5py). So it hears of no error: the first one is kept, and what would be written
after it goes to memory, where HDF5 finds it again while it closes the file. On the disk stays what
was there before the error.
"""

import atexit
import ctypes
import os
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import h5py
from h5py._objects import phil

from transientcam.remote_file import SizedFile

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer, WriteableBuffer

LIBVER: Final = ("v110", "v110")
_FLAGS_AT: Final = 11
_OPEN_TO_WRITE: Final = 1
_OPEN_TO_APPEND: Final = 4
_SUPERBLOCK_BYTES: Final = 48
_CHECKSUM_BYTES: Final = 4
_MODES: Final = {"r+": 0, "w": os.O_CREAT | os.O_TRUNC, "x": os.O_CREAT | os.O_EXCL}
_OPEN: Final["weakref.WeakSet[DiskFile]"] = weakref.WeakSet()
# exported by libhdf5, but not by h5py, which knows where the library is
_checksum = ctypes.CDLL(h5py.h5p.__file__).H5_checksum_metadata
_checksum.argtypes = ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint32
_checksum.restype = ctypes.c_uint32


class DiskFile(SizedFile):
    """A file for h5py to write.

    ``mode``: ``r+``, ``w`` or ``x``, as h5py has them.
    ``error``: the first that occurred; None while there is none.
    ``size_bytes``: of the file.
    """

    def __init__(self, path: Path, mode: str) -> None:
        self._descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | _MODES[mode], 0o666)
        self.error: BaseException | None = None
        self.size_bytes = os.fstat(self._descriptor).st_size
        self._unwritten: list[tuple[int, bytes]] = []
        _OPEN.add(self)

    def require_written(self) -> None:
        """Raise the first error, if there was one."""
        if self.error is not None:
            raise self.error

    def synchronise(self) -> None:
        """Bring the file to the disk.

        Raises OSError if that fails, or a write did before. It is never tried again: what the
        system then says is no longer of these bytes.
        """
        self.require_written()
        try:
            os.fsync(self._descriptor)
        except BaseException as error:
            self.error = error
            raise

    # -- called by HDF5 ------------------------------------------------------------------------

    def writable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: "WriteableBuffer", /) -> int:
        """Fill a buffer as far as the file goes; return how many bytes that were."""
        into = memoryview(buffer).cast("B")
        begin, end = self._place, min(self._place + len(into), self.size_bytes)
        into[: max(0, end - begin)] = bytes(max(0, end - begin))
        try:
            data = os.pread(self._descriptor, max(0, end - begin), begin)
            into[: len(data)] = data
        except BaseException as error:
            self.error = self.error or error
        for at, data in self._unwritten:
            first, last = max(at, begin), min(at + len(data), end)
            if first < last:
                into[first - begin : last - begin] = data[first - at : last - at]
        self._place = max(begin, end)
        return max(0, end - begin)

    def write(self, data: "ReadableBuffer", /) -> int:
        """Write bytes, or keep them after an error; return how many they are."""
        piece = _marked(bytes(data)) if self._place == 0 else memoryview(data).cast("B")
        size = len(piece)
        if self.error is None:
            try:
                self._write(piece)
            except BaseException as error:  # an interruption, too, would reach HDF5
                self.error = error
        if self.error is not None:
            self._unwritten.append((self._place, bytes(piece)))
        self._place += size
        self.size_bytes = max(self.size_bytes, self._place)
        return size

    def truncate(self, size: int | None = None) -> int:
        """Cut the file, or make it longer."""
        size = self._place if size is None else size
        if self.error is None and size != self.size_bytes:
            try:
                os.ftruncate(self._descriptor, size)
            except BaseException as error:
                self.error = error
        self.size_bytes = size
        return size

    def close(self) -> None:
        """Close the file."""
        if not self.closed:
            os.close(self._descriptor)
        super().close()

    def _write(self, piece: bytes | memoryview) -> None:
        at, left = self._place, memoryview(piece)
        while left:
            written = os.pwrite(self._descriptor, left, at)
            if not written:
                raise OSError(5, os.strerror(5))
            at, left = at + written, left[written:]


def open_disk(path: Path, mode: str) -> tuple[Any, DiskFile]:
    """Open an HDF5 file to write; return h5py's file and the one that it writes.

    The first is closed before the second.
    """
    disk = DiskFile(path, mode)
    try:
        file = h5py.File(disk, "r+" if mode == "r+" else "w", libver=LIBVER)
    except BaseException:
        disk.close()
        raise
    return file, disk


@contextmanager
def open_to_write(path: Path, mode: str) -> Iterator[tuple[Any, DiskFile]]:
    """Open an HDF5 file to write, and bring it to the disk in the end.

    Whoever writes much asks `DiskFile.require_written` from time to time.
    Raises OSError if it cannot be opened or written.
    """
    file, disk = open_disk(path, mode)
    with disk:
        with file:
            yield file, disk
        disk.synchronise()


@atexit.register
def _close_all() -> None:
    """Close what is open while there is still an interpreter, which HDF5 does not look for."""
    with phil:
        for disk in _OPEN:
            disk.error = disk.error or InterruptedError(4, "the process ends")
        for file in h5py.h5f.get_obj_ids(h5py.h5f.OBJ_ALL, h5py.h5f.OBJ_FILE):
            h5py.File(file).close()


def _marked(data: bytes) -> bytes:
    """Return a superblock that says that the file is open to write where it is so in SWMR mode.

    Readers require both marks; HDF5 sets the other only with drivers that lock.
    """
    if len(data) != _SUPERBLOCK_BYTES or not data[_FLAGS_AT] & _OPEN_TO_APPEND:
        return data
    flags = bytes([data[_FLAGS_AT] | _OPEN_TO_WRITE])
    body = data[:_FLAGS_AT] + flags + data[_FLAGS_AT + 1 : -_CHECKSUM_BYTES]
    checksum: int = _checksum(body, len(body), 0)
    return body + checksum.to_bytes(_CHECKSUM_BYTES, "little")
