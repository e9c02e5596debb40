"""A recording in other formats: NumPy's .npz, netCDF's .nc, a .zarr store, an .mcap.

Each carries what the recording says of its images, and how they become moments.
"""

import importlib
import io
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.imaging.labelling import (
    Column,
    image_columns,
    in_words,
    moment_columns,
)
from transientcam_server.offline.formats import (
    SINKS,
    Block,
    Content,
    Put,
    Row,
    library,
    sink_of,
    write,
)
from transientcam_server.recording import layout
from transientcam_server.recording.reader import Recording

Progress = Callable[[int, int], None]
_AXES: Final = ("frame", "image", "y", "x")


def convert_recording(
    recording: Recording, output: Path, *, progress: Progress = lambda done, total: None
) -> None:
    """Write a recording into ``output``, in the format of its suffix.

    Raises
    ------
    NotConvertible
        If the suffix names none.
    MissingExtra
        If the format's library is not installed.
    DamagedFrame
        If a frame is not what was recorded.
    FileExistsError
        If the output is there already.
    OSError
        If the output cannot be written.
    """
    sink = sink_of(output, SINKS | {".mcap": _mcap}, what="recordings")
    blocks = {"raw": Block(_AXES, recording.shape, "<u2", {"units": "DN"})}
    content = Content(columns_of(recording), blocks, attributes_of(recording))
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


@contextmanager
def _mcap(path: Path, content: Content) -> Iterator[Put]:
    """Write each image of a frame to a topic of its own, as Foxglove and ROS programs show them.

    The label of an image is the metadata of its topic; all columns are in ``columns.npz``, an
    attachment, since an .mcap has no arrays.
    """
    foxglove = library("foxglove", "an .mcap")
    messages = importlib.import_module("foxglove.messages")
    topic = importlib.import_module("foxglove.channels").RawImageChannel
    context = foxglove.Context()
    topics = [
        topic(f"/raw/{index:03d}", metadata=_label(content.columns, index), context=context)
        for index in range(content.blocks["raw"].shape[1])
    ]
    arrived_ns = np.round(content.columns["host_time_s"].values * 1e9).astype(np.int64)
    with foxglove.open_mcap(path, context=context) as writer:
        writer.write_metadata("recording", dict(content.attributes))
        writer.attach(
            log_time=int(arrived_ns[0]) if len(arrived_ns) else 0,
            create_time=round(float(content.attributes["started_s"]) * 1e9),
            name="columns.npz",
            media_type="application/x-npz",
            data=_archive(content.columns),
        )

        def put(_: str, index: int, images: NDArray[Any]) -> None:
            time_ns = int(arrived_ns[index])
            stamp = messages.Timestamp(*divmod(time_ns, 10**9))
            for channel, image in zip(topics, images.astype("<u2"), strict=True):
                height, width = image.shape
                message = messages.RawImage(
                    timestamp=stamp,
                    frame_id="camera",
                    width=width,
                    height=height,
                    encoding="16UC1",
                    step=image.strides[0],
                    data=image.tobytes(),
                )
                channel.log(message, log_time=time_ns)

        yield put


def _label(columns: Mapping[str, Column], index: int) -> dict[str, str]:
    """Return the label of one image, as JSON texts."""
    own = {name: in_words(each) for name, each in columns.items() if each.axes == ("image",)}
    label = {name: values[index].item() for name, values in own.items() if name != "image"}
    weights = columns["weight"].values[:, index]
    label["weight"] = np.stack([np.real(weights), np.imag(weights)], axis=1).tolist()
    return {"index": str(index)} | {name: json.dumps(value) for name, value in label.items()}


def _archive(columns: Mapping[str, Column]) -> bytes:
    file = io.BytesIO()
    arrays = {name: in_words(column) for name, column in columns.items()}
    np.savez(file, allow_pickle=False, **arrays)
    return file.getvalue()
