"""A camera's frames, live or into a file, for the viewer Rerun."""

from collections import deque
from collections.abc import Callable, Sequence
from math import inf
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from transientcam.camera import Camera
from transientcam.density import transient
from transientcam.frame import Frame
from transientcam.notebook import palette
from transientcam.robotics._messages import (
    DEPTH,
    RECTIFIED,
    Calibration,
    Image,
    Message,
    Pinhole,
    Points,
    Transform,
    messages_of,
)
from transientcam.robotics._reports import Level, Report
from transientcam.robotics._source import Source, captured_s, require_viewable
from transientcam.wire import Subscription

FRAMES: Final = 16
"""How many frames are compared."""
_SAME: Final = ("sequence_id", "calibration_id", "reconstruction_id", "region", "decimation")


class Scatter:
    """The standard deviation of a product over its last `FRAMES` frames.

    What moves in the scene is in it, too.
    """

    def __init__(self) -> None:
        self._arrays: deque[NDArray[np.float64]] = deque(maxlen=FRAMES)
        self._settings: tuple[object, ...] | None = None

    def add(self, frame: Frame) -> float | None:
        """Return the median over the pixels of the standard deviation, in the product's unit.

        None until there are `FRAMES` frames of the same settings, and where no pixel has a value in
        all of them.
        """
        settings = tuple(frame.meta.get(name) for name in _SAME)
        if settings != self._settings:
            self._settings = settings
            self._arrays.clear()
        self._arrays.append(np.asarray(frame.array, dtype=np.float64))
        if len(self._arrays) < FRAMES:
            return None
        deviation = np.std(np.stack(self._arrays), axis=0, ddof=1)
        finite = deviation[np.isfinite(deviation)]
        return float(np.median(finite)) if finite.size else None


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
        TRANSIENT, rr.Tensor(light, dim_names=("time", "y", "x")), rr.AnyValues(time_s=time_s)
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


LOGGED: Final = ("range", "direct", "indirect", "brightness", "pointcloud", "transient")
"""What is sent, if nothing else is said."""
BINS: Final = 64
FLUSH_EVERY_S: Final = 1.0
"""After so much time of the camera, what was logged has to have arrived."""
FLUSH_S: Final = 2.0
"""How long that may take."""


class RerunBridge:
    """Sends a camera's frames to a recording of Rerun.

    ``run`` belongs to one thread; ``close`` may be called from any. Who made the recording closes
    it.

    Parameters
    ----------
    camera
        Whose frames.
    recording
        Where to, with its sinks set.
    products
        Products that are images; ``pointcloud`` (points and depth image), and ``transient``.
    max_rate_hz
        Maximum frames per second.
    transient_rate_hz
        No more tensors a second than this; they are the largest by far.
    bins
        How many times of flight a tensor has.
    on_report
        Called with what is in the recording, too: losses and lost connections.

    Raises
    ------
    ParameterError
        If a product cannot be shown.
    ServerUnreachable, ProblemError
        If the camera does not state its lens.
    """

    def __init__(
        self,
        camera: Camera,
        recording: rr.RecordingStream,
        *,
        products: Sequence[str] = LOGGED,
        max_rate_hz: float = 10.0,
        transient_rate_hz: float = 1.0,
        bins: int = BINS,
        on_report: Callable[[Report], object] = lambda report: None,
    ) -> None:
        require_viewable(camera, products, "transient")
        self._recording = recording
        self._bins = bins
        self._on_report = on_report
        rates = {"transient": min(transient_rate_hz, max_rate_hz)}
        # the tensor is computed here: its coefficients are a tenth of its bytes
        streamed = {"transient": "coefficients"}
        self._subscriptions = [
            Subscription(streamed.get(name, name), rates.get(name, max_rate_hz))
            for name in sorted(dict.fromkeys(products), key=lambda name: name == "pointcloud")
        ]
        self._source = Source(camera, on_report=self._report)
        self._scatter = Scatter()
        self._direct: Frame | None = None
        self._lens: Pinhole | None = None
        self._left = inf
        self._flushed_s = -inf
        self._unsent = 0

    def run(self, count: int | None = None) -> None:
        """Send frames until it is closed, or until there were ``count`` of the first product."""
        self._left = inf if count is None else count
        while self._left > 0 and not self._source.closed:
            self._source.attempt(self._follow, None)

    def close(self) -> None:
        """Disconnect from the camera; ``run`` returns."""
        self._source.close()

    def __enter__(self) -> "RerunBridge":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _follow(self) -> None:
        with self._source.stream(*self._subscriptions) as stream:
            while self._left > 0:
                frame = stream.receive()
                self._left -= frame.product == self._subscriptions[0].product
                if self._is_taken(frame.meta["host_time_s"]):
                    self._send(frame)
                else:
                    self._unsent += 1

    def _is_taken(self, now_s: float) -> bool:
        """Return whether what was logged arrives; so no more than a second of it waits here."""
        if self._unsent == 0 and abs(now_s - self._flushed_s) < FLUSH_EVERY_S:
            return True
        try:
            self._recording.flush(timeout_sec=FLUSH_S)
        except (RuntimeError, TimeoutError) as error:
            if self._unsent == 0:
                self._on_report(Report("error", "connection", f"frames are not taken: {error}"))
            return False
        self._flushed_s = now_s
        if self._unsent:
            self._lens = None  # who takes them again may be another viewer
            text = f"frames are taken again; {self._unsent} were not sent"
            self._unsent = 0
            self._report(Report("warning", "connection", text))
        return True

    def _send(self, frame: Frame) -> None:
        lens = self._source.lens_of(frame)
        self._recording.set_time("frame", sequence=frame.frame)
        self._recording.set_time("capture", timestamp=captured_s(frame))
        if frame.product == "coefficients":
            log_transient(self._recording, frame, self._bins)
            return
        if frame.product == "direct":
            self._direct = frame
        of_frame = self._direct if self._direct and self._direct.frame == frame.frame else None
        intensity = None if of_frame is None else of_frame.array
        for message in messages_of({frame.product: frame.array}, lens, intensity=intensity):
            if any(lens.distortion) and message.topic == DEPTH:
                continue  # its lens knows no distortion
            if lens != self._lens or not isinstance(message, Calibration | Transform):
                log_message(self._recording, message)
        self._lens = lens
        if frame.product == "range":
            self._send_deviation(frame)

    def _send_deviation(self, frame: Frame) -> None:
        predicted = frame.meta["predicted_range_std_m"]
        if predicted is not None:
            self._recording.log(PREDICTED, rr.Scalars(predicted["median"]))
        measured = self._scatter.add(frame)
        if measured is not None:
            self._recording.log(MEASURED, rr.Scalars(measured))

    def _report(self, report: Report) -> None:
        self._on_report(report)
        log_report(self._recording, report.level, report.text)
