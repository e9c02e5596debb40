"""Append-only HDF5 files that survive the death of their writer, and can be read meanwhile.

HDF5 in its single-writer multiple-reader mode (SWMR) orders what it writes so that the file is
consistent at any moment. What it requires, measured (docs/decisions/0601): every dataset and
attribute exists before the mode is switched on, appended is along the first axis only, and the
series whose length counts the rows is written last. The format is that of HDF5 1.10, never the
newest one, which older readers refuse.

Blocks are compressed here, by `isal`, and written past HDF5's filters as finished chunks; they
are byte-shuffled deflate, which every HDF5 reads with its own two filters.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias

import h5py
import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

File: TypeAlias = Any
"""An open h5py.File."""
Dataset: TypeAlias = Any
"""An h5py.Dataset."""
open_file: Final[Callable[..., Any]] = h5py.File
"""Opens a file; h5py has no types, so that files and datasets are `Any`."""

LIBVER: Final = ("v110", "v110")
_SERIES_CHUNK: Final = 1024
_LEVEL: Final = 1
_FSYNC_EVERY_S: Final = 1.0
_SCALE_ATTRIBUTES: Final = frozenset(
    ("CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid")
)


def compressed(block: NDArray[Any]) -> bytes:
    """Return a C-contiguous block as HDF5's shuffle and deflate filters would leave it."""
    bytes_of_values = block.reshape(-1).view(np.uint8).reshape(-1, block.itemsize)
    return isal_zlib.compress(np.ascontiguousarray(bytes_of_values.T), _LEVEL)


