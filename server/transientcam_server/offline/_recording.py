"""Products of every frame of a recording, into a file that an interruption does not spoil.

A second run goes on after the last frame that is in the file.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import AppliedSequence, RawFrame
from transientcam_server.errors import InputError
from transientcam_server.imaging import PRODUCTS, Column, Product, SettingsVersion, parts_of, unmet
from transientcam_server.offline._computing import ComputedFrame, known_product
from transientcam_server.offline._formats import SINKS, Block, Content, Row, sink_of, write
from transientcam_server.recording import (
    FORMAT,
    Recording,
    open_to_write,
    recorded_recipe,
    require_sound_heaps,
    salvage,
    swmr,
)
from transientcam_server.settings import ReconstructionSettings

DEFAULT_PRODUCTS: Final = ("range", "direct", "indirect", "brightness", "validity", "flags")
HDF5_SUFFIXES: Final = (".h5", ".hdf5")
_DESCRIBED: Final = ("units", "long_name")
_SERIES: Final = ("device_time_s", "host_time_s", "frame")
Progress = Callable[[int, int], None]


def default_products(applied: AppliedSequence) -> tuple[str, ...]:
    """Return those of `DEFAULT_PRODUCTS` that frames of a sequence have."""
    given = applied.sequence.sampling, {applied.sequence.zeroth}
    return tuple(name for name in DEFAULT_PRODUCTS if unmet(PRODUCTS[name], *given) is None)


@dataclass(frozen=True, slots=True)
class BatchOptions:
    """Products and settings; ``bins`` times of flight for products over time."""

    products: tuple[str, ...] = DEFAULT_PRODUCTS
    settings: ReconstructionSettings = field(default_factory=ReconstructionSettings)
    bins: int = 256


class BatchReconstructor:
    """Computes products of frames, each stage once a frame."""

    def __init__(self, recording: Recording, options: BatchOptions) -> None:
        capabilities = recording.header.capabilities
        self.recipe = recorded_recipe(recording.header, SettingsVersion(1, options.settings))
        self._size = capabilities.height, capabilities.width
        self.products = [known_product(name) for name in options.products]
        self.time_s = np.arange(options.bins) / (options.bins * self.recipe.base_frequency_hz)

    def shape(self, product: Product) -> tuple[int, ...]:
        """Shape of a product of one frame."""
        return product.shape(self.recipe.applied, *self._size, times=len(self.time_s))

    def compute(self, raw: RawFrame, previous: RawFrame | None = None) -> dict[str, NDArray[Any]]:
        """Return the products of a frame by name; it may be filled in from the ``previous`` one."""
        frames = [raw] if previous is None else [previous, raw]
        frame = ComputedFrame(len(frames) - 1, self.recipe, frames.__getitem__)
        return {
            each.name: frame.product(
                each.name, time_s=self.time_s.tolist() if each.over_time else None
            ).array
            for each in self.products
        }


def reconstruct_recording(
    recording: Recording,
    output: Path,
    options: BatchOptions,
    *,
    progress: Progress = lambda done, total: None,
) -> int:
    """Compute products of all frames into ``output``; return how many were there already.

    The suffix says the format: .h5, .npz, .nc or .zarr. Until it is complete there is an HDF5 file
    ``<output>.part``, whatever the format, which a second run continues.

    Raises NotConvertible if the suffix names no format.
    Raises MissingExtra if the format's library is not installed.
    Raises InputError if the unfinished file is of another recording, or made with other settings.
    Raises DamagedFrame if a frame is not what was recorded; those before it stay done.
    Raises FileExistsError if the output is there already.
    Raises OSError if the output cannot be written.
    """
    if output.exists():
        raise FileExistsError(17, "it is there already", str(output))
    sink = None
    if output.suffix.lower() not in HDF5_SUFFIXES:
        sink = sink_of(output, SINKS, what="products of a recording", also=HDF5_SUFFIXES)
    reconstructor = BatchReconstructor(recording, options)
    part = output.with_name(output.name + ".part")
    document = document_of(recording, options)
    content = content_of(recording, reconstructor, document)
    empty = {name: np.empty(0, block.dtype) for name, block in content.blocks.items()}
    names = [*content.blocks, *(parts := parts_of(empty))]
    if part.exists():
        _repair(part, document, [*names, *_SERIES])
    else:
        try:
            with open_to_write(part, "x") as (file, _):
                _lay_out(file, content, parts)
        except BaseException:
            part.unlink(missing_ok=True)  # nothing is in it that could be gone on with
            raise
    rows = swmr.Appender(part, names, list(_SERIES))
    done = rows.rows
    previous = recording.frame(done - 1) if 0 < done < recording.frames else None
    try:
        for index in range(done, recording.frames):
            progress(index, recording.frames)
            raw = recording.frame(index)
            series = {
                "device_time_s": raw.device_time_s,
                "host_time_s": raw.host_time_s,
                "frame": index + 1,
            }
            found = reconstructor.compute(raw, previous)
            rows.append(found | parts_of(found), series)
            previous = raw
        progress(recording.frames, recording.frames)
    finally:
        rows.close()
    if sink is None:
        part.rename(output)
    else:
        with swmr.open_file(part, "r") as finished:
            write(output, _content(finished), _rows(finished), sink)
        part.unlink()
    swmr.synchronise(output.parent)
    return done


def _content(file: swmr.File) -> Content:
    """Return what a file of products holds, for another format."""
    columns, blocks = {}, {}
    for name, dataset in file.items():
        own = (name,) if dataset.is_scale else None
        axes = own or tuple(each[0].name.lstrip("/") for each in dataset.dims)
        attributes = {key: dataset.attrs[key] for key in _DESCRIBED if key in dataset.attrs}
        if dataset.ndim > 1:
            blocks[name] = Block(axes, dataset.shape, dataset.dtype.str, attributes)
        else:
            columns[name] = Column(axes, dataset[()], attributes)
    return Content(columns, blocks, dict(file.attrs))


def _rows(file: swmr.File) -> Iterator[Row]:
    for name, dataset in file.items():
        for index in range(len(dataset) if dataset.ndim > 1 else 0):
            yield name, index, dataset[index]


def document_of(recording: Recording, options: BatchOptions) -> dict[str, str]:
    """Return the attributes that must agree for an unfinished file to be continued."""
    header = recording.header
    return {
        "format": FORMAT,
        "recording_id": header.recording_id,
        "title": header.name,
        "Conventions": "CF-1.11",
        "sequence": json.dumps(header.applied.to_document()),
        "reconstruction": json.dumps(options.settings.model_dump(), sort_keys=True),
        "calibration": json.dumps(dict(header.calibration)),
        "products": json.dumps([*options.products, options.bins]),
    }


def content_of(
    recording: Recording, reconstructor: BatchReconstructor, document: Mapping[str, str]
) -> Content:
    """Return what a store of products holds: all but the products, which are empty."""
    columns = {
        name: Column(("frame",), recording.series(name), {"units": "s"})
        for name in _SERIES
        if name != "frame"
    }
    blocks = {}
    for product in reconstructor.products:
        description, shape = product.description, reconstructor.shape(product)
        attributes = {"units": description.unit, "long_name": description.summary}
        axes = ("frame", *description.axes)
        sizes = (recording.frames, *shape)
        dtype = np.dtype(description.dtype)
        missing = np.nan if dtype.kind in "fc" else np.iinfo(dtype).max  # never a likely value
        blocks[product.name] = Block(axes, sizes, description.dtype, attributes, missing)
        for name, size in zip(description.axes, shape, strict=True):
            values = reconstructor.time_s if name == "time" else np.arange(size)
            columns[name] = Column((name,), values)
    versions = json.dumps(dict(recording.header.versions))
    return Content(columns, blocks, {**document, "versions": versions})


def _lay_out(file: swmr.File, content: Content, parts: Mapping[str, NDArray[Any]]) -> None:
    """Create everything that a file of products holds, of no frame yet."""
    file.attrs.update(content.attributes)
    swmr.create_series(file, "frame", "<u8")
    file["frame"].make_scale("frame")
    for name, column in content.columns.items():
        if column.axes == ("frame",):
            swmr.create_series(file, name, "<f8", **column.attributes)
            file[name].dims[0].attach_scale(file["frame"])
        else:
            file.create_dataset(name, data=column.values).make_scale(name)
    each_part = {name: replace(content.blocks[name[:-3]], dtype="<f4") for name in parts}
    for name, block in (dict(content.blocks) | each_part).items():
        blocks = swmr.create_blocks(file, name, block.shape[1:], block.dtype, **block.attributes)
        for axis, along in enumerate(block.axes):
            blocks.dims[axis].attach_scale(file[along])


def _repair(part: Path, document: Mapping[str, str], names: Sequence[str]) -> None:
    """Repair an unfinished file, to append to it."""
    scratch = part.with_name(part.name + ".resuming")
    try:
        with part.open("rb") as stream:
            require_sound_heaps(stream)
        with swmr.open_unfinished(part) as begun:
            require_same(part, begun.attrs, document)
            rows = min(len(begun[name]) for name in names)
            salvage(begun, scratch, rows, row_axis="frame")
        scratch.rename(part)
    except (KeyError, RuntimeError, ValueError) as error:
        raise InputError(str(part), "its content", swmr.in_words(error), "products") from error
    finally:
        scratch.unlink(missing_ok=True)


def require_same(part: Path | str, begun: Mapping[str, Any], document: Mapping[str, str]) -> None:
    """Refuse to go on with products that were begun of something else, or otherwise.

    Raises InputError if they were.
    """
    for key, value in document.items():
        if begun.get(key) != value:
            expected = f"{value} to go on with; delete the file to begin anew"
            raise InputError(str(part), key, str(begun.get(key)), expected)
