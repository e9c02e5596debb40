"""Arrays with named axes in the formats that a suffix names: .npz, netCDF's .nc, a .zarr store.

What grows with the number of frames is written one frame at a time, so that a file may be larger
than memory.
"""

import importlib
import shutil
import warnings
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam.errors import TransientcamError
from transientcam_server.errors import MissingExtra, NotConvertible, ServerError, StorageError
from transientcam_server.imaging import Column, in_words
from transientcam_server.recording import EVERY_CHUNK, DiskFile, as_json

STATE: Final = "state"
"""Attribute of a store: `UNFINISHED` until all frames are in it, then `COMPLETE`."""
UNFINISHED: Final = "unfinished"
COMPLETE: Final = "complete"
WHOLE: Final = {"write_empty_chunks": True}
Row = tuple[str, int, NDArray[Any]]
"""Name of a block, number of the frame, and its values."""
Put = Callable[[str, int, NDArray[Any]], None]


@dataclass(frozen=True, slots=True)
class Block:
    """An array that is written frame by frame: all its axes, frames first, shape and type.

    ``missing`` is what a Zarr store reads where nothing was written; None for 0.
    """

    axes: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: str
    attributes: Mapping[str, Any] = field(default_factory=dict)
    missing: float | None = None


@dataclass(frozen=True, slots=True)
class Content:
    """What a file holds."""

    columns: Mapping[str, Column]
    blocks: Mapping[str, Block]
    attributes: Mapping[str, str]


Sink = Callable[[Path, Content], AbstractContextManager[Put]]


def write(output: Path, content: Content, rows: Iterable[Row], sink: Sink) -> None:
    """Write a file, whole or not at all; ``rows`` come block by block, in the order of frames.

    Raises FileExistsError if the output is there already; OSError if the output cannot be written.
    """
    with whole(output) as scratch, sink(scratch, content) as put:
        for name, index, values in rows:
            put(name, index, values)


@contextmanager
def whole(output: Path) -> Iterator[Path]:
    """Yield a path to write to, which becomes ``output`` in the end; nothing is left of a failure.

    Raises FileExistsError if the output is there already.
    """
    if output.exists():
        raise FileExistsError(17, "it is there already", str(output))
    scratch = output.with_name(output.name + ".writing")
    _remove(scratch)
    try:
        yield scratch
        scratch.rename(output)
    finally:
        _remove(scratch)


def sink_of(
    output: Path, sinks: Mapping[str, Sink], *, what: str, also: Iterable[str] = ()
) -> Sink:
    """Return what writes the format that the suffix of ``output`` names.

    Raises NotConvertible if it names none; the error lists them, and ``also`` those that are
    written elsewhere. Raises MissingExtra if the format's library is not installed.
    """
    sink = sinks.get(output.suffix.lower())
    if sink is None:
        raise NotConvertible(str(output), sorted({*sinks, *also}), what)
    needed = _LIBRARIES.get(output.suffix.lower())
    if needed is not None:
        library(needed, f"a {output.suffix.lower()}")
    return sink


