"""A recording in other formats: NumPy's .npz, netCDF's .nc, a .zarr store, an .mcap.

Each carries what the recording says of its images, and how they become moments.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

import numpy as np

from transientcam_server.errors.exceptions import InputError
from transientcam_server.imaging.labelling import Column, image_columns, moment_columns
from transientcam_server.offline.formats import SINKS, Block, Content, Row, sink_of, write
from transientcam_server.offline.mcap import Schemas, write_mcap
from transientcam_server.recording import layout
from transientcam_server.recording.reader import Recording

Progress = Callable[[int, int], None]
_AXES: Final = ("frame", "image", "y", "x")


def convert_recording(
    recording: Recording,
    output: Path,
    *,
    products: Sequence[str] = ("raw",),
    schemas: Schemas = "foxglove",
    progress: Progress = lambda done, total: None,
) -> None:
    """Write a recording into ``output``, in the format of its suffix.

    Parameters
    ----------
    products
        What an .mcap holds of each frame; other formats hold the raw images.
    schemas
        Whose messages an .mcap holds.

    Raises
    ------
    NotConvertible
        If the suffix names none.
    InputError
        If the format, or a message, cannot hold a product.
    MissingExtra
        If the format's library is not installed.
    DamagedFrame
        If a frame is not what was recorded.
    FileExistsError
        If the output is there already.
    OSError
        If the output cannot be written.
    """
    blocks = {"raw": Block(_AXES, recording.shape, "<u2", {"units": "DN"})}
    content = Content(columns_of(recording), blocks, attributes_of(recording))
    if output.suffix.lower() == ".mcap":
        write_mcap(output, recording, content, products, schemas, progress)
        return
    sink = sink_of(output, SINKS, what="recordings", also=[".mcap"])
    if set(products) != {"raw"}:
        raise InputError(
            "--product",
            output.suffix,
            ", ".join(products),
            "raw, or else an .mcap; transientcam reconstruct writes products into .npz, .nc, .zarr",
        )
    write(output, content, _rows(recording, progress), sink)


def _rows(recording: Recording, progress: Progress) -> Iterator[Row]:
    for index, raw in enumerate(recording):
        yield "raw", index, raw.images
        progress(index + 1, recording.frames)


def columns_of(recording: Recording) -> dict[str, Column]:
    """Return everything but the images; of old files what follows from their sequence."""
    header, labels = recording.header, recording.labels
    columns = {
        name: Column(("frame",), recording.series(name), attributes)
        for name, (_, attributes) in layout.SERIES.items()
    }
    for name, size in zip(_AXES[1:], recording.shape[1:], strict=True):
        columns[name] = Column((name,), np.arange(size, dtype=np.int32))
    columns |= image_columns(labels)
    return columns | moment_columns(header.applied, labels, header.gains)


def attributes_of(recording: Recording) -> dict[str, str]:
    """Return name, sequence, settings and all other documents of a recording as texts."""
    header = recording.header
    return {
        "title": header.name,
        "Conventions": "CF-1.11",
        "recording_id": header.recording_id,
        "started_s": repr(header.started_s),
        "sequence": json.dumps(header.applied.to_document()),
        "capabilities": json.dumps(asdict(header.capabilities)),
        "camera": json.dumps(dict(header.camera)),
        "calibration": json.dumps(dict(header.calibration)),
        "reconstruction": json.dumps(dict(header.reconstruction)),
        "versions": json.dumps(dict(header.versions)),
        "annotations": json.dumps(recording.annotations),
        "end": json.dumps(recording.end),
    }
