"""Messages as entities of Rerun; needs rerun-sdk."""

from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from transientcam.density import transient
from transientcam.frame import Frame
from transientcam.notebook import palette
from transientcam.robotics._messages import (
    DEPTH,
    RECTIFIED,
    Calibration,
    Image,
    Message,
    Points,
    Transform,
)
from transientcam.robotics._reports import Level

CAMERA: Final = "camera"
"""x right, y down, z where the camera looks; around it x is where it looks, and z up."""
PINHOLE: Final = "camera/image"
DEPTH_IMAGE: Final = "camera/image/depth"
POINTS: Final = "camera/points"
TRANSIENT: Final = "transient"
PREDICTED: Final = "deviation/predicted_m"
MEASURED: Final = "deviation/measured_m"
REPORTS: Final = "reports"
_LEVELS: Final[dict[Level, str]] = {"info": "INFO", "warning": "WARN", "error": "ERROR"}


def log_message(recording: rr.RecordingStream, message: Message) -> None:
    """Log a message: lens and pose once and for all, images and points at the present time."""
    match message:
        case Image(topic=topic, values=values) if topic in (DEPTH, RECTIFIED):
            recording.log(DEPTH_IMAGE, rr.DepthImage(values, meter=1.0))
        case Image(topic=topic, values=values):
            recording.log(f"images{topic}", rr.Image(values, color_model="L"))
        case Points(values=values):
            there = values[np.isfinite(values[..., 2])]
            recording.log(POINTS, rr.Points3D(there[:, :3], colors=_colours(there[:, 3:])))
        case Calibration(lens=lens):
            matrix = np.array(lens.matrix).reshape(3, 3)
            pinhole = rr.Pinhole(
                image_from_camera=matrix,
                resolution=[lens.width, lens.height],
                camera_xyz=rr.ViewCoordinates.RDF,
            )
            recording.log(PINHOLE, pinhole, static=True)
        case Transform(rotation_xyzw=rotation):
            recording.log("/", rr.ViewCoordinates.FLU, static=True)
            recording.log(
                CAMERA, rr.Transform3D(quaternion=rr.Quaternion(xyzw=rotation)), static=True
            )


def log_transient(recording: rr.RecordingStream, coefficients: Frame, bins: int) -> None:
    """Log the density in DN/s (bins, H, W) over the unambiguous time, and its times in s."""
    base_frequency_hz = coefficients.meta["base_frequency_hz"]
    time_s = np.arange(bins) / (bins * base_frequency_hz)
    light = transient(coefficients.array, time_s, base_frequency_hz=base_frequency_hz)
    recording.log(
        TRANSIENT,
        rr.Tensor(light, dim_names=("time", "y", "x")),
        rr.AnyValues(time_s=time_s),
    )


def log_report(recording: rr.RecordingStream, level: Level, text: str) -> None:
    """Log what happened beside frames."""
    recording.log(REPORTS, rr.TextLog(text, level=_LEVELS[level]))


def blueprint() -> rrb.Blueprint:
    """Return the views that fit what is logged here."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(origin="/", name="Points"),
            rrb.Vertical(
                rrb.Spatial2DView(origin=PINHOLE, name="Depth"),
                rrb.TensorView(origin=TRANSIENT, name="Transient"),
            ),
            rrb.Vertical(
                rrb.TimeSeriesView(origin="deviation", name="Deviation of the range in m"),
                rrb.TextLogView(origin=REPORTS, name="Reports"),
            ),
        )
    )


def _colours(intensity: NDArray[np.float32]) -> NDArray[np.uint8] | None:
    """Return colours (N, 3) of intensities (N, 1), up to the 99th percentile; None without any."""
    if not intensity.size:
        return None
    white = max(float(np.nanpercentile(intensity, 99)), 1e-30)
    share = np.sqrt(np.clip(np.nan_to_num(intensity[:, 0] / white), 0.0, 1.0))
    table: NDArray[Any] = np.frombuffer(palette(), np.uint8).reshape(256, 3)
    return np.asarray(table[1 + np.rint(254.0 * share).astype(np.intp)], dtype=np.uint8)