def library(name: str, what: str) -> Any:
    """Return an optional library, or raise a MissingExtra that says what needs it."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise MissingExtra(f"writing {what}", name, "convert") from error


@contextmanager
def _npz(path: Path, content: Content) -> Iterator[Put]:
    columns = {name: in_words(column) for name, column in content.columns.items()}
    texts = {name: np.asarray(text) for name, text in content.attributes.items()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, values in (columns | texts).items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, values, allow_pickle=False)
        with ExitStack() as opened:
            members: dict[str, Any] = {}

            def put(name: str, _: int, values: NDArray[Any]) -> None:
                block = content.blocks[name]
                if name not in members:
                    opened.close()  # an archive has one member open at a time
                    opener = archive.open(f"{name}.npy", "w", force_zip64=True)
                    members[name] = opened.enter_context(opener)
                    header = {"descr": block.dtype, "fortran_order": False, "shape": block.shape}
                    np.lib.format.write_array_header_1_0(members[name], header)
                members[name].write(np.ascontiguousarray(values, block.dtype).tobytes())

            yield put


@contextmanager
def _netcdf(path: Path, content: Content) -> Iterator[Put]:
    h5netcdf = library("h5netcdf", "a .nc")
    with DiskFile(path, "w") as disk:
        with h5netcdf.File(disk, "w") as file:
            file.dimensions = _sizes(content)
            file.attrs.update(content.attributes)
            for name, column in content.columns.items():
                variable = file.create_variable(name, column.axes, data=column.values)
                variable.attrs.update(column.attributes)
            for name, block in content.blocks.items():
                variable = file.create_variable(
                    name,
                    block.axes,
                    block.dtype,
                    chunks=(1, *block.shape[1:]),
                    compression="gzip",
                    compression_opts=1,
                    shuffle=True,
                )
                variable.attrs.update(block.attributes)

            def put(name: str, index: int, values: NDArray[Any]) -> None:
                file[name][index] = values
                disk.require_written()

            yield put
        disk.synchronise()


@contextmanager
def _zarr(path: Path, content: Content) -> Iterator[Put]:
    group = create_zarr(str(path), content)
    blocks = {name: every_chunk(group[name]) for name in content.blocks}

    def put(name: str, index: int, values: NDArray[Any]) -> None:
        blocks[name][index] = values

    yield put
    finish_zarr(str(path))


def create_zarr(
    place: str,
    content: Content,
    *,
    rows_of_chunk: Callable[[Block], int] = lambda block: 1,
    overwrite: bool = False,
) -> Any:
    """Make a Zarr store with the columns of its content, and its blocks empty; return its group.

    ``place``: a directory, or any address that fsspec knows.
    ``rows_of_chunk``: how many rows of a block make a chunk.
    ``overwrite``: whether to replace what is there.
    Raises MissingExtra if zarr is not installed.
    """
    zarr = library("zarr", "a .zarr")
    attributes = {**content.attributes, STATE: UNFINISHED, EVERY_CHUNK: True}
    group = zarr.create_group(store=place, attributes=attributes, overwrite=overwrite)
    for name, column in content.columns.items():
        group.create_array(
            name,
            data=column.values,
            dimension_names=column.axes,
            attributes=as_json(column.attributes),
        )
    for name, block in content.blocks.items():
        group.create_array(
            name,
            shape=block.shape,
            dtype=block.dtype,
            chunks=(rows_of_chunk(block), *block.shape[1:]),
            fill_value=block.missing,
            dimension_names=block.axes,
            attributes=as_json(block.attributes),
        )
    return group


def every_chunk(array: Any) -> Any:
    """Return an array of Zarr that writes chunks of the fill value, too, as its store states."""
    return array.with_config(WHOLE)


def finish_zarr(place: str) -> None:
    """Write the metadata of all arrays into one document, which a complete store has."""
    zarr = library("zarr", "a .zarr")
    zarr.open_group(place, mode="r+").attrs[STATE] = COMPLETE
    with warnings.catch_warnings():
        # the third version of the format has consolidated metadata as an extension, which zarr and
        # xarray look for; without, each array costs a request to a remote store
        warnings.filterwarnings("ignore", message="Consolidated metadata")
        zarr.consolidate_metadata(place)


@contextmanager
def naming_address(place: str) -> Iterator[None]:
    """Say in errors of a store which address it has: each backend of fsspec raises its own.

    Raises StorageError in place of any other error of the block, where ``place`` is an address.
    """
    try:
        yield
    except (FileExistsError, ServerError, TransientcamError):
        raise
    except Exception as error:
        if "://" not in place:
            raise
        raise StorageError(place, str(error) or type(error).__name__) from error


def _sizes(content: Content) -> dict[str, int]:
    arrays = [(each.axes, each.values.shape) for each in content.columns.values()]
    arrays += [(each.axes, each.shape) for each in content.blocks.values()]
    return {
        axis: length for axes, shape in arrays for axis, length in zip(axes, shape, strict=True)
    }


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


SINKS: Final[dict[str, Sink]] = {".npz": _npz, ".nc": _netcdf, ".zarr": _zarr}
"""What writes the formats that any arrays have, by suffix."""
_LIBRARIES: Final = {".nc": "h5netcdf", ".zarr": "zarr"}
