"""Calibration measurements: captured with a camera, kept in a file, good for one sequence.

The images are taken while the light shines at the sensor through a filter and a diffusor, so that
every pixel should measure the same at every frequency (Peters et al. 2015, Sec. 4.2). What
follows from them is arithmetic, and left to others.
"""

import hashlib
import io
import json
import zipfile
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import Camera
from transientcam_driver.capabilities import AppliedSequence, Capabilities
from transientcam_driver.errors import (
    CalibrationFileError,
    CalibrationMismatch,
    CameraError,
    DriverError,
    SequenceError,
)
from transientcam_driver.frames import RawFrame
from transientcam_driver.sequence import Sequence

DEFAULT_TAKES = 40
"""Of the paper's calibration measurements."""
DEVICE_FIELDS = ("serial", "width", "height")
"""Fields of a mismatch that no other sequence makes good."""
FORMAT = 1
_FRAME_PATIENCE = 5.0  # times as long as a frame takes, and at least:
_LEAST_PATIENCE_S = 10.0

Averaging = Callable[[NDArray[np.uint16]], tuple[NDArray[Any], NDArray[np.bool_]]]
"""From takes of one image (takes, 1, H, W) to their mean (1, H, W), and which were kept
(takes, 1)."""
Progress = Callable[[int, int], None]
"""Told how many frames are captured, of how many."""


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationCapture:
    """The images of a calibration measurement, and what they are good for.

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
    """

    images: NDArray[np.float32]
    kept: NDArray[np.bool_]
    sequence: Sequence
    low_frequency_hz: float
    serial: str
    model: str
    firmware: str
    temperature_c: float
    captured_unix_s: float
    dark: NDArray[np.float32] | None = None
    dark_deviation: NDArray[np.float32] | None = None

    @property
    def id(self) -> str:
        """Name of this measurement: its camera's serial number, and a digest of all it holds."""
        digest = hashlib.sha256(json.dumps(self._document(), sort_keys=True).encode())
        for array in self._arrays().values():
            digest.update(np.ascontiguousarray(array).tobytes())
        return f"{self.serial}-{digest.hexdigest()[:12]}"

    @property
    def rejected_images(self) -> int:
        """How many images were left out of the averages."""
        return int(np.count_nonzero(~self.kept))

    def misfit(
        self, applied: AppliedSequence, capabilities: Capabilities
    ) -> CalibrationMismatch | None:
        """Say why this measurement is not good for what a camera captures; None where it is.

        The number and order of takes do not matter: each image is the same in all of them.
        """
        sequence, mine = applied.sequence, self.sequence
        compared: list[tuple[str, object, object]] = [
            ("serial", capabilities.serial, self.serial),
            ("width", capabilities.width, self.images.shape[2]),
            ("height", capabilities.height, self.images.shape[1]),
            ("base_frequency_hz", sequence.base_frequency_hz, mine.base_frequency_hz),
            ("harmonics", sequence.harmonics, mine.harmonics),
            ("zeroth", sequence.zeroth, mine.zeroth),
            ("exposure_s", sequence.exposure_s, mine.exposure_s),
            ("sub_phases.scheme", sequence.sub_phases.scheme, mine.sub_phases.scheme),
            ("sub_phases.n", sequence.sub_phases.n, mine.sub_phases.n),
        ]
        if sequence.zeroth == "low-frequency":
            compared.append(("low_frequency_hz", applied.low_frequency_hz, self.low_frequency_hz))
        for field, value, needed in compared:
            if value != needed:
                return CalibrationMismatch(field, value, needed)
        return None

    def require_fit(self, applied: AppliedSequence, capabilities: Capabilities) -> None:
        """Refuse what this measurement is not good for.

        Raises
        ------
        CalibrationMismatch
            Naming the field that differs.
        """
        if (mismatch := self.misfit(applied, capabilities)) is not None:
            raise mismatch

    def save(self, path: Path) -> None:
        """Write an .npz: arrays, and a JSON document beside them."""
        document = np.array(json.dumps({"format": FORMAT} | self._document()))
        with path.open("wb") as file:  # a path without .npz would be given one
            np.savez_compressed(file, document=document, **self._arrays())  # type: ignore[arg-type]  # numpy types its keywords as flags

    @classmethod
    def load(cls, path: Path) -> "CalibrationCapture":
        """Read an .npz that ``save`` has written.

        Raises
        ------
        CalibrationFileError
            Naming the file, what in it is wrong, and what it should be.
        """
        try:
            # numpy leaves a file open that it cannot make sense of
            with path.open("rb") as file, zipfile.ZipFile(file) as archive:
                content = {
                    name.removesuffix(".npy"): np.load(
                        io.BytesIO(archive.read(name)), allow_pickle=False
                    )
                    for name in archive.namelist()
                }
        except (OSError, ValueError, EOFError, zlib.error, zipfile.BadZipFile) as error:
            raise CalibrationFileError(path, "the file", str(error), "an .npz") from error
        return _checked(path, content)

    def _arrays(self) -> dict[str, NDArray[Any]]:
        arrays: dict[str, NDArray[Any]] = {"images": self.images, "kept": self.kept}
        if self.dark is not None and self.dark_deviation is not None:
            arrays |= {"dark": self.dark, "dark_deviation": self.dark_deviation}
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


