"""Seals: behind the bytes of each frame, all that is needed to find it without HDF5's indices.

HDF5 orders what it writes, but a power cut does not: of what was written since the last fsync
a disk keeps any part, and a torn block of an index takes all frames with it. A frame's chunk is
never written again, so that one found with its seal is whole. HDF5 and other readers of deflate
stop at the end of the compressed data, and do not see the seal behind it.
"""

import mmap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from isal import isal_zlib

from transientcam_server.recording._layout import SERIES

_MAGIC: Final = bytes.fromhex("7f5d0a1ae3c14b9f8e62d00dfeed5ea1")
_SEAL: Final = np.dtype(
    [
        ("magic", f"V{len(_MAGIC)}"),
        ("row", "<u8"),
        ("size", "<u8"),
        *((name, kind) for name, (kind, _) in SERIES.items()),
    ]
)
"""Packed, in this order; the CRC-32 of chunk and seal follows."""
_CRC_BYTES: Final = 4
SIZE_BYTES: Final = _SEAL.itemsize + _CRC_BYTES
"""Of a seal."""


@dataclass(frozen=True, slots=True)
class SealedFrame:
    """A frame found in a file: its place, its size, and its values of all series."""

    offset: int
    size: int
    values: Mapping[str, Any]


def seal(row: int, chunk: bytes, values: Mapping[str, object]) -> bytes:
    """Return what is written behind the chunk of a row."""
    record = np.zeros((), _SEAL)
    record["magic"] = np.void(_MAGIC)
    record["row"], record["size"] = row, len(chunk)
    for name in SERIES:
        record[name] = values[name]
    data = record.tobytes()
    return data + isal_zlib.crc32(data, isal_zlib.crc32(chunk)).to_bytes(_CRC_BYTES, "little")


def unsealed_size(size_bytes: int, end: bytes) -> int:
    """Return how many bytes of a chunk are compressed data.

    ``size_bytes``: of the chunk, with a seal or without one.
    ``end``: its last `SIZE_BYTES`, or all of a shorter one.
    """
    if len(end) == SIZE_BYTES and end.startswith(_MAGIC):
        record = np.frombuffer(end[: _SEAL.itemsize], _SEAL)[0]
        if int(record["size"]) == size_bytes - SIZE_BYTES:
            return size_bytes - SIZE_BYTES
    return size_bytes


def sealed_frames(path: Path) -> list[SealedFrame]:
    """Return the frames of a file from the first to before the first that is not whole.

    Raises OSError if it cannot be read.
    """
    found: dict[int, SealedFrame] = {}
    with path.open("rb") as stream:
        if not path.stat().st_size:
            return []
        with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
            at = data.find(_MAGIC)
            while at >= 0:
                row = _whole(data, at, found)
                at = data.find(_MAGIC, at + (len(_MAGIC) if row is None else _SEAL.itemsize))
    frames: list[SealedFrame] = []
    while len(frames) in found:
        frames.append(found[len(frames)])
    return frames


def _whole(data: mmap.mmap, at: int, found: dict[int, SealedFrame]) -> int | None:
    """Add the frame whose seal is at a place, and return its row; None if it is not whole."""
    end = at + _SEAL.itemsize
    if end + _CRC_BYTES > len(data):
        return None
    record = np.frombuffer(data[at:end], _SEAL)[0]
    size = int(record["size"])
    if size > at:
        return None
    with memoryview(data) as view, view[at - size : end] as sealed:
        if isal_zlib.crc32(sealed) != int.from_bytes(data[end : end + _CRC_BYTES], "little"):
            return None
    values = {name: record[name].item() for name in SERIES}
    row = int(record["row"])
    found[row] = SealedFrame(at - size, size, values)
    return row
