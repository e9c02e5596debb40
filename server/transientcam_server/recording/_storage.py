"""Reads HDF5 files of unknown origin: only what lies within the file, and no more than it holds.

HDF5 follows links and external storage into other files, allocates the sizes that a file states,
and its deflate filter expands a chunk to whatever length comes out. Here a dataset is one of the
file itself, a chunk expands to its stated size at most, and all that is read at once takes no
more memory than the file has bytes.
"""

import contextlib
import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

from transientcam_server.recording import _swmr as swmr
from transientcam_server.recording._heaps import CheckedReader

SMALL_BYTES: Final = 16 * 1024**2
"""May be read of any file: one that was repacked can hold little data in still less space."""
MAX_CHUNK_BYTES: Final = 256 * 1024**2
"""Also the largest size of a frame; 10 of them a second are five times what USB 3 takes."""
MAX_CHUNKS: Final = 4096
"""Read at once: HDF5 takes some 10 KiB for each, also for those that were never written."""
_HARD: Final = h5py.h5l.TYPE_HARD  # pyright: ignore[reportAttributeAccessIssue]
_DEFLATE: Final = h5py.h5z.FILTER_DEFLATE
_PIPELINES: Final = ((), (_DEFLATE,), (h5py.h5z.FILTER_SHUFFLE, _DEFLATE))
"""Filters that are undone here, in the order of writing."""


@contextlib.contextmanager
def open_unknown(path: Path) -> Iterator[swmr.File]:
    """Open a file of unknown origin to read it.

    Raises ValueError if its texts are damaged, as of every read. Raises OSError if it cannot be
    read, or is no HDF5 file; h5py may raise anything else of a damaged one.
    """
    with CheckedReader(path.open("rb")) as checked, swmr.open_file(checked, "r") as file:
        yield file


class Storage:
    """The attributes and datasets of an open file.

    Its methods raise ValueError for what is not there, or not as it should be. Of a damaged file
    h5py may raise anything.

    ``size_bytes``: of the file.
    """

    def __init__(self, file: swmr.File, size_bytes: int) -> None:
        self._file = file
        self._left_bytes = max(size_bytes, SMALL_BYTES)

    def __contains__(self, name: str) -> bool:
        return bool(self._file.id.links.exists(name.encode()))

    def attribute(self, name: str) -> Any:
        """Return an attribute of the file: a number or a text."""
        if name not in self._file.attrs:
            raise ValueError(f"it has no attribute {name}")
        attribute = h5py.h5a.open(self._file.id, name.encode())
        if attribute.shape != ():
            raise ValueError(f"its attribute {name} is an array")
        value = self._file.attrs[name]
        if isinstance(value, np.bool_):
            raise ValueError(f"its attribute {name} is {value}, and no number or text")
        if isinstance(value, bytes):
            return value.decode()
        if not isinstance(value, str):
            return value.item()
        value.encode()  # h5py lets through what is not UTF-8
        return value

    def dataset(
        self, name: str, *, axes: int | None = None, dtype: DTypeLike | None = None
    ) -> swmr.Dataset:
        """Return a dataset with so many axes and, in either byte order, a type."""
        if name not in self:
            raise ValueError(f"it has no {name}")
        if self._file.id.links.get_info(name.encode()).type != _HARD:
            raise ValueError(f"{name} is a link to elsewhere")
        opened = h5py.h5o.open(  # pyright: ignore[reportAttributeAccessIssue]
            self._file.id, name.encode()
        )
        if not isinstance(opened, h5py.h5d.DatasetID):
            raise ValueError(f"{name} is no dataset")
        dataset = h5py.Dataset(opened)
        _require_inside(dataset, name)
        if axes is not None and dataset.ndim != axes:
            raise ValueError(f"{name} has {dataset.ndim} axes, not {axes}")
        if dtype is not None and dataset.dtype.newbyteorder("=") != np.dtype(dtype).newbyteorder(
            "="
        ):
            raise ValueError(f"{name} holds {dataset.dtype}, not {np.dtype(dtype)}")
        return dataset

    def values(
        self, name: str, *, axes: int | None = None, dtype: DTypeLike | None = None
    ) -> NDArray[Any]:
        """Return all values of a dataset."""
        dataset = self.dataset(name, axes=axes, dtype=dtype)
        if dataset.dtype.hasobject:
            raise ValueError(f"{name} holds values of no fixed size")
        if dataset.nbytes > self._left_bytes:
            raise ValueError(
                f"{name} states a size of {dataset.nbytes} bytes, which it cannot have"
            )
        self._left_bytes -= dataset.nbytes
        return read_rows(dataset)

    def text(self, name: str) -> bytes:
        """Return the text of fixed length that a scalar dataset holds, without its padding."""
        if self.dataset(name, axes=0).dtype.kind != "S":
            raise ValueError(f"{name} is no text of fixed length")
        return bytes(self.values(name, axes=0)[()]).rstrip(b"\0")


