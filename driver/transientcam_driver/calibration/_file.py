"""Calibration measurements in a file, each valid for one camera and sequence.

The calibration itself is computed from them by others; nothing here does arithmetic.
"""

import hashlib
import io
import json
import math
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import AppliedSequence, Capabilities
from transientcam_driver.errors import CalibrationFileError, CalibrationMismatch, DriverError
from transientcam_driver.sequence import Sequence

DEVICE_FIELDS = ("serial", "width", "height")
"""Fields of a mismatch that another sequence cannot resolve."""
FORMATS = (1, 2)
"""Of files: without and with the harmonics of the modulation."""
MAX_WAVEFORM = 64
"""Harmonics in a file."""
MAX_BYTES = 1024**3
"""Of the content of a file, unpacked."""
MAX_DN = 65535
"""Largest value of an image."""
MAX_TEXT = 200
"""Characters of a name or number in one."""


@dataclass(frozen=True, slots=True)
class CalibrationSubject:
    """What a calibration measurement is valid for: a camera, and a sequence."""

    serial: str
    width: int
    height: int
    sequence: Sequence
    low_frequency_hz: float

    def misfit(
        self, applied: AppliedSequence, capabilities: Capabilities
    ) -> CalibrationMismatch | None:
        """Return why the measurement is not valid for what a camera captures; None where it is.

        The number and order of takes do not matter: each image is the same in all of them.
        """
        sequence, measured = applied.sequence, self.sequence
        compared: list[tuple[str, object, object]] = [
            ("serial", capabilities.serial, self.serial),
            ("width", capabilities.width, self.width),
            ("height", capabilities.height, self.height),
            ("base_frequency_hz", sequence.base_frequency_hz, measured.base_frequency_hz),
            ("harmonics", sequence.harmonics, measured.harmonics),
            ("sampling", sequence.sampling.to_document(), measured.sampling.to_document()),
            ("zeroth", sequence.zeroth, measured.zeroth),
            ("exposure_s", sequence.exposure_s, measured.exposure_s),
            ("sub_phases.scheme", sequence.sub_phases.scheme, measured.sub_phases.scheme),
            ("sub_phases.n", sequence.sub_phases.n, measured.sub_phases.n),
        ]
        if sequence.zeroth == "low-frequency":
            compared.append(("low_frequency_hz", applied.low_frequency_hz, self.low_frequency_hz))
        for name, value, needed in compared:
            if value != needed:
                return CalibrationMismatch(name, value, needed)
        return None


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationCapture:
    """The images of a calibration measurement, and what they are valid for.

    Attributes
    ----------
    images
        float32 (N, H, W) in DN: of one take, each averaged over the takes kept.
    kept
        bool (takes, N): which image of which take went into the average.
    sequence
        What was really set, with a single take.
    low_frequency_hz
        At which the zeroth moment was measured, if by the low frequency.
    serial, model, firmware
        Of the camera.
    temperature_c
        Of the sensor, mean over the takes.
    captured_unix_s
        When the last take arrived.
    dark, dark_deviation
        float32 (H, W) in DN: mean and standard deviation of images without light at the same
        exposure; None where the camera cannot take any.
    notes
        Further entries of the file, as JSON; its id does not depend on them.
    waveform
        complex128 (m, K): odd harmonics 3, 5, ... of the modulation at each frequency relative to
        the fundamental, from a phase sweep; None without a usable one.
    """

    images: NDArray[np.float32]
    kept: NDArray[np.bool_]
    sequence: Sequence
    low_frequency_hz: float
    serial: str
    model: str
    firmware: str
    temperature_c: float | None
    captured_unix_s: float
    dark: NDArray[np.float32] | None = None
    dark_deviation: NDArray[np.float32] | None = None
    notes: Mapping[str, Any] = field(default_factory=dict)
    waveform: NDArray[np.complex128] | None = None

    @property
    def id(self) -> str:
        """Name of this measurement: its camera's serial number, and a digest of all it holds."""
        digest = hashlib.sha256(json.dumps(self._document(), sort_keys=True).encode())
        for array in self._arrays().values():
            digest.update(np.ascontiguousarray(array).tobytes())
        # it is used in URLs and file names
        serial = re.sub(r"[^A-Za-z0-9-]+", "-", self.serial).strip("-")
        return f"{serial or 'camera'}-{digest.hexdigest()[:12]}"

    @property
    def rejected_images(self) -> int:
        """Number of images left out of the averages."""
        return int(np.count_nonzero(~self.kept))

    @property
    def subject(self) -> CalibrationSubject:
        """What this measurement is valid for."""
        height, width = self.images.shape[1:]
        return CalibrationSubject(self.serial, width, height, self.sequence, self.low_frequency_hz)

    def misfit(
        self, applied: AppliedSequence, capabilities: Capabilities
    ) -> CalibrationMismatch | None:
        """Return why it is not valid for a camera's sequence; see `CalibrationSubject.misfit`."""
        return self.subject.misfit(applied, capabilities)

    def require_fit(self, applied: AppliedSequence, capabilities: Capabilities) -> None:
        """Refuse a camera or sequence that this measurement is not valid for.

        Raises
        ------
        CalibrationMismatch
            Naming the field that differs.
        """
        if (mismatch := self.misfit(applied, capabilities)) is not None:
            raise mismatch

    def save(self, path: Path) -> None:
        """Write an .npz: arrays, and a JSON document beside them."""
        content = (
            {"format": FORMATS[self.waveform is not None]}
            | self._document()
            | {"notes": dict(self.notes)}
        )
        document = np.array(json.dumps(content))
        with path.open("wb") as file:  # a path without .npz would be given one
            np.savez_compressed(file, document=document, **self._arrays())  # type: ignore[arg-type]  # numpy types its keywords as flags

    @classmethod
    def load(cls, path: Path, *, max_bytes: int = MAX_BYTES) -> "CalibrationCapture":
        """Read an .npz that ``save`` has written, and that holds no more than ``max_bytes``.

        Raises
        ------
        CalibrationFileError
            Naming the file, the entry that is not valid, and the expected one.
        """
        try:
            # numpy does not close a file that it cannot read
            with path.open("rb") as file, zipfile.ZipFile(file) as archive:
                size = sum(member.file_size for member in archive.infolist())
                if size > max_bytes:  # before any of it is unpacked
                    raise CalibrationFileError(
                        path, "the file", f"{size} bytes unpacked", f"at most {max_bytes}"
                    )
                content = {
                    each.filename.removesuffix(".npy"): _unpacked(_read(archive, each))
                    for each in archive.infolist()
                }
            return _checked(path, content)
        except CalibrationFileError:
            raise
        except Exception as error:  # parsers of others raise what their authors did not think of
            raise CalibrationFileError(path, "the file", str(error), "an .npz") from error

    def _arrays(self) -> dict[str, NDArray[Any]]:
        arrays: dict[str, NDArray[Any]] = {"images": self.images, "kept": self.kept}
        if self.dark is not None and self.dark_deviation is not None:
            arrays |= {"dark": self.dark, "dark_deviation": self.dark_deviation}
        if self.waveform is not None:
            arrays["waveform"] = self.waveform
        return arrays

    def _document(self) -> dict[str, Any]:
        return {
            "sequence": self.sequence.to_document(),
            "low_frequency_hz": self.low_frequency_hz,
            "serial": self.serial,
            "model": self.model,
            "firmware": self.firmware,
            "temperature_c": self.temperature_c,
            "captured_unix_s": self.captured_unix_s,
        }


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytes:
    """Return a file of an archive, of the stated size at most however much it would unpack to."""
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError("a file that is neither stored nor deflated")
    with archive.open(member) as stream:
        data = stream.read(member.file_size)
    if len(data) != member.file_size:
        raise ValueError(f"{len(data)} bytes of {member.file_size}")
    return data


