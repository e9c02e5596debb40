"""A recording in other formats: NumPy's .npz, netCDF's .nc, a .zarr store, an .mcap.

Images go from file to file one frame at a time, so that a recording may be larger than memory.
"""

import importlib
import json
import shutil
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.errors.exceptions import MissingExtra, NotConvertible
from transientcam_server.recording import layout
from transientcam_server.recording.reader import Recording

Progress = Callable[[int, int], None]
Put = Callable[[int, NDArray[np.uint16]], None]
Table = Mapping[str, tuple[tuple[str, ...], NDArray[Any], Mapping[str, str]]]
"""Arrays by name: axes, values, attributes."""
AXES: Final = ("frame", "image", "y", "x")


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
    sink = _SINKS.get(output.suffix.lower())
    if sink is None:
        raise NotConvertible(str(output), sorted(_SINKS))
    if output.exists():
        raise FileExistsError(17, "it is there already", str(output))
    scratch = output.with_name(output.name + ".part")
    _remove(scratch)
    try:
        with sink(scratch, recording, _table(recording), _attributes(recording)) as put:
            for index, raw in enumerate(recording):
                put(index, raw.images)
                progress(index + 1, recording.frames)
        scratch.rename(output)
    finally:
        _remove(scratch)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _table(recording: Recording) -> Table:
    """Return everything but the images."""
    labels = [asdict(label) for label in recording.labels]
    table: dict[str, tuple[tuple[str, ...], NDArray[Any], Mapping[str, str]]] = {
        name: (("frame",), recording.series(name), attributes)
        for name, (_, attributes) in layout.SERIES.items()
    }
    for name in labels[0].keys() - {"index"}:
        values = np.asarray([label[name] for label in labels])
        if values.dtype == bool:
            values = values.astype(np.uint8)  # netCDF has no boolean
        table[name] = (("image",), values, {})
    _, images, height, width = recording.shape
    for name, size in zip(AXES[1:], (images, height, width), strict=True):
        table[name] = ((name,), np.arange(size, dtype=np.int32), {})
    return table


def _attributes(recording: Recording) -> dict[str, str]:
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
def _npz(
    path: Path, recording: Recording, table: Table, attributes: Mapping[str, str]
) -> Iterator[Put]:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        arrays = {name: values for name, (_, values, _) in table.items()}
        for name, values in (arrays | {k: np.asarray(v) for k, v in attributes.items()}).items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, values, allow_pickle=False)
        with archive.open("raw.npy", "w", force_zip64=True) as member:
            described = {"descr": "<u2", "fortran_order": False, "shape": recording.shape}
            np.lib.format.write_array_header_1_0(member, described)

            def put(_: int, images: NDArray[np.uint16]) -> None:
                member.write(images.astype("<u2").tobytes())

            yield put


@contextmanager
def _netcdf(
    path: Path, recording: Recording, table: Table, attributes: Mapping[str, str]
) -> Iterator[Put]:
    h5netcdf = _library("h5netcdf", "a .nc")
    with h5netcdf.File(path, "w") as file:
        file.dimensions = dict(zip(AXES, recording.shape, strict=True))
        file.attrs.update(attributes)
        for name, (axes, values, described) in table.items():
            file.create_variable(name, axes, data=values).attrs.update(described)
        raw = file.create_variable(
            "raw",
            AXES,
            "<u2",
            chunks=(1, *recording.shape[1:]),
            compression="gzip",
            compression_opts=1,
            shuffle=True,
        )
        raw.attrs["units"] = "DN"

        def put(index: int, images: NDArray[np.uint16]) -> None:
            raw[index] = images

        yield put


@contextmanager
def _zarr(
    path: Path, recording: Recording, table: Table, attributes: Mapping[str, str]
) -> Iterator[Put]:
    zarr = _library("zarr", "a .zarr")
    group = zarr.create_group(store=str(path), attributes=dict(attributes))
    for name, (axes, values, described) in table.items():
        group.create_array(name, data=values, dimension_names=axes, attributes=dict(described))
    raw = group.create_array(
        "raw",
        shape=recording.shape,
        dtype="<u2",
        chunks=(1, *recording.shape[1:]),
        dimension_names=AXES,
        attributes={"units": "DN"},
    )

    def put(index: int, images: NDArray[np.uint16]) -> None:
        raw[index] = images

    yield put


@contextmanager
def _mcap(
    path: Path, recording: Recording, table: Table, attributes: Mapping[str, str]
) -> Iterator[Put]:
    """Write each image of a frame to a topic of its own, as Foxglove and ROS programs show them."""
    foxglove = _library("foxglove", "an .mcap")
    messages = importlib.import_module("foxglove.messages")
    topic = importlib.import_module("foxglove.channels").RawImageChannel
    context = foxglove.Context()
    topics = [
        topic(f"/raw/{label.index:03d}", metadata=_texts(asdict(label)), context=context)
        for label in recording.labels
    ]
    arrived_ns = np.round(np.asarray(table["host_time_s"][1]) * 1e9).astype(np.int64)
    with foxglove.open_mcap(path, context=context) as writer:
        writer.write_metadata("recording", dict(attributes))

        def put(index: int, images: NDArray[np.uint16]) -> None:
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


def _texts(document: Mapping[str, Any]) -> dict[str, str]:
    return {name: json.dumps(value) for name, value in document.items()}


def _library(name: str, what: str) -> Any:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise MissingExtra(f"converting into {what}", name, "convert") from error


_Sink = Callable[[Path, Recording, Table, Mapping[str, str]], AbstractContextManager[Put]]
_SINKS: Final[dict[str, _Sink]] = {".npz": _npz, ".nc": _netcdf, ".zarr": _zarr, ".mcap": _mcap}