def read_rows(dataset: swmr.Dataset, first: int = 0, last: int | None = None) -> NDArray[Any]:
    """Return the rows from ``first`` to before ``last`` of a dataset that `Storage` returned.

    Chunks are read past HDF5's filters: these take five times as long, under a lock of the whole
    process, and expand without a limit.
    Raises ValueError if a chunk is damaged, or there are more than `MAX_CHUNKS`.
    """
    _require_few_chunks(dataset, first, last)
    filters = _filters(dataset)
    if not filters:
        whole: NDArray[Any] = np.asarray(dataset[()] if not dataset.ndim else dataset[first:last])
        return whole
    last = len(dataset) if last is None else last
    region = [(first, last), *((0, size) for size in dataset.shape[1:])]
    chunks = dataset.chunks
    found = np.empty([stop - start for start, stop in region], dataset.dtype)
    corners = (range(a - a % step, b, step) for (a, b), step in zip(region, chunks, strict=True))
    for corner in itertools.product(*corners):
        mask, chunk = dataset.id.read_direct_chunk(corner)
        if mask:
            raise ValueError("a chunk was written without its filters")
        block = swmr.expanded(chunk, chunks, dataset.dtype, shuffled=len(filters) > 1)
        if block.shape == found.shape:
            return block
        spans = [
            (max(at, start), min(at + step, stop))
            for at, step, (start, stop) in zip(corner, chunks, region, strict=True)
        ]
        into = tuple(slice(a - r, b - r) for (a, b), (r, _) in zip(spans, region, strict=True))
        of = tuple(slice(a - at, b - at) for (a, b), at in zip(spans, corner, strict=True))
        found[into] = block[of]
    return found


def place_of_chunk(
    dataset: swmr.Dataset, corner: tuple[int, ...], size_bytes: int
) -> tuple[int, int]:
    """Return the offset and the size in bytes of a chunk in a file of ``size_bytes``.

    Raises ValueError if it was never written, or without its filters, or lies outside of the file.
    """
    found = dataset.id.get_chunk_info_by_coord(corner)
    if found.byte_offset is None:
        raise ValueError("a chunk was never written")
    if found.filter_mask:
        raise ValueError("a chunk was written without its filters")
    if found.byte_offset + found.size > size_bytes:
        raise ValueError("a chunk lies outside of the file")
    return found.byte_offset, found.size


def is_one_chunk_a_row(dataset: swmr.Dataset) -> bool:
    """Return whether a dataset is stored as `swmr.create_blocks` makes it."""
    return dataset.chunks == (1, *dataset.shape[1:]) and len(_filters(dataset)) > 1


def is_shuffled(dataset: swmr.Dataset) -> bool | None:
    """Return whether chunks are shuffled before they are deflated; None where they are as is."""
    filters = _filters(dataset)
    return len(filters) > 1 if filters else None


def _require_inside(dataset: swmr.Dataset, name: str) -> None:
    properties = dataset.id.get_create_plist()
    if properties.get_layout() == h5py.h5d.VIRTUAL or properties.get_external_count():
        raise ValueError(f"{name} is stored in other files")
    if _filters_of(properties) not in _PIPELINES:
        raise ValueError(f"{name} is packed with filters other than shuffle and deflate")
    if (
        dataset.chunks
        and np.prod(dataset.chunks, dtype=float) * dataset.dtype.itemsize > MAX_CHUNK_BYTES
    ):
        raise ValueError(f"{name} has chunks of more than {MAX_CHUNK_BYTES} bytes")


def _require_few_chunks(dataset: swmr.Dataset, first: int, last: int | None) -> None:
    chunks = dataset.chunks
    if chunks is None:
        return
    sizes = (len(dataset) if last is None else last) - first, *dataset.shape[1:]
    count = math.prod(-(-size // step) for size, step in zip(sizes, chunks, strict=True))
    if count > MAX_CHUNKS:
        raise ValueError(f"{dataset.name} is stored in {count} chunks, more than {MAX_CHUNKS}")


def _filters(dataset: swmr.Dataset) -> tuple[int, ...]:
    return _filters_of(dataset.id.get_create_plist())


def _filters_of(properties: Any) -> tuple[int, ...]:
    return tuple(properties.get_filter(index)[0] for index in range(properties.get_nfilters()))
