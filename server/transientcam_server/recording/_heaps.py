"""Damaged heaps of texts, in which HDF5 would look for the next object for ever.

A global heap (HDF5 File Format Specification 3.0, Sec. III.E) is a chain of objects, each of which
states its size. HDF5 follows it to its end, also where an object of the size 0 leads nowhere, as
where a sector of a disk was lost. Meanwhile nothing else in the process can use HDF5.
"""

import os
from collections.abc import Iterator
from typing import IO, TYPE_CHECKING, Final

from transientcam.remote_file import SizedFile

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

MAX_HEAP_BYTES: Final = 16 * 1024**2
"""HDF5 keeps the texts of a recording in heaps of 4 KiB, and a longer one in a heap of its own."""
_BLOCK_BYTES: Final = 4 * 1024**2
_NO_SIZE_BYTES: Final = 2**40
"""More than HDF5 can allocate: such a block is no heap, but data that begins like one."""
_BEGIN: Final = b"GCOL\1"
_HEAD_BYTES: Final = 16
"""Of a heap, and of each object in it."""
_SIZE_AT: Final = 8


class CheckedReader(SizedFile):
    """A file for h5py to read, of which it gets no damaged heap; closed with this object.

    A heap is looked at when its first bytes are read, wherever it lies; reading them raises
    ValueError if it is damaged.
    """

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self.size_bytes = stream.seek(0, os.SEEK_END)

    def readinto(self, buffer: "WriteableBuffer", /) -> int:
        """Fill a buffer as far as the file goes; return how many bytes that were.

        Raises ValueError if a damaged heap begins there.
        """
        into = memoryview(buffer).cast("B")
        data = _read(self._stream, self._place, len(into))
        before = b""
        if data and data[0] in _BEGIN[1:]:  # the first bytes of a heap may be read in two pieces
            before_bytes = min(len(_BEGIN) - 1, self._place)
            before = _read(self._stream, self._place - before_bytes, before_bytes)
        for at in _begins(before + data):
            _require_sound(self._stream, self._place - len(before) + at, self.size_bytes)
        into[: len(data)] = data
        self._place += len(data)
        return len(data)

    def close(self) -> None:
        """Close the file."""
        self._stream.close()
        super().close()


def require_sound_heaps(stream: IO[bytes]) -> None:
    """Refuse a file with a damaged heap anywhere, also one that nothing refers to.

    Raises ValueError if there is one.
    """
    size_bytes = stream.seek(0, os.SEEK_END)
    for first in range(0, size_bytes, _BLOCK_BYTES):
        for at in _begins(_read(stream, first, _BLOCK_BYTES + len(_BEGIN) - 1)):
            _require_sound(stream, first + at, size_bytes)


def _begins(data: bytes) -> Iterator[int]:
    at = data.find(_BEGIN)
    while at >= 0:
        yield at
        at = data.find(_BEGIN, at + 1)


def _require_sound(stream: IO[bytes], at: int, size_bytes: int) -> None:
    """Raise ValueError if the objects of a heap do not fill it one after another."""
    size = _number(_read(stream, at, _HEAD_BYTES), _SIZE_AT, 8)
    if size >= _NO_SIZE_BYTES:
        return
    if size > min(MAX_HEAP_BYTES, size_bytes - at) or not _is_filled(_read(stream, at, size)):
        raise ValueError(f"its heap of texts at {at} is damaged")


def _is_filled(heap: bytes) -> bool:
    at = _HEAD_BYTES
    # what HDF5 finds too small for another object is free, too
    while at + _HEAD_BYTES <= len(heap):
        index, size = _number(heap, at, 2), _number(heap, at + _SIZE_AT, 8)
        # free space states its whole size, an object its data's without their head and padding
        size = size if index == 0 else _HEAD_BYTES + (size + 7) // 8 * 8
        if size == 0 or at + size > len(heap):
            return False
        at += size
    return True


def _read(stream: IO[bytes], at: int, size_bytes: int) -> bytes:
    """Return so many bytes, less at the end of the file."""
    stream.seek(at)
    pieces = []
    while size_bytes > 0 and (piece := stream.read(size_bytes)):
        pieces.append(piece)
        size_bytes -= len(piece)
    return b"".join(pieces)


def _number(data: bytes, at: int, size: int) -> int:
    return int.from_bytes(data[at : at + size], "little")
