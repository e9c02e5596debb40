"""A recording as the keys of a Zarr store (storage specification, version 2) and their values.

Chunks of the images are the bytes that HDF5 has stored, shuffled and deflated, which version 2
names by the codecs ``shuffle`` and ``zlib``. Version 3 has no names for the two that all its
readers share (decision 33). Everything else is small, and made from what the reader has checked.
"""

import itertools
import json
import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from transientcam_server.errors import DamagedFrame
from transientcam_server.imaging import Column
from transientcam_server.recording import _seal as seal
from transientcam_server.recording._columns import AXES, as_json, attributes_of, columns_of
from transientcam_server.recording._reader import Recording
from transientcam_server.recording._storage import is_shuffled, place_of_chunk

CONSOLIDATED: Final = ".zmetadata"
_SERIES_ROWS: Final = 1024
"""Of a chunk of what grows by a value a frame: who read an older shape still gets whole chunks."""
_NUMBERS: Final = re.compile(r"(0|[1-9]\d{0,9})(\.(0|[1-9]\d{0,9}))*", re.ASCII)


def is_of_chunk(key: str) -> bool:
    """Return whether a key is that of a chunk, in version 2 or 3, and not that of a document."""
    rest = key.partition("/")[2]
    return f"{rest}/".startswith("c/") or _NUMBERS.fullmatch(rest) is not None


@dataclass(frozen=True, slots=True)
class Place:
    """Where in the file the bytes of a chunk are."""

    offset_bytes: int
    size_bytes: int


class ZarrKeys:
    """The keys of an open recording.

    ``recording``: also one that is still written: it has the frames that it had when it was opened.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._raw = recording.stored

    def value(self, key: str) -> bytes:
        """Return what stands at a key, such as ``.zmetadata`` or ``raw/3.0.0.0``.

        Raises KeyError if nothing does; DamagedFrame if a chunk is not where the file says.
        """
        array, _, part = key.rpartition("/")
        if key == CONSOLIDATED:
            return _encoded({"zarr_consolidated_format": 1, "metadata": self.metadata})
        if array and _NUMBERS.fullmatch(part):
            return self._chunk(array, tuple(map(int, part.split("."))))
        return _encoded(self.metadata[key])

    @cached_property
    def metadata(self) -> dict[str, Any]:
        """Every document by its key, without the one that has them all."""
        recording = self._recording
        documents: dict[str, Any] = {
            ".zgroup": {"zarr_format": 2},
            ".zattrs": attributes_of(recording),
        }
        shuffled, dtype = is_shuffled(self._raw), self._raw.dtype
        shape = recording.shape
        arrays: dict[str, dict[str, Any]] = {
            "raw": {
                "shape": shape,
                "chunks": self._raw_chunks,
                "dtype": dtype.str,
                "filters": [{"id": "shuffle", "elementsize": dtype.itemsize}] if shuffled else None,
                # readers undo any level
                "compressor": None if shuffled is None else {"id": "zlib", "level": 1},
                "attributes": {"units": "DN", "long_name": "raw images"},
                "axes": AXES,
            }
        }
        for name, column in self._columns.items():
            arrays[name] = {
                "shape": column.values.shape,
                "chunks": _chunks_of(column),
                "dtype": column.values.dtype.str,
                "filters": None,
                "compressor": None,
                "attributes": column.attributes,
                "axes": column.axes,
            }
        for name, array in arrays.items():
            axes, attributes = array.pop("axes"), array.pop("attributes")
            # a fill value of another kind would be taken for the mark of missing values
            usual = {"zarr_format": 2, "fill_value": None, "order": "C"}
            documents[f"{name}/.zarray"] = usual | array
            documents[f"{name}/.zattrs"] = {"_ARRAY_DIMENSIONS": list(axes), **as_json(attributes)}
        return documents

    def small(self) -> Iterator[str]:
        """Yield the key of every chunk that is not of the images."""
        for name, column in self._columns.items():
            counts = map(_count, column.values.shape, _chunks_of(column))
            for numbers in itertools.product(*map(range, counts)):
                yield f"{name}/" + (".".join(map(str, numbers)) or "0")

    def places(self) -> Iterator[tuple[str, Place]]:
        """Yield the key and the place of every chunk of the images, which are in chunks.

        Raises DamagedFrame if one is not where the file says.
        """
        counts = map(_count, self._recording.shape, self._raw_chunks)
        for numbers in itertools.product(*map(range, counts)):
            yield "raw/" + ".".join(map(str, numbers)), self._place(numbers)

    @cached_property
    def _columns(self) -> dict[str, Column]:
        return columns_of(self._recording)

    @property
    def _raw_chunks(self) -> tuple[int, ...]:
        chunks: tuple[int, ...] | None = self._raw.chunks
        return chunks or (1, *self._recording.shape[1:])

    def _chunk(self, array: str, numbers: tuple[int, ...]) -> bytes:
        column = None if array == "raw" else self._columns[array]
        if column is None:
            shape, chunks = self._recording.shape, self._raw_chunks
        else:
            shape, chunks = column.values.shape, _chunks_of(column)
        # an array without axes has one chunk, of the name 0
        counts = tuple(map(_count, shape, chunks)) or (1,)
        if len(numbers) != len(counts) or not all(map(int.__lt__, numbers, counts)):
            raise KeyError(array)
        return self._stored(numbers) if column is None else _of_column(column, numbers)

    def _stored(self, numbers: tuple[int, ...]) -> bytes:
        """Return a chunk of the images as it stands in the file, without its seal."""
        if self._raw.chunks is None:
            return np.asarray(self._raw[numbers[0] : numbers[0] + 1]).tobytes()
        place = self._place(numbers)
        return os.pread(self._recording.descriptor, place.size_bytes, place.offset_bytes)

    def _place(self, numbers: tuple[int, ...]) -> Place:
        descriptor = self._recording.descriptor
        corner = tuple(map(int.__mul__, numbers, self._raw_chunks))
        try:
            offset, size = place_of_chunk(self._raw, corner, os.fstat(descriptor).st_size)
        except Exception as error:  # h5py raises anything of a damaged file
            first = numbers[0] * self._raw_chunks[0]
            raise DamagedFrame(str(self._recording.path), first + 1, str(error)) from error
        last = min(size, seal.SIZE_BYTES)
        end = os.pread(descriptor, last, offset + size - last)
        return Place(offset, seal.unsealed_size(size, end))


def _chunks_of(column: Column) -> tuple[int, ...]:
    if column.axes == AXES[:1]:
        return (_SERIES_ROWS,)
    return tuple(max(1, size) for size in column.values.shape)


def _of_column(column: Column, numbers: tuple[int, ...]) -> bytes:
    values = np.ascontiguousarray(column.values)
    if column.axes != AXES[:1]:
        return values.tobytes()
    part = values[numbers[0] * _SERIES_ROWS :][:_SERIES_ROWS]
    return np.pad(part, (0, _SERIES_ROWS - len(part))).tobytes()


def _count(size: int, chunk: int) -> int:
    return math.ceil(size / chunk)


def _encoded(document: dict[str, Any]) -> bytes:
    return json.dumps(document).encode("ascii")
