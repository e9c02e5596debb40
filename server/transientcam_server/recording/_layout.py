"""What a recording holds and where: raw images, their labels, one series a property of a frame.

docs/recordings.md describes the same for other programs.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any, Final

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray
from pydantic import ValidationError

from transientcam_driver import AppliedSequence, Capabilities, ImageLabel, RawFrame, Sequence
from transientcam_server.imaging import Column, Gains, image_columns, moment_columns, usable
from transientcam_server.recording import _swmr as swmr
from transientcam_server.recording._storage import MAX_CHUNK_BYTES, Storage
from transientcam_server.settings import dataclass_of

_LONGEST_S: Final = 1e12  # of a recording
FORMAT: Final = "transientcam recording"
FORMAT_VERSION: Final = 1
SUFFIX: Final = ".h5"
PART_SUFFIX: Final = ".h5.part"
SCRATCH_SUFFIX: Final = ".h5.scratch"
"""Of what is being made and is no recording yet; deleted where no process makes it."""
ANNOTATIONS_BYTES: Final = 16 * 1024
END_BYTES: Final = 4 * 1024
MAX_DEPTH: Final = 64
"""Levels of annotations and other JSON documents."""
BITS: Final = 16
"""Of a pixel, at most."""

SERIES: Final[dict[str, tuple[str, dict[str, str]]]] = {
    "epoch": ("<u4", {"long_name": "configuration epoch of the device"}),
    "device_time_s": ("<f8", {"units": "s", "long_name": "begin of the first exposure"}),
    "host_time_s": ("<f8", {"units": "s", "long_name": "arrival of the last image, Unix time"}),
    "capture_s": ("<f8", {"units": "s", "long_name": "first exposure to last read-out"}),
    "temperature_c": ("<f8", {"units": "degC", "long_name": "temperature of the sensor"}),
    "lost_images": ("<i8", {"units": "1", "long_name": "images lost on the cable before"}),
    "dropped_frames": ("<i8", {"units": "1", "long_name": "frames the recorder dropped before"}),
    "crc32": ("<u4", {"long_name": "CRC-32 of the images' uint16 values, little endian"}),
    "device_frame": ("<u8", {"units": "1", "long_name": "frame counter of the device"}),
}
"""One value a frame: type and attributes."""
ROW_AXIS: Final = "frame"
NUMBERS: Final = {ROW_AXIS: ("<u8", {"units": "1", "long_name": "number of the frame, from 1"})}
"""The series that is written last: it counts the frames."""
_AXES: Final = ("frame", "image", "y", "x")
_LABEL_DTYPES: Final[dict[object, str]] = {int: "<i4", float: "<f8", bool: "|u1"}
_LABELS: Final = {
    each.name: _LABEL_DTYPES[each.type] for each in fields(ImageLabel) if each.name != "index"
}
_LAST_S: Final = datetime(9999, 12, 31, tzinfo=UTC).timestamp()


@dataclass(frozen=True)
class Header:
    """What is known before the first frame."""

    recording_id: str
    name: str
    """``recording_id``, ``name``: its id in the service, and its name for people."""
    started_s: float
    """Unix time."""
    applied: AppliedSequence
    """The sequence as the camera really set it."""
    capabilities: Capabilities
    """Of the camera."""
    camera: Mapping[str, Any] = field(default_factory=dict)
    """How it was opened, and which scene it simulates."""
    calibration: Mapping[str, Any] = field(default_factory=lambda: {"id": "nominal"})
    """Of the moments: its id, and further properties where known."""
    calibration_planes: NDArray[np.complexfloating[Any, Any]] | None = None
    """complex (m+1,) or (m+1, H, W): what moments are divided by; None for the nominal gains."""
    calibration_bad: NDArray[np.bool_] | None = None
    """bool (H, W): pixels that show their neighbours' mean instead."""
    calibration_waveform: NDArray[np.complexfloating[Any, Any]] | None = None
    """complex (m, K): harmonics of the modulation, see `Gains`."""
    reconstruction: Mapping[str, Any] = field(default_factory=dict)
    """Settings at the time of recording."""
    versions: Mapping[str, str] = field(
        default_factory=lambda: {name: version(name) for name in ("transientcam", "h5py", "numpy")}
    )
    """Of the software."""

    @property
    def gains(self) -> Gains | None:
        """The measured gains; None for the nominal ones."""
        if self.calibration_planes is None:
            return None
        name, known_c = (
            self.calibration.get("id", "recorded"),
            self.calibration.get("temperature_c"),
        )
        gains = self.calibration_planes, self.calibration_bad, self.calibration_waveform
        return Gains(str(name), *gains, known_c if isinstance(known_c, float) else None)