def expanded(chunk: bytes, shape: Sequence[int], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the block of a chunk.

    Raises
    ------
    ValueError
        If the chunk is damaged.
    """
    try:
        data = isal_zlib.decompress(chunk)
    except isal_zlib.error as error:  # type: ignore[misc]  # its stub has the class an instance
        raise ValueError(str(error)) from error
    planes = np.frombuffer(data, np.uint8)
    if planes.size != int(np.prod(shape)) * dtype.itemsize:
        raise ValueError(f"{planes.size} bytes in a chunk of shape {tuple(shape)}")
    values = np.ascontiguousarray(planes.reshape(dtype.itemsize, -1).T)
    return values.view(dtype).reshape(shape)


def in_words(error: Exception) -> str:
    """Return the system's message, without the place and the address that HDF5 adds."""
    if isinstance(error, OSError) and error.errno is not None:
        own = error.strerror or ""
        return os.strerror(error.errno) if "errno =" in own else own
    return str(error).partition("\n")[0]


def create_blocks(
    file: File, name: str, shape: Sequence[int], dtype: str, **attributes: object
) -> Dataset:
    """Create a dataset of blocks (rows, *shape), one chunk a row."""
    dataset = file.create_dataset(
        name,
        (0, *shape),
        dtype,
        maxshape=(None, *shape),
        chunks=(1, *shape),
        compression="gzip",
        compression_opts=_LEVEL,
        shuffle=True,
    )
    dataset.attrs.update(attributes)
    return dataset


def create_series(file: File, name: str, dtype: str, **attributes: object) -> Dataset:
    """Create a dataset of numbers, one a row."""
    dataset = file.create_dataset(name, (0,), dtype, maxshape=(None,), chunks=(_SERIES_CHUNK,))
    dataset.attrs.update(attributes)
    return dataset


class Appender:
    """Appends rows to a file in SWMR mode, which begins with this object.

    Parameters
    ----------
    file
        Open for writing with `LIBVER`, complete but for its rows.
    blocks, series
        Names of the datasets that grow by one each row; ``series`` in the order of writing, the
        one whose length counts the rows last.
    """

    def __init__(self, file: File, blocks: Sequence[str], series: Sequence[str]) -> None:
        self._file = file
        self._blocks = {name: file[name] for name in blocks}
        self._series = {name: file[name] for name in series}
        self._count = file[series[-1]]
        self.rows: int = self._count.shape[0]
        file.swmr_mode = True
        # fsync takes any descriptor of the file
        self._descriptor = os.open(file.filename, os.O_RDONLY)
        self._synchronised_s: float | None = None

    def append(self, blocks: Mapping[str, NDArray[Any]], series: Mapping[str, object]) -> None:
        """Write one row; once this returns, the death of this process does not take it back.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        row = self.rows
        for name, dataset in self._blocks.items():
            block = np.ascontiguousarray(blocks[name], dtype=dataset.dtype)
            dataset.resize(row + 1, 0)
            dataset.id.write_direct_chunk((row, *(0,) * block.ndim), compressed(block))
            dataset.flush()
        for name, dataset in self._series.items():
            dataset.resize(row + 1, 0)
            dataset[row] = series[name]
            dataset.flush()
        self.rows = row + 1

    def synchronise(self, now_s: float) -> None:
        """Flush the file to the disk, unless that was done within the last second."""
        if self._synchronised_s is None or now_s - self._synchronised_s >= _FSYNC_EVERY_S:
            os.fsync(self._descriptor)
            self._synchronised_s = now_s

    def bytes_written(self) -> int:
        """Return the size of the file."""
        return os.fstat(self._descriptor).st_size

    def overwrite(self, name: str, value: bytes) -> None:
        """Replace the fixed-length text of a scalar dataset."""
        dataset = self._file[name]
        dataset[()] = value
        dataset.flush()

    def close(self) -> None:
        """Finish the file, on the disk."""
        try:
            self._file.close()
            os.fsync(self._descriptor)
        finally:
            os.close(self._descriptor)


def salvage(source: File, target: Path, rows: int, *, row_axis: str) -> None:
    """Copy what is consistent of an unfinished file into a new one that any HDF5 reader opens.

    Chunks are copied as they are. ``row_axis`` is the series whose length counts the rows; every
    dataset that can grow is cut to ``rows``. Copying whole groups or repairing in place
    (`h5clear`) were tried and fail on such files: the end of the allocated space that the file
    states is out of date.
    """
    with open_file(target, "w", libver=LIBVER) as copy:
        copy.attrs.update(source.attrs)
        growing = [name for name, item in source.items() if item.maxshape[:1] == (None,)]
        for name, dataset, first in _with_first_names(source):
            if first != name:  # another name of the same dataset
                copy[name] = copy[first]
                continue
            if name in growing:
                _copy_rows(dataset, copy, rows)
            else:
                copy.create_dataset(name, data=dataset[()], dtype=dataset.dtype)
            _copy_attributes(dataset, copy[name])
        _restore_scales(source, copy)
    if row_axis not in growing:
        raise ValueError(f"no series {row_axis}")


def _with_first_names(source: File) -> list[tuple[str, Dataset, str]]:
    """Return name and dataset of everything, and the first name of the same dataset."""
    first: dict[Dataset, str] = {}  # datasets are equal where they are the same in the file
    return [(name, each, first.setdefault(each, name)) for name, each in source.items()]


def _copy_rows(dataset: Dataset, copy: File, rows: int) -> None:
    if dataset.ndim == 1:
        create_series(copy, dataset.name, dataset.dtype)
        copy[dataset.name].resize(rows, 0)
        copy[dataset.name][:] = dataset[:rows]
        return
    blocks = create_blocks(copy, dataset.name, dataset.shape[1:], dataset.dtype)
    blocks.resize(rows, 0)
    for row in range(rows):
        place = (row, *(0,) * (dataset.ndim - 1))
        mask, chunk = dataset.id.read_direct_chunk(place)
        blocks.id.write_direct_chunk(place, chunk, filter_mask=mask)


def _copy_attributes(dataset: Dataset, copy: Dataset) -> None:
    for name in dataset.attrs:
        if name not in _SCALE_ATTRIBUTES:
            copy.attrs[name] = dataset.attrs[name]


def _restore_scales(source: File, copy: File) -> None:
    for name, dataset in source.items():
        if dataset.is_scale:
            copy[name].make_scale(name)
    for name, dataset in source.items():
        for axis, dimension in enumerate(dataset.dims):
            for scale in dimension.values():
                copy[name].dims[axis].attach_scale(copy[scale.name])
