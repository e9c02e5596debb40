"""Damaged heaps of texts, in which HDF5 would look for the next object for ever.

A global heap (HDF5 File Format Specification 3.0, Sec. III.E) is a chain of objects, each of which
states its size. HDF5 follows it to its end, also where an object of the size 0 leads nowhere, as
where a sector of a disk was lost. Meanwhile nothing else in the process can use HDF5.
"""

from typing import IO, Final

LOOKED_AT_BYTES: Final = 1024 * 1024
"""From the begin of a file: texts are written before the first frame."""
_BEGIN: Final = b"GCOL\1"
_HEAD_BYTES: Final = 16
"""Of a heap, and of each object in it."""
_SIZE_AT: Final = 8


def require_sound_heaps(stream: IO[bytes]) -> None:
    """Refuse a file with a heap whose objects do not fill it one after another.

    Raises
    ------
    ValueError
        If there is one.
    """
    stream.seek(0)
    data = stream.read(LOOKED_AT_BYTES)
    at = data.find(_BEGIN)
    while at >= 0:
        if not _is_sound(data, at):
            raise ValueError(f"its heap of texts at {at} is damaged")
        at = data.find(_BEGIN, at + 1)


def _is_sound(data: bytes, at: int) -> bool:
    end = at + _number(data, at + _SIZE_AT, 8)
    at += _HEAD_BYTES
    # what HDF5 finds too small for another object is free, too
    while at + _HEAD_BYTES <= min(end, len(data)):
        index, size = _number(data, at, 2), _number(data, at + _SIZE_AT, 8)
        # free space states its whole size, an object its data's without their head and padding
        size = size if index == 0 else _HEAD_BYTES + (size + 7) // 8 * 8
        if size == 0 or at + size > end:
            return False
        at += size
    return True


def _number(data: bytes, at: int, size: int) -> int:
    return int.from_bytes(data[at : at + size], "little")
