"""A recording as an .mcap: images, points, lens and pose, as Foxglove or ROS 2 programs read them.

A file holds messages of one kind, since players of ROS 2 refuse a file with any other in it.
"""

import importlib
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, cast

import numpy as np
from numpy.typing import NDArray

from transientcam import wire
from transientcam.robotics import Calibration, Message, Pinhole, messages_of, viewable
from transientcam_server.errors import InputError, StorageError
from transientcam_server.imaging import Column, in_words, known_intrinsics
from transientcam_server.offline._computing import KNOWN, known_products
from transientcam_server.offline._formats import Content, library, whole
from transientcam_server.offline._opening import OpenedRecording
from transientcam_server.recording import Recording
from transientcam_server.settings import LensSettings

if TYPE_CHECKING:
    from transientcam.robotics import Encoded

Schemas = Literal["foxglove", "ros2"]
PRODUCTS: Final = tuple(name for name in KNOWN if viewable(wire.PRODUCTS[name]))
"""Ours that an .mcap can hold of each frame; maps of other packages beside them."""
_RAW: Final = "/raw/"


def write_mcap(
    output: Path,
    recording: Recording,
    content: Content,
    products: Sequence[str],
    schemas: Schemas,
    progress: Callable[[int, int], None],
) -> None:
    """Write products of every frame of a recording; see `convert_recording`.

    The label of a raw image is the metadata of its topic; the recording's documents are a record
    of metadata, and all columns are in ``columns.npz``, an attachment: an .mcap has no arrays.
    """
    known = *PRODUCTS, *(name for name in known_products() if name not in KNOWN)
    unknown = [name for name in products if name not in known]
    if unknown:
        raise InputError("--product", "a product", ", ".join(unknown), " or ".join(known))
    foxglove = library("foxglove", "an .mcap")
    log = _Topics(foxglove, schemas, content.columns)
    lens = lens_of(recording)
    captured_ns = np.round(content.columns["captured_unix_s"].values * 1e9).astype(np.int64)
    options = importlib.import_module("foxglove.mcap").MCAPWriteOptions(
        profile="ros2" if schemas == "ros2" else None
    )
    with (
        _in_words(output),
        whole(output) as scratch,
        foxglove.open_mcap(scratch, context=log.context, writer_options=options) as writer,
    ):
        writer.write_metadata("recording", dict(content.attributes))
        writer.attach(
            log_time=int(captured_ns[0]) if len(captured_ns) else 0,
            create_time=round(float(content.attributes["started_s"]) * 1e9),
            name="columns.npz",
            media_type="application/x-npz",
            data=_archive(content.columns),
        )
        for index, (arrays, intensity) in enumerate(_frames(recording, products)):
            for message in messages_of(arrays, lens, intensity=intensity):
                log(message, int(captured_ns[index]))
            progress(index + 1, recording.frames)


@contextmanager
def _in_words(output: Path) -> Iterator[None]:
    """Say of what a failure of the SDK is where a disk is full, or fails: it has no type for it."""
    try:
        yield
    except RuntimeError as error:
        if type(error) is not RuntimeError:  # one of another kind, a `RecursionError` say
            raise
        raise StorageError(str(output), str(error)) from error


def lens_of(recording: Recording) -> Pinhole:
    """Return the lens that a recording holds, or one that is assumed."""
    size, camera = recording.header.capabilities, recording.header.camera
    return known_intrinsics(
        LensSettings(), width=size.width, height=size.height, recorded=camera.get("intrinsics")
    )


def _frames(
    recording: Recording, products: Sequence[str]
) -> Iterator[tuple[dict[str, NDArray[Any]], NDArray[np.float32] | None]]:
    """Yield the products of each frame, and the intensity of its points where there are any."""
    if set(products) == {"raw"}:  # needs no settings that can be used
        yield from (({"raw": raw.images.astype("<u2")}, None) for raw in recording)
        return
    for frame in OpenedRecording(recording):
        arrays = {name: frame.product(name).array for name in products}
        yield arrays, frame.product("direct").array if "pointcloud" in products else None


def ros2_message(message: Message, time_ns: int) -> "Encoded":
    """Return a message as ROS 2 has it, in CDR, stamped with ``time_ns`` (Unix time)."""
    ros2 = importlib.import_module("transientcam_server.offline._ros2")
    return cast("Encoded", ros2.encode(message, time_ns))


class _Topics:
    """Logs messages, each to a channel of its topic."""

    def __init__(self, foxglove: Any, schemas: Schemas, columns: Mapping[str, Column]) -> None:
        self.context = foxglove.Context()
        self._channel = foxglove.Channel
        self._columns = columns
        self._channels: dict[str, Any] = {}
        if schemas == "ros2":
            library("rosbags", "messages of ROS 2")
            ros2 = importlib.import_module("transientcam_server.offline._ros2")
            self._encode: Callable[[Message, int], Encoded] = ros2.encode
            self._extra: Callable[[Message], dict[str, str]] = ros2.quality_of_service
        else:
            module = importlib.import_module("transientcam.robotics._foxglove_messages")
            self._encode = module.encode
            self._extra = lambda message: {}

    def __call__(self, message: Message, time_ns: int) -> None:
        schema, encoding, data = self._encode(message, time_ns)
        if message.topic not in self._channels:
            self._channels[message.topic] = self._channel(
                message.topic,
                schema=schema,
                message_encoding=encoding,
                metadata=self._extra(message) | self._metadata(message),
                context=self.context,
            )
        self._channels[message.topic].log(data, log_time=time_ns)

    def _metadata(self, message: Message) -> dict[str, str]:
        if isinstance(message, Calibration):
            return {"source": message.lens.source}
        if message.topic.startswith(_RAW):
            return _label(self._columns, int(message.topic.rpartition("_")[2]))
        return {}


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