def utc(unix_s: float) -> datetime:
    """Return a Unix time as a date, the last or first one that there is if it lies beyond."""
    return datetime.fromtimestamp(min(max(unix_s, 0.0), _LAST_S), UTC)


def checksum(images: NDArray[np.uint16]) -> int:
    """Return the CRC-32 of images as they are stored."""
    return isal_zlib.crc32(np.ascontiguousarray(images, dtype="<u2").data.cast("B"))


def image(
    header: Header,
    annotations: Mapping[str, Any],
    *,
    labels: tuple[ImageLabel, ...] | None = None,
    end: Mapping[str, Any] | None = None,
) -> bytes:
    """Return the bytes of an empty recording, complete but for its frames.

    ``labels``: of the images, where they are not those of its sequence.
    ``end``: how it ended, where that is known.
    """
    labels = header.applied.labels if labels is None else labels
    last = b"" if end is None else encoded(end)
    return swmr.image_of(lambda file: _create(file, header, annotations, labels, last))


def _create(
    file: swmr.File,
    header: Header,
    annotations: Mapping[str, Any],
    labels: tuple[ImageLabel, ...],
    end: bytes,
) -> None:
    capabilities = header.capabilities
    file.attrs.update(
        {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "seals": 1,  # see `transientcam_server.recording._seal`
            "Conventions": "CF-1.11",
            "title": header.name,
            "recording_id": header.recording_id,
            "started": utc(header.started_s).isoformat(),
            "started_s": header.started_s,
            "sequence": json.dumps(header.applied.to_document()),
            "capabilities": json.dumps(asdict(capabilities)),
            "camera": json.dumps(dict(header.camera)),
            "calibration": json.dumps(dict(header.calibration)),
            "reconstruction": json.dumps(dict(header.reconstruction)),
            "versions": json.dumps(dict(header.versions)),
        }
    )
    shape = len(labels), capabilities.height, capabilities.width
    swmr.create_blocks(file, "raw", shape, "<u2", units="DN", long_name="raw images")
    for name, (dtype, attributes) in (SERIES | NUMBERS).items():
        swmr.create_series(file, name, dtype, **attributes)
    for name, size in zip(("image", "y", "x"), shape, strict=True):
        file.create_dataset(name, data=np.arange(size, dtype="<i4"))
    for name in _AXES:
        file[name].make_scale(name)
    _create_columns(file, image_columns(labels))
    _create_columns(file, moment_columns(header.applied, labels, header.gains))
    if header.calibration_planes is not None:
        # names that readers of the first version of this format look for, of the same datasets
        file["calibration_planes"] = file["gain"]
        if "bad" in file:
            file["calibration_bad"] = file["bad"]
    file.create_dataset("annotations", data=encoded(annotations), dtype=f"S{ANNOTATIONS_BYTES}")
    file.create_dataset("end", data=end, dtype=f"S{END_BYTES}")
    _scale(file)


def _create_columns(file: swmr.File, columns: Mapping[str, Column]) -> None:
    for name, column in columns.items():
        dataset = file.create_dataset(name, data=column.values)
        dataset.attrs.update(column.attributes)
        if column.axes == (name,):
            dataset.make_scale(name)
            continue
        for axis, (along, size) in enumerate(zip(column.axes, column.values.shape, strict=True)):
            if along not in file:
                file.create_dataset(along, data=np.arange(size, dtype="<i4")).make_scale(along)
            dataset.dims[axis].attach_scale(file[along])


def _scale(file: swmr.File) -> None:
    """Attach the axes as HDF5 dimension scales, which xarray and netCDF read."""
    for axis, name in enumerate(_AXES):
        file["raw"].dims[axis].attach_scale(file[name])
    for name in SERIES:
        file[name].dims[0].attach_scale(file[ROW_AXIS])


