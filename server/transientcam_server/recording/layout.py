"""What a recording holds and where: raw images, their labels, one series a property of a frame.

docs/recordings.md describes the same for other programs.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any, Final, get_type_hints

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from transientcam_driver import AppliedSequence, Capabilities, ImageLabel, RawFrame, Sequence
from transientcam_server.imaging.calibration import Gains
from transientcam_server.imaging.labelling import Column, image_columns, moment_columns
from transientcam_server.recording import swmr

FORMAT: Final = "transientcam recording"
FORMAT_VERSION: Final = 1
SUFFIX: Final = ".h5"
PART_SUFFIX: Final = ".h5.part"
ANNOTATIONS_BYTES: Final = 16 * 1024
END_BYTES: Final = 4 * 1024

SERIES: Final[dict[str, tuple[str, dict[str, str]]]] = {
    "epoch": ("<u4", {"long_name": "configuration epoch of the device"}),
    "device_time_s": ("<f8", {"units": "s", "long_name": "begin of the first exposure"}),
    "host_time_s": ("<f8", {"units": "s", "long_name": "arrival of the last image, Unix time"}),
    "capture_s": ("<f8", {"units": "s", "long_name": "first exposure to last read-out"}),
    "temperature_c": ("<f8", {"units": "degC", "long_name": "temperature of the sensor"}),
    "lost_images": ("<i8", {"units": "1", "long_name": "images lost on the cable before"}),
    "dropped_frames": ("<i8", {"units": "1", "long_name": "frames the recorder dropped before"}),
    "crc32": ("<u4", {"long_name": "CRC-32 of the images' uint16 values, little endian"}),
    "frame": ("<u8", {"units": "1", "long_name": "frame counter of the device"}),
}
"""One value a frame: type and attributes. ``frame`` is written last: it counts the frames."""
ROW_AXIS: Final = "frame"
_AXES: Final = ("frame", "image", "y", "x")
_LABELS: Final = tuple(each.name for each in fields(ImageLabel) if each.name != "index")


@dataclass(frozen=True)
class Header:
    """What is known before the first frame.

    Attributes
    ----------
    recording_id, name
        Its id in the service, and its name for people.
    started_s
        Unix time.
    applied
        The sequence as the camera really set it.
    capabilities
        Of the camera.
    camera
        How it was opened, and which scene it simulates.
    calibration
        Of the moments: its id, and further properties where known.
    calibration_planes
        complex (m+1,) or (m+1, H, W): what moments are divided by; None for the nominal gains.
    calibration_bad
        bool (H, W): pixels that show their neighbours' mean instead.
    reconstruction
        Settings at the time of recording.
    versions
        Of the software.
    """

    recording_id: str
    name: str
    started_s: float
    applied: AppliedSequence
    capabilities: Capabilities
    camera: Mapping[str, Any] = field(default_factory=dict)
    calibration: Mapping[str, Any] = field(default_factory=lambda: {"id": "nominal"})
    calibration_planes: NDArray[np.complexfloating[Any, Any]] | None = None
    calibration_bad: NDArray[np.bool_] | None = None
    reconstruction: Mapping[str, Any] = field(default_factory=dict)
    versions: Mapping[str, str] = field(
        default_factory=lambda: {name: version(name) for name in ("transientcam", "h5py", "numpy")}
    )

    @property
    def gains(self) -> Gains | None:
        """The measured gains; None for the nominal ones."""
        if self.calibration_planes is None:
            return None
        name = str(self.calibration.get("id", "recorded"))
        return Gains(name, self.calibration_planes, self.calibration_bad)


def checksum(images: NDArray[np.uint16]) -> int:
    """Return the CRC-32 of images as they are stored."""
    return isal_zlib.crc32(np.ascontiguousarray(images, dtype="<u2").data.cast("B"))


def create(file: swmr.File, header: Header, annotations: Mapping[str, Any]) -> None:
    """Lay out an empty recording, complete but for its frames."""
    capabilities, labels = header.capabilities, header.applied.labels
    file.attrs.update(
        {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "Conventions": "CF-1.11",
            "title": header.name,
            "recording_id": header.recording_id,
            "started": datetime.fromtimestamp(header.started_s, UTC).isoformat(),
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
    for name, (dtype, attributes) in SERIES.items():
        swmr.create_series(file, name, dtype, **attributes)
    for name, size in zip(("image", "y", "x"), shape, strict=True):
        file.create_dataset(name, data=np.arange(size, dtype="<i4"))
    for name in _AXES:
        file[name].make_scale(name)
    _create_columns(file, image_columns(labels))
    _create_columns(file, moment_columns(header.applied.sequence, labels, header.gains))
    if header.calibration_planes is not None:
        # names that readers of the first version of this format look for, of the same datasets
        file["calibration_planes"] = file["gain"]
        if "bad" in file:
            file["calibration_bad"] = file["bad"]
    file.create_dataset("annotations", data=encoded(annotations), dtype=f"S{ANNOTATIONS_BYTES}")
    file.create_dataset("end", data=b"", dtype=f"S{END_BYTES}")
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
    for name in SERIES.keys() - {ROW_AXIS}:
        file[name].dims[0].attach_scale(file["frame"])


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
        "temperature_c": raw.temperature_c,
        "lost_images": raw.lost_images,
        "dropped_frames": dropped_frames,
        "crc32": checksum(raw.images),
        "frame": raw.number,
    }


def read_header(file: swmr.File) -> Header:
    """Return what `create` wrote.

    Raises
    ------
    KeyError, TypeError, ValueError, DriverError
        If the file is no recording, or one of a newer format.
    """
    attributes = file.attrs
    if attributes["format"] != FORMAT:
        raise ValueError(f"its format is {attributes['format']!r}")
    if int(attributes["format_version"]) != FORMAT_VERSION:
        raise ValueError(f"its format has version {attributes['format_version']}")
    capabilities = _capabilities(json.loads(attributes["capabilities"]))
    document = json.loads(attributes["sequence"])
    applied = capabilities.describe(
        Sequence.from_document(document), epoch=int(document["sequence_id"])
    )
    planes = file["calibration_planes"][()] if "calibration_planes" in file else None
    bad = file["calibration_bad"][()].astype(bool) if "calibration_bad" in file else None
    return Header(
        recording_id=str(attributes["recording_id"]),
        name=str(attributes["title"]),
        started_s=float(attributes["started_s"]),
        applied=applied,
        capabilities=capabilities,
        camera=json.loads(attributes["camera"]),
        calibration=json.loads(attributes["calibration"]),
        calibration_planes=planes,
        calibration_bad=bad,
        reconstruction=json.loads(attributes["reconstruction"]),
        versions=json.loads(attributes["versions"]),
    )


def _capabilities(document: Mapping[str, Any]) -> Capabilities:
    names = get_type_hints(Capabilities)
    given: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value  # JSON has no tuples
        for name, value in document.items()
        if name in names
    }
    return Capabilities(**given)


def read_labels(file: swmr.File) -> tuple[ImageLabel, ...]:
    """Return what each image shows."""
    columns = {name: file[name][()].tolist() for name in _LABELS}
    columns["index"] = list(range(file["raw"].shape[1]))
    columns["illumination"] = [bool(lit) for lit in columns["illumination"]]
    return tuple(
        ImageLabel(**{name: values[k] for name, values in columns.items()})
        for k in columns["index"]
    )


def read_document(file: swmr.File, name: str) -> dict[str, Any]:
    """Return a JSON document in a scalar dataset; empty where none was written or it is torn."""
    try:
        document = json.loads(bytes(file[name][()]).rstrip(b"\0") or b"{}")
    except ValueError:
        return {}
    return document if isinstance(document, dict) else {}