def _unpacked(data: bytes) -> NDArray[Any]:
    """Return the array in an .npy; its header is checked before memory is allocated."""
    stream = io.BytesIO(data)
    read_header = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(np.lib.format.read_magic(stream))
    if read_header is None:
        raise ValueError("an array of another version")
    shape, _, dtype = read_header(stream)
    if math.prod(shape) * dtype.itemsize != len(data) - stream.tell():
        raise ValueError(f"{len(data)} bytes for an array of shape {shape}")
    array: NDArray[Any] = np.load(io.BytesIO(data), allow_pickle=False)
    return array


def _text(value: object) -> str:
    text = str(value)
    if len(text) > MAX_TEXT or not text.isprintable():
        raise ValueError(f"no text of up to {MAX_TEXT} characters: {text[:MAX_TEXT]!r}")
    return text


def _number(value: Any) -> float:
    number = float(value)
    if isinstance(value, bool) or not math.isfinite(number):
        raise ValueError(f"no number: {value}")
    return number


def _checked(path: Path, content: Mapping[str, NDArray[Any]]) -> CalibrationCapture:
    document = _document_in(path, content)
    try:
        sequence = Sequence.from_document(document["sequence"])
        fields: dict[str, Any] = {
            name: _text(document[name]) for name in ("serial", "model", "firmware")
        }
        for name in ("low_frequency_hz", "temperature_c", "captured_unix_s"):
            unknown = name == "temperature_c" and document[name] is None
            fields[name] = None if unknown else _number(document[name])
        fields["notes"] = dict(document.get("notes", {}))
    except KeyError as error:
        raise CalibrationFileError(path, "document", f"without {error}", "complete") from error
    except (DriverError, TypeError, ValueError, OverflowError) as error:
        raise CalibrationFileError(path, "document", str(error), "as it was written") from error
    images = _array(path, content, "images", np.float32, (sequence.images, None, None))
    kept = _array(path, content, "kept", np.bool_, (None, sequence.images))
    dark = deviation = None
    if "dark" in content:
        dark = _array(path, content, "dark", np.float32, images.shape[1:])
        deviation = _array(path, content, "dark_deviation", np.float32, images.shape[1:])
    return CalibrationCapture(
        images=images,
        kept=kept,
        sequence=sequence,
        **fields,
        dark=dark,
        dark_deviation=deviation,
        waveform=_waveform(path, content, sequence.harmonics),
    )


