"""Raw frames of a Kinect v2 in the layout of felja633/kinectv2_decoders, as a recording.

Such a file has the camera's answer with its P0 tables in ``/P0Tables``, and of each frame the
sub-images, one behind the other, in ``/Frame_0/Ir``, ``/Frame_1/Ir`` and so on: arrays of bytes.
Neither times nor the lens are in it; a lens is in a file of its own, in
``leader_calibration_parameters``.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Lens, ProtocolError, RawFrame, Sequence
from transientcam_driver.cameras import kinect2
from transientcam_server.errors import InputError
from transientcam_server.imaging import FACTORY_ID, Intrinsics
from transientcam_server.recording import Header, RecordingWriter, open_unknown
from transientcam_server.settings import ReconstructionSettings

Progress = Callable[[int, int], None]
SETTINGS: Final = ReconstructionSettings(estimator="two-returns", neighbours="none")
"""Of the reconstruction, for what is computed without haste."""
LENS: Final = "leader_calibration_parameters"
_FRAME: Final = re.compile(r"Frame_(\d{1,9})")
_LONGEST_ANSWER: Final = 0x1C0000  # what libfreenect2 asks for


def import_kinect2(
    source: Path,
    output: Path,
    *,
    lens: Lens | None = None,
    progress: Progress = lambda done, total: None,
) -> int:
    """Write the frames of a file into a recording, and return how many they are.

    ``lens``: of that camera, see `read_lens`.
    Raises InputError naming what of the file is not as expected; no recording is left. Raises
    FileExistsError if the output is there already. Raises OSError if a file cannot be read or
    written.
    """
    began_s = source.stat().st_mtime
    size: Any = {"width": kinect2.WIDTH, "height": kinect2.HEIGHT}
    seen = None if lens is None else Intrinsics.of_lens(lens, **size, source="camera")
    with _opened(source) as file:
        tables = _tables(file, source)
        numbers = _frames(file, source)
        identity = kinect2.Identity("not recorded", source.stem[:64], b"", b"")
        capabilities = kinect2.capabilities_of(identity)
        applied = capabilities.apply(capabilities.nearest(Sequence()), epoch=1)
        header = Header(
            recording_id=re.sub(r"[^A-Za-z0-9_-]+", "-", f"import-{source.stem}")[:128],
            name=source.stem,
            started_s=began_s,
            applied=applied,
            capabilities=capabilities,
            camera={"spec": f"import-kinect2 {source.name}", "scene": None}
            | ({} if seen is None else {"intrinsics": asdict(seen)}),
            calibration={"id": FACTORY_ID},
            calibration_planes=tables.gains(),
            reconstruction=SETTINGS.model_dump(),
        )
        writer = RecordingWriter(output, header)
        try:
            for done, number in enumerate(numbers, start=1):
                sub_images = _sub_images(file, source, number)
                time_s = (number - numbers[0]) / kinect2.FRAME_RATE_HZ
                writer.append(
                    RawFrame(
                        number=number,
                        epoch=applied.epoch,
                        images=kinect2.codes.frame_images(sub_images[: kinect2.MEASURED]),
                        labels=applied.labels,
                        device_time_s=time_s,
                        host_time_s=began_s + time_s,
                        capture_s=1 / kinect2.FRAME_RATE_HZ,
                        temperature_c=None,
                        lost_images=0,
                    )
                )
                progress(done, len(numbers))
        except BaseException:
            with suppress(OSError):  # which may be what it failed by
                writer.close({"reason": "failed"})
            for left in (writer.part, output):
                left.unlink(missing_ok=True)
            raise
        writer.close({"reason": "imported"})
    return len(numbers)


def read_lens(path: Path, rows: kinect2.Rows = "top") -> Lens:
    """Read the lens of the depth camera from a file of calibrations.

    Raises InputError naming what of the file is not as expected; OSError if it cannot be read.
    """
    with _opened(path) as file:
        if LENS not in file:
            raise InputError(str(path), LENS, "absent", "a calibration of the depth camera")
        try:
            stored = file[LENS][0]
            k1, k2, p1, p2, k3 = (float(each) for each in stored["distortion_coefficients"][:5])
            fx, _, cx, _, fy, cy, *_ = (float(each) for each in stored["intrinsic_camera_matrix"])
            return kinect2.DepthParameters(fx, fy, cx, cy, k1, k2, p1, p2, k3).lens(rows)
        except (ValueError, TypeError, IndexError) as error:
            expected = "five coefficients of distortion and a matrix of 3 x 3"
            raise InputError(str(path), LENS, str(error), expected) from error


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open an HDF5 file; h5py says that it is none by an OSError without a number."""
    with path.open("rb"):  # an error of the system is said as such
        pass
    with ExitStack() as opened:
        try:
            file = opened.enter_context(open_unknown(path))
        except (OSError, ValueError) as error:
            raise InputError(str(path), "the file", "not readable as HDF5", "HDF5") from error
        yield file


def _bytes(file: Any, path: Path, name: str, least: int, most: int) -> NDArray[np.uint8]:
    """Return an array of bytes; nothing is read before its size is known to be possible."""
    expected = f"an array of {least} to {most} bytes"
    try:
        dataset = file[name]
        shape, dtype = dataset.shape, dataset.dtype
    except (KeyError, AttributeError) as error:
        raise InputError(str(path), name, "absent", expected) from error
    if len(shape) != 1 or dtype.itemsize != 1 or not least <= shape[0] <= most:
        raise InputError(str(path), name, f"{dtype} of shape {shape}", expected)
    try:
        values: NDArray[Any] = dataset[()]
    except (OSError, RuntimeError) as error:
        raise InputError(str(path), name, "damaged", expected) from error
    return values.view(np.uint8)


def _tables(file: Any, path: Path) -> kinect2.P0Tables:
    response = _bytes(file, path, "P0Tables", kinect2.RESPONSE_BYTES, _LONGEST_ANSWER)
    try:
        return kinect2.P0Tables.unpack(response.tobytes())
    except ProtocolError as error:
        raise InputError(str(path), "P0Tables", str(error), "the camera's answer") from error


def _frames(file: Any, path: Path) -> list[int]:
    """Return the numbers of the frames, ascending."""
    found = sorted(int(match[1]) for match in map(_FRAME.fullmatch, file) if match)
    if not found:
        raise InputError(str(path), "Frame_0/Ir", "absent", "the sub-images of a frame")
    return found


def _sub_images(file: Any, path: Path, number: int) -> NDArray[np.uint8]:
    name = f"Frame_{number}/Ir"
    data = _bytes(
        file,
        path,
        name,
        kinect2.MEASURED * kinect2.SUB_IMAGE_BYTES,
        kinect2.SUB_IMAGES * kinect2.SUB_IMAGE_BYTES,
    )
    if len(data) % kinect2.SUB_IMAGE_BYTES:
        count = f"{kinect2.MEASURED} or {kinect2.SUB_IMAGES}"
        expected = f"{count} sub-images of {kinect2.SUB_IMAGE_BYTES} bytes"
        raise InputError(str(path), name, f"{len(data)} bytes", expected)
    return data.reshape((-1, kinect2.SUB_IMAGE_BYTES))
