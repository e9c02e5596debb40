"""Makes of an unfinished file a new one that any HDF5 reader opens, with all that is whole."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from transientcam_server.errors import NotARecording
from transientcam_server.recording import _layout as layout, _swmr as swmr
from transientcam_server.recording._disk import DiskFile, open_to_write
from transientcam_server.recording._seal import SealedFrame, seal
from transientcam_server.recording._storage import Storage, is_one_chunk_a_row

_SCALE_ATTRIBUTES: Final = frozenset(
    ("CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid")
)


def salvage(source: swmr.File, target: Path, rows: int, *, row_axis: str) -> None:
    """Copy an unfinished file, and bring the copy to the disk.

    Chunks are copied as they are. ``row_axis`` is the series whose length counts the rows; every
    dataset that can grow is cut to ``rows``. Copying whole groups or repairing in place
    (`h5clear`) were tried and fail on such files: the end of the allocated space that the file
    states is out of date.
    Raises ValueError if it is not as an `Appender` writes it; of a damaged file h5py may raise
    anything else. Raises OSError if the copy cannot be written.
    """
    storage = Storage(source, Path(source.filename).stat().st_size)
    datasets = {name: storage.dataset(name) for name in source}
    growing = [name for name, each in datasets.items() if each.maxshape[:1] == (None,)]
    if row_axis not in growing:
        raise ValueError(f"no series {row_axis}")
    with open_to_write(target, "w") as (copy, disk):
        copy.attrs.update(source.attrs)
        first: dict[swmr.Dataset, str] = {}  # datasets are equal where they are the same one
        for name, dataset in datasets.items():
            if first.setdefault(dataset, name) != name:  # another name of it
                copy[name] = copy[first[dataset]]
                continue
            if name not in growing:
                copy.create_dataset(name, data=storage.values(name), dtype=dataset.dtype)
            elif dataset.ndim == 1:
                swmr.create_series(copy, name, dataset.dtype)
                copy[name].resize(rows, 0)
                copy[name][:] = storage.values(name)[:rows]
            else:
                _copy_blocks(dataset, copy, rows, disk)
            for attribute in sorted(set(dataset.attrs) - _SCALE_ATTRIBUTES):
                copy[name].attrs[attribute] = dataset.attrs[attribute]
        _restore_scales(datasets, copy)


def rebuild(part: Path, target: Path, frames: Sequence[SealedFrame]) -> None:
    """Make a recording anew of frames found in an unfinished one, and bring it to the disk.

    Raises NotARecording if what was known before the first frame cannot be read, or its frames have
    no seals; OSError if it cannot be written.
    """
    try:
        with swmr.open_unfinished(part) as source:
            storage = Storage(source, part.stat().st_size)
            storage.attribute("seals")
            header = layout.read_header(storage, with_images=False)
            annotations = layout.read_document(storage, "annotations")
    except Exception as error:  # h5py raises anything of a damaged file
        raise NotARecording(str(part), str(error)) from error
    with part.open("rb") as stream:

        def chunk(frame: SealedFrame) -> bytes:
            stream.seek(frame.offset)
            return stream.read(frame.size)

        found = ((chunk(frame), frame.values) for frame in frames)
        write_whole(target, layout.image(header, annotations), found)


def write_whole(
    target: Path, empty: bytes, frames: Iterable[tuple[bytes, Mapping[str, Any]]]
) -> None:
    """Write a recording with all its frames, and bring it to the disk.

    ``empty``: as `layout.image` returns it.
    ``frames``: the compressed chunk of each, and its values of all series.
    Raises OSError if it cannot be written.
    """
    target.write_bytes(empty)
    rows: list[Mapping[str, Any]] = []
    with open_to_write(target, "r+") as (file, disk):
        raw = file["raw"]
        for row, (chunk, values) in enumerate(frames):
            raw.resize(row + 1, 0)
            raw.id.write_direct_chunk((row, 0, 0, 0), chunk + seal(row, chunk, values))
            disk.require_written()
            rows.append(values)
        for name, (kind, _) in layout.SERIES.items():
            file[name].resize(len(rows), 0)
            file[name][:] = np.array([values[name] for values in rows], kind)
        file[layout.ROW_AXIS].resize(len(rows), 0)
        file[layout.ROW_AXIS][:] = np.arange(1, len(rows) + 1)


def _copy_blocks(dataset: swmr.Dataset, copy: swmr.File, rows: int, disk: DiskFile) -> None:
    if not is_one_chunk_a_row(dataset):
        raise ValueError(f"{dataset.name} was not written as a recording's blocks are")
    blocks = swmr.create_blocks(copy, dataset.name, dataset.shape[1:], dataset.dtype)
    blocks.resize(rows, 0)
    for row in range(rows):
        place = (row, *(0,) * (dataset.ndim - 1))
        mask, chunk = dataset.id.read_direct_chunk(place)
        blocks.id.write_direct_chunk(place, chunk, filter_mask=mask)
        disk.require_written()


def _restore_scales(datasets: dict[str, swmr.Dataset], copy: swmr.File) -> None:
    for name, dataset in datasets.items():
        if dataset.is_scale:
            copy[name].make_scale(name)
    for name, dataset in datasets.items():
        for axis, dimension in enumerate(dataset.dims):
            for scale in dimension.values():
                copy[name].dims[axis].attach_scale(copy[scale.name])