def _document_in(path: Path, content: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    if "document" not in content:
        expected = "a calibration written by `transientcam calibrate`"
        raise CalibrationFileError(path, "document", "absent", expected)
    try:
        document = json.loads(str(content["document"]))
    except (ValueError, RecursionError) as error:
        raise CalibrationFileError(path, "document", str(error), "JSON") from error
    if not isinstance(document, dict) or document.get("format") not in FORMATS:
        found = document.get("format") if isinstance(document, dict) else type(document).__name__
        raise CalibrationFileError(path, "format", found, " or ".join(map(str, FORMATS)))
    return document


def _waveform(
    path: Path, content: Mapping[str, NDArray[Any]], harmonics: int
) -> NDArray[np.complex128] | None:
    if "waveform" not in content:
        return None
    array = content["waveform"]
    fits = array.ndim == 2 and len(array) == harmonics and array.shape[1] <= MAX_WAVEFORM
    if array.dtype != np.complex128 or not fits or not np.isfinite(array).all():
        found = f"{array.dtype} of shape {array.shape}"
        expected = f"finite complex128 of shape ({harmonics}, at most {MAX_WAVEFORM})"
        raise CalibrationFileError(path, "waveform", found, expected)
    return array


def _array(
    path: Path,
    content: Mapping[str, NDArray[Any]],
    name: str,
    dtype: Any,
    shape: tuple[int | None, ...],
) -> NDArray[Any]:
    expected = f"{np.dtype(dtype)} of shape {tuple('any' if n is None else n for n in shape)}"
    if name not in content:
        raise CalibrationFileError(path, name, "absent", expected)
    array = content[name]
    fits = array.ndim == len(shape) and all(
        length == needed or needed is None
        for length, needed in zip(array.shape, shape, strict=False)
    )
    if array.dtype != dtype or not fits or not array.size:
        raise CalibrationFileError(path, name, f"{array.dtype} of shape {array.shape}", expected)
    # means and deviations of a converter's codes; a comparison with NaN is false
    if not (array.min() >= 0 and array.max() <= MAX_DN):
        found = f"from {array.min()} to {array.max()}"
        raise CalibrationFileError(path, name, found, f"from 0 to {MAX_DN}")
    return array