def encoded(document: Mapping[str, Any]) -> bytes:
    """Return a document as the bytes that a scalar dataset holds."""
    return json.dumps(document, separators=(",", ":"), allow_nan=False).encode("ascii")


def row(raw: RawFrame, *, dropped_frames: int) -> dict[str, object]:
    """Return a frame's values of all series."""
    return {
        "epoch": raw.epoch,
        "device_time_s": raw.device_time_s,
        "host_time_s": raw.host_time_s,
        "capture_s": raw.capture_s,
        "temperature_c": math.nan if raw.temperature_c is None else raw.temperature_c,
        "lost_images": raw.lost_images,
        "dropped_frames": dropped_frames,
        "crc32": checksum(raw.images),
        "device_frame": raw.number,
    }


def read_header(storage: Storage, *, with_images: bool = True) -> Header:
    """Return what `image` holds; ``with_images`` is false where those cannot be read.

    Raises KeyError, TypeError, ValueError, RecursionError, DriverError if the file is no recording,
    or one of a newer format; h5py may raise anything else of a damaged one.
    """
    if storage.attribute("format") != FORMAT:
        raise ValueError(f"its format is {storage.attribute('format')!r}")
    if storage.attribute("format_version") != FORMAT_VERSION:
        raise ValueError(f"its format has version {storage.attribute('format_version')}")
    capabilities = _capabilities(parsed(storage.attribute("capabilities")))
    document = parsed(storage.attribute("sequence"))
    applied = capabilities.describe(
        Sequence.from_document(document), epoch=int(document["sequence_id"])
    )
    _finite("sequence", *(v for v in applied.to_document().values() if isinstance(v, float)))
    shape = applied.images, capabilities.height, capabilities.width
    found = storage.dataset("raw", axes=4, dtype="<u2").shape[1:] if with_images else shape
    if found != shape or min(shape) < 1:
        raise ValueError(f"its images have shape {found}, not {shape}")
    if np.prod(shape, dtype=float) * np.dtype("<u2").itemsize > MAX_CHUNK_BYTES:
        raise ValueError(f"its frames have more than {MAX_CHUNK_BYTES} bytes")
    planes, bad = _calibration(storage, (applied.sequence.harmonics + 1, *shape[1:]))
    versions = parsed(storage.attribute("versions"))
    return Header(
        recording_id=str(storage.attribute("recording_id")),
        name=str(storage.attribute("title")),
        started_s=_finite("started_s", float(storage.attribute("started_s"))),
        applied=applied,
        capabilities=capabilities,
        camera=parsed(storage.attribute("camera")),
        calibration=parsed(storage.attribute("calibration")),
        calibration_planes=planes,
        calibration_bad=bad,
        calibration_waveform=_waveform(storage, applied.sequence.harmonics),
        reconstruction=parsed(storage.attribute("reconstruction")),
        versions={name: str(value) for name, value in versions.items()},
    )


def _capabilities(document: Mapping[str, Any]) -> Capabilities:
    try:
        capabilities = dataclass_of(Capabilities, document)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ValueError(f"its capabilities have {place} = {first['input']!r}") from error
    if not 1 <= capabilities.bits <= BITS:
        raise ValueError(f"its images have {capabilities.bits} bits")
    return capabilities


def _calibration(
    storage: Storage, shape: tuple[int, ...]
) -> tuple[NDArray[Any] | None, NDArray[np.bool_] | None]:
    """Return gains, one a moment or one a moment and pixel, and bad pixels, as far as it has them.

    ``shape`` is (moments, H, W).
    """
    planes = bad = None
    if "calibration_planes" in storage:
        planes = storage.values("calibration_planes")
        if planes.dtype.kind != "c" or planes.shape not in (shape, shape[:1]):
            raise ValueError(f"its gains are {planes.dtype} of shape {planes.shape}")
    if "calibration_bad" in storage:
        bad = storage.values("calibration_bad", axes=2, dtype="|u1").astype(bool)
        if bad.shape != shape[1:]:
            raise ValueError(f"its bad pixels have shape {bad.shape}")
    return planes, bad