def mean_of_takes(takes: NDArray[np.uint16]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Average takes (takes, N, H, W), keeping every image."""
    return takes.mean(axis=0), np.ones(takes.shape[:2], dtype=bool)


def capture_calibration(
    camera: Camera,
    *,
    takes: int = DEFAULT_TAKES,
    average: Averaging = mean_of_takes,
    progress: Progress | None = None,
) -> CalibrationCapture:
    """Measure with the camera's present sequence while its light shines at the sensor (Sec. 4.2).

    Dark images come first, with the same exposure. The sequence is then restored, and the light
    is off.

    Parameters
    ----------
    camera
        Idle; nobody else reads from it meanwhile.
    takes
        How often each image is captured, from 2.
    average
        How takes become one image; their mean without a better idea.
    progress
        Told after each frame.

    Raises
    ------
    SequenceError
        For less than two takes.
    CameraError
        The camera was lost, or gives no frames.
    """
    if takes < 2:
        raise SequenceError("takes", takes, "at least 2 for a calibration")
    before = camera.applied.sequence
    single = replace(before, takes=1, take_order="sequential")
    in_the_dark = replace(single, harmonics=1, zeroth="on-off")
    with_dark = "on-off" in camera.capabilities.zeroths
    total = takes * (1 + with_dark)

    def tell(done: int) -> None:
        if progress is not None:
            progress(done, total)

    try:
        dark = _dark(_frames(camera, in_the_dark, takes, tell)) if with_dark else None
        frames = _frames(camera, single, takes, lambda done: tell(total - takes + done))
        applied = camera.applied
        camera.configure(before)
    finally:
        with suppress(CameraError):  # a lost camera's light is its own watchdog's
            camera.stop()
    # image by image, so that the takes of a large sensor never stand in memory twice
    averaged = [
        average(np.stack([frame.images[k : k + 1] for frame in frames]))
        for k in range(applied.images)
    ]
    return CalibrationCapture(
        images=np.concatenate([images for images, _ in averaged]).astype(np.float32),
        kept=np.concatenate([kept for _, kept in averaged], axis=1),
        sequence=applied.sequence,
        low_frequency_hz=applied.low_frequency_hz,
        serial=camera.capabilities.serial,
        model=camera.capabilities.model,
        firmware=camera.capabilities.firmware,
        temperature_c=float(np.mean([frame.temperature_c for frame in frames])),
        captured_unix_s=frames[-1].host_time_s,
        dark=None if dark is None else dark.mean(axis=0),
        dark_deviation=None if dark is None else dark.std(axis=0, ddof=1),
    )


def _frames(
    camera: Camera, sequence: Sequence, takes: int, tell: Callable[[int], None]
) -> list[RawFrame]:
    applied = camera.configure(sequence)
    timeout_s = max(_LEAST_PATIENCE_S, _FRAME_PATIENCE / applied.frame_rate_hz)
    frames = []
    camera.start()
    for taken in range(takes):
        frames.append(camera.read_frame(timeout_s=timeout_s))
        tell(taken + 1)
    camera.stop()
    return frames


def _dark(frames: list[RawFrame]) -> NDArray[np.float32]:
    """Return the images without light, one of each frame."""
    (dark,) = (label.index for label in frames[0].labels if not label.illumination)
    return np.stack([frame.images[dark] for frame in frames]).astype(np.float32)


def _checked(path: Path, content: Mapping[str, NDArray[Any]]) -> CalibrationCapture:
    document = _document_in(path, content)
    try:
        sequence = Sequence.from_document(document["sequence"])
        fields: dict[str, Any] = {
            name: str(document[name]) for name in ("serial", "model", "firmware")
        }
        for name in ("low_frequency_hz", "temperature_c", "captured_unix_s"):
            fields[name] = float(document[name])
    except KeyError as error:
        raise CalibrationFileError(path, "document", f"without {error}", "complete") from error
    except (DriverError, TypeError, ValueError) as error:
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
    )


def _document_in(path: Path, content: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    if "document" not in content:
        expected = "a calibration written by `transientcam calibrate`"
        raise CalibrationFileError(path, "document", "absent", expected)
    try:
        document = json.loads(str(content["document"]))
    except ValueError as error:
        raise CalibrationFileError(path, "document", str(error), "JSON") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        found = document.get("format") if isinstance(document, dict) else type(document).__name__
        raise CalibrationFileError(path, "format", found, FORMAT)
    return document


def _array(
    path: Path,
    content: Mapping[str, NDArray[Any]],
    name: str,
    dtype: Any,
    shape: tuple[int | None, ...],
) -> NDArray[Any]:
    wanted = f"{np.dtype(dtype)} of shape {tuple('any' if n is None else n for n in shape)}"
    if name not in content:
        raise CalibrationFileError(path, name, "absent", wanted)
    array = content[name]
    fits = array.ndim == len(shape) and all(
        length == needed or needed is None
        for length, needed in zip(array.shape, shape, strict=False)
    )
    if array.dtype != dtype or not fits or not array.size:
        raise CalibrationFileError(path, name, f"{array.dtype} of shape {array.shape}", wanted)
    return array
