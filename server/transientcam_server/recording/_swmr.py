"""Append-only HDF5 files that survive the death of their writer, and can be read meanwhile.

HDF5 in its single-writer multiple-reader mode (SWMR) orders what it writes so that the file is
consistent at any moment. What it requires, measured (decision 31): every dataset and
attribute exists before the mode is switched on, appended is along the first axis only, and the
series whose length counts the rows is written last. The format is that of HDF5 1.10, never the
newest one, which older readers refuse.

Blocks are compressed here, by `isal`, and written past HDF5's filters as finished chunks; they
are byte-shuffled deflate, which every HDF5 reads with its own two filters.
"""

import ctypes
import itertools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias

import h5py
import numpy as np
from h5py._objects import phil
from isal import isal_zlib
from numpy.typing import NDArray

from transientcam_server.recording import _disk as disk

File: TypeAlias = Any
"""An open h5py.File."""
Dataset: TypeAlias = Any
"""An h5py.Dataset."""
Seal: TypeAlias = Callable[[int, bytes, Mapping[str, object]], bytes]
open_file: Final[Callable[..., Any]] = h5py.File
"""Opens a file; h5py has no types, so that files and datasets are `Any`."""

_SERIES_CHUNK: Final = 1024
_LEVEL: Final = 1
_FSYNC_EVERY_S: Final = 1.0
_READ_ATTEMPTS: Final = 25
"""Of a block whose checksum does not hold: 34 ms in all."""
_IMAGE_NUMBERS: Final = itertools.count()
# h5py has no method for it; looked up through the module, which knows where its libhdf5 is
_set_read_attempts = ctypes.CDLL(h5py.h5p.__file__).H5Pset_metadata_read_attempts
_set_read_attempts.argtypes = ctypes.c_int64, ctypes.c_uint


def open_unfinished(path: Path) -> File:
    """Open a file that may still be written, to read it.

    The lock on it is the recording's own, see `transientcam_server.recording._lock`; HDF5's would
    be refused beside it. HDF5 reads a block whose checksum does not hold again, in case it is being
    written, and waits twice as long each time, from 1 ns on: at its default of 100 attempts
    a damaged file would never be given up.
    Raises OSError if it cannot be opened.
    """
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_file_locking(False, True)
    with phil:  # two threads inside HDF5 end the process; h5py's own functions take its lock
        refused = _set_read_attempts(access.id, _READ_ATTEMPTS) < 0
    if refused:
        raise OSError(5, "HDF5 takes no number of attempts", str(path))
    flags = h5py.h5f.ACC_RDONLY | h5py.h5f.ACC_SWMR_READ
    return open_file(h5py.h5f.open(os.fsencode(path), flags, access))


def image_of(make: Callable[[File], None]) -> bytes:
    """Return the bytes of a new file that ``make`` lays out.

    It is made in memory: HDF5 cannot close a file that it failed to write, as on a full disk.
    """
    name = f"image {next(_IMAGE_NUMBERS)}"  # by which HDF5 tells open files in memory apart
    with open_file(name, "w", driver="core", backing_store=False, libver=disk.LIBVER) as file:
        make(file)
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def compressed(block: NDArray[Any]) -> bytes:
    """Return a C-contiguous block as HDF5's shuffle and deflate filters would leave it."""
    bytes_of_values = block.reshape(-1).view(np.uint8).reshape(-1, block.itemsize)
    return isal_zlib.compress(np.ascontiguousarray(bytes_of_values.T), _LEVEL)


def expanded(
    chunk: bytes, shape: Sequence[int], dtype: np.dtype[Any], *, shuffled: bool = True
) -> NDArray[Any]:
    """Return the block of a chunk, however much more it would expand to.

    Raises ValueError if the chunk is damaged, or holds another number of bytes.
    """
    size_bytes = math.prod(shape) * dtype.itemsize
    inflating = isal_zlib.decompressobj()
    try:
        data = inflating.decompress(chunk, size_bytes + 1)
    except isal_zlib.error as error:  # type: ignore[misc]  # its stub has the class an instance
        raise ValueError(str(error)) from error
    if len(data) != size_bytes or not inflating.eof:
        raise ValueError(f"it does not expand to the {size_bytes} bytes of {tuple(shape)}")
    values = np.frombuffer(data, np.uint8)
    if shuffled:
        values = np.ascontiguousarray(values.reshape(dtype.itemsize, -1).T)
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

    ``path``: of a file of `LIBVER`, complete but for its rows; the lock is the recording's own.
    ``blocks``, ``series``: names of the datasets that grow by one each row; ``series`` in the order
    of writing, the one whose length counts the rows last.
    ``seal``: returns, for a row, a chunk of it and its values of the series, what is written behind
    the chunk.
    """

    def __init__(
        self,
        path: Path,
        blocks: Sequence[str],
        series: Sequence[str],
        *,
        seal: Seal = lambda row, chunk, values: b"",
    ) -> None:
        self._seal = seal
        file, self._disk = disk.open_disk(path, "r+")
        self._file = file
        self._blocks = {name: file[name] for name in blocks}
        self._series = {name: file[name] for name in series}
        self.rows: int = file[series[-1]].shape[0]
        self.synchronised_rows: int = self.rows
        """How many rows are on the disk, which a power cut does not take back."""
        file.swmr_mode = True
        self._disk.synchronise()  # or a power cut left it marked as open otherwise
        self._synchronised_s: float | None = None

    def append(self, blocks: Mapping[str, NDArray[Any]], series: Mapping[str, object]) -> None:
        """Write one row; once this returns, the death of this process does not take it back.

        Raises OSError if it cannot be written.
        """
        row = self.rows
        self._disk.require_written()
        for name, dataset in self._blocks.items():
            block = np.ascontiguousarray(blocks[name], dtype=dataset.dtype)
            dataset.resize(row + 1, 0)
            chunk = compressed(block)
            sealed = chunk + self._seal(row, chunk, series)
            dataset.id.write_direct_chunk((row, *(0,) * block.ndim), sealed)
            dataset.flush()
        for name, dataset in self._series.items():
            dataset.resize(row + 1, 0)
            dataset[row] = series[name]
            dataset.flush()
        self._disk.require_written()
        self.rows = row + 1

    def synchronise(self, now_s: float) -> None:
        """Flush the file to the disk, unless that was done within the last second."""
        if self._synchronised_s is None or now_s - self._synchronised_s >= _FSYNC_EVERY_S:
            rows = self.rows
            self._disk.synchronise()
            self._synchronised_s, self.synchronised_rows = now_s, rows

    @property
    def size_bytes(self) -> int:
        """Size of the file."""
        return self._disk.size_bytes

    def overwrite(self, name: str, value: bytes) -> None:
        """Replace the fixed-length text of a scalar dataset.

        Raises OSError if it cannot be written.
        """
        dataset = self._file[name]
        dataset[()] = value
        dataset.flush()
        self._disk.require_written()

    def close(self) -> None:
        """Finish the file, on the disk.

        Raises OSError if it, or what was appended, cannot be written.
        """
        with self._disk:
            self._file.close()
            self._disk.synchronise()
        self.synchronised_rows = self.rows


def synchronise(path: Path) -> None:
    """Bring a file, or the names in a directory, to the disk. Raises OSError if that fails."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