def _waveform(storage: Storage, harmonics: int) -> NDArray[Any] | None:
    """Return the harmonics of the modulation (m, K), where it has any."""
    if "waveform" not in storage:
        return None
    found = storage.values("waveform")
    known = usable(found) if found.ndim == 2 and len(found) == harmonics else None
    if known is None:
        raise ValueError(f"its waveform is {found.dtype} of shape {found.shape}, or too strong")
    return known


def read_labels(storage: Storage, applied: AppliedSequence) -> tuple[ImageLabel, ...]:
    """Return what each image shows; takes and harmonics are those of the sequence.

    Raises KeyError, ValueError if they are not.
    """
    columns: dict[str, list[Any]] = {
        name: storage.values(name, axes=1, dtype=dtype).tolist() for name, dtype in _LABELS.items()
    }
    if any(len(values) != applied.images for values in columns.values()):
        raise ValueError(f"it has no {applied.images} labels")
    for name in ("frequency_hz", "phase_rad", "exposure_s"):
        _finite(name, *columns[name])
    columns["index"] = list(range(applied.images))
    columns["illumination"] = [bool(lit) for lit in columns["illumination"]]
    labels = tuple(
        ImageLabel(**{name: values[k] for name, values in columns.items()})
        for k in columns["index"]
    )
    for label, wanted in zip(labels, applied.labels, strict=True):
        if (label.take, label.harmonic) != (wanted.take, wanted.harmonic):
            raise ValueError(f"image {label.index} is labelled otherwise than its sequence")
    return labels


def read_series(storage: Storage) -> dict[str, NDArray[Any]]:
    """Return `SERIES` and `NUMBERS`; one may be longer than another while the file is written.

    Older files have the counter of the device in the place of the numbers.

    Raises KeyError, ValueError if one is not there, or is a time that is no number.
    """
    stored = {} if "device_frame" in storage else {"device_frame": ROW_AXIS}
    found = {
        name: storage.values(stored.get(name, name), axes=1, dtype=kind)
        for name, (kind, _) in (SERIES | NUMBERS).items()
    }
    found[ROW_AXIS] = np.arange(1, len(found[ROW_AXIS]) + 1, dtype=np.uint64)
    for name in ("host_time_s", "device_time_s", "capture_s"):
        _finite(name, *found[name][~np.isfinite(found[name])])
    return found


def read_document(storage: Storage, name: str) -> dict[str, Any]:
    """Return a JSON document in a scalar dataset; empty where none was written or it is torn."""
    text = storage.text(name)
    try:
        return parsed(text or b"{}")
    except (ValueError, RecursionError):
        return {}


def read_end(storage: Storage) -> dict[str, Any]:
    """Return how the recording ended; empty while it has not.

    Raises ValueError if it says so in another way than a recorder does.
    """
    end = read_document(storage, "end")
    for name in ("reason", "problem"):
        if not isinstance(end.get(name), str | None):
            raise ValueError(f"end.{name} is {end[name]!r}")
    duration_s = end.get("duration_s", 0.0)
    # a whole number of JSON may be larger than any float
    if type(duration_s) not in (int, float) or not 0.0 <= duration_s <= _LONGEST_S:
        raise ValueError(f"end.duration_s is {duration_s!r:.40}")
    return end


def parsed(text: str | bytes) -> dict[str, Any]:
    """Return a JSON object that can be sent on: without NaN, half characters, or great depth.

    Raises ValueError, RecursionError if it is something else.
    """
    document = json.loads(text)
    if not isinstance(document, dict):
        raise ValueError(f"it has {str(document)[:40]!r} for a JSON object")
    require_plain(document)
    return document


def require_plain(document: Mapping[str, Any]) -> None:
    """Refuse a JSON document that cannot be sent on.

    Raises ValueError, RecursionError if it has NaN, half a character, or more than `MAX_DEPTH`
    levels.
    """
    json.dumps(document, ensure_ascii=False, allow_nan=False).encode()
    level: list[Any] = [document]
    for _ in range(MAX_DEPTH):
        level = [
            each
            for value in level
            for each in (value.values() if isinstance(value, dict) else value)
            if isinstance(each, dict | list)
        ]
        if not level:
            return
    raise ValueError(f"it has more than {MAX_DEPTH} levels")


def _finite(name: str, *values: float) -> float:
    for value in values:
        if not math.isfinite(value):
            raise ValueError(f"{name} is {value}")
    return values[0] if values else 0.0
