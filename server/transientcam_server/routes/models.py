"""The JSON documents of the REST interface; the tests hold every answer against them."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

_SEQUENCE_EXAMPLE: dict[str, JsonValue] = {
    "base_frequency_hz": 23e6,
    "harmonics": 3,
    "zeroth": "low-frequency",
    "exposure_s": 0.00192,
    "takes": 1,
    "take_order": "sequential",
    "sub_phases": {"scheme": "arccos", "n": 8},
}
_APPLIED_EXAMPLE: dict[str, JsonValue] = _SEQUENCE_EXAMPLE | {
    "sequence_id": 1,
    "images": 16,
    "capture_s": 0.0904,
    "frame_rate_hz": 10.593220338983052,
    "unambiguous_range_m": 6.517227,
    "data_rate_bytes_s": 6641355.93,
}
_META_EXAMPLE: dict[str, JsonValue] = {
    "frame": 1204,
    "sequence_id": 1,
    "calibration_id": "nominal",
    "reconstruction_id": 1,
    "device_time_s": 113.52,
    "host_time_s": 1795161600.25,
    "capture_s": 0.0944,
    "reconstruct_s": 0.0042,
    "base_frequency_hz": 23e6,
    "harmonics": 3,
    "zeroth": "low-frequency",
    "exposure_s": 0.00192,
    "takes": 1,
    "width": 163,
    "height": 120,
    "temperature_c": 31.5,
    "lost_images": 0,
    "rejected_images": 0,
    "pixels": {
        "total": 19560,
        "valid": 19498,
        "biased": 62,
        "no_signal": 0,
        "saturated": 0,
        "non_finite": 0,
        "degenerate": 0,
        "replaced": 0,
    },
    "predicted_range_std_m": {"median": 0.0105, "p90": 0.0291, "first_order_share": 0.61},
}


class Document(BaseModel):
    """A JSON document whose fields are described beside them."""

    model_config = ConfigDict(use_attribute_docstrings=True)


class SubPhasesDocument(Document):
    """How one exposure is divided between phases (Sec. 4.1)."""

    scheme: Literal["arccos", "harmonic-cancellation", "none"] = "arccos"
    """How its parts are chosen; `none` has one."""
    n: int = Field(default=8, ge=1, le=255)
    """How many parts."""


class SequenceDocument(Document):
    """What the camera captures for one transient image; what is absent keeps its default."""

    model_config = ConfigDict(json_schema_extra={"examples": [_SEQUENCE_EXAMPLE]})

    base_frequency_hz: float = Field(default=23e6, gt=0)
    """Modulation frequencies are this and its multiples."""
    harmonics: int = Field(default=3, ge=1, le=32)
    """m: how many multiples."""
    zeroth: Literal["low-frequency", "on-off", "estimated"] = "low-frequency"
    """Where the zeroth moment comes from; costs four, two or no images (Sec. 4.3)."""
    exposure_s: float = Field(default=0.00192, gt=0)
    """Of one image."""
    takes: int = Field(default=1, ge=1)
    """How often each image is captured, for averaging; whole images that are off are left out."""
    take_order: Literal["sequential", "interleaved"] = "sequential"
    """Whether takes follow one another as a whole, or image by image."""
    sub_phases: SubPhasesDocument = SubPhasesDocument()


class AppliedDocument(SequenceDocument):
    """A sequence as the camera really set it, on the grid of its synthesiser."""

    model_config = ConfigDict(json_schema_extra={"examples": [_APPLIED_EXAMPLE]})

    sequence_id: int
    """Counts the sequences the camera was set to; 0 for one that was only checked."""
    images: int
    capture_s: float
    """From the first exposure to the last read-out of one capture by itself."""
    frame_rate_hz: float
    """When capturing back to back."""
    unambiguous_range_m: float
    data_rate_bytes_s: float


class InfoDocument(Document):
    """What answers here."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "name": "transientcam",
                    "version": "0.1.0",
                    "api": "v1",
                    "stream": {"path": "/api/v1/stream", "subprotocol": "transientcam.v1.msgpack"},
                    "products": [
                        {
                            "name": "range",
                            "unit": "m",
                            "axes": ["y", "x"],
                            "dtype": "<f4",
                            "summary": "range of the first return; NaN without one",
                            "formats": ["msgpack", "npy", "png"],
                            "over_time": False,
                            "streamed": True,
                        }
                    ],
                    "clients": 1,
                    "kernels": {"enabled": True, "compiled": [], "compiling": None, "failed": []},
                    "reconstruction": {
                        "smoothing_px": 0.6,
                        "bias": 0.004,
                        "return_threshold": 0.1,
                        "estimator": "pisarenko",
                        "minimum_brightness_dn": 0.0,
                    },
                }
            ]
        }
    )

    class ProductDocument(Document):
        """An array that a frame can be asked for."""

        name: str
        unit: str
        axes: list[str]
        dtype: str
        summary: str
        formats: list[str]
        """Suffixes it can be had in."""
        over_time: bool
        """Whether it takes `time_s` or `bins`."""
        streamed: bool
        """Whether the stream offers it."""

    class StreamDocument(Document):
        """Where the stream is."""

        path: str
        subprotocol: str

    name: str
    version: str
    api: str
    stream: StreamDocument
    products: list[ProductDocument]
    clients: int
    """Streams open now."""
    kernels: dict[str, Any]
    """Which compiled kernels are ready; the others are computed with NumPy meanwhile."""
    reconstruction: dict[str, float | str]
    """Settings of the reconstruction."""


class CameraDocument(Document):
    """The camera: what it can do, and how it is."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "state": "streaming",
                    "reason": None,
                    "simulated": True,
                    "capabilities": {"model": "simulated", "width": 163, "height": 120},
                    "intrinsics": {
                        "fx": 223.92,
                        "fy": 223.92,
                        "cx": 81.0,
                        "cy": 59.5,
                        "width": 163,
                        "height": 120,
                        "source": "scene",
                    },
                    "status": {"temperature_c": 31.5},
                    "counters": {"images": 4096, "lost": 0, "corrupt": 0, "resyncs": 0},
                }
            ]
        }
    )

    class IntrinsicsDocument(Document):
        """A pinhole camera, in pixels; whole numbers are the centres of pixels."""

        fx: float
        fy: float
        cx: float
        cy: float
        width: int
        height: int
        source: Literal["settings", "scene", "recording", "assumed"]
        """Who says so: the settings `[lens]`, the simulated scene, the recording, or nobody."""

    state: Literal["starting", "streaming", "stopped", "calibrating", "lost"]
    reason: str | None = None
    """Why it is lost."""
    simulated: bool
    capabilities: dict[str, Any]
    """As the camera itself states them; units are in the names."""
    intrinsics: IntrinsicsDocument
    """Where the pixels look: (column, row) along ((c - cx) / fx, (r - cy) / fy, 1)."""
    status: dict[str, Any] | None = None
    """As the camera itself states it now; null while it is lost."""
    counters: dict[str, int]
    """What was received since the service started."""


class AcquisitionDocument(Document):
    """Whether frames are captured, and how fast."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "running": True,
                    "state": "streaming",
                    "rate_hz": 10.59,
                    "frames": 1204,
                    "frame_age_s": 0.031,
                    "stalled": False,
                }
            ]
        }
    )

    running: bool
    state: Literal["starting", "streaming", "stopped", "calibrating", "lost"]
    rate_hz: float | None = None
    """Measured over the last frames; null before there are two."""
    frames: int
    """Captured since the service started."""
    frame_age_s: float
    """Since the last frame arrived."""
    stalled: bool
    """Whether no frame arrived for much longer than one takes."""


class AcquisitionRequest(Document):
    """What the acquisition should do."""

    model_config = ConfigDict(
        extra="forbid", strict=True, json_schema_extra={"examples": [{"running": False}]}
    )

    running: bool
    """Whether frames are captured; the light is off while they are not."""


class PixelCountsDocument(Document):
    """How many pixels carry each flag; one pixel may carry several."""

    total: int
    valid: int
    biased: int
    no_signal: int
    saturated: int
    non_finite: int
    degenerate: int
    replaced: int


class PredictedStdDocument(Document):
    """Standard deviation that the noise of the sensor gives a frame's range, in m."""

    median: float
    p90: float
    """90 % of the pixels are better."""
    first_order_share: float
    """Share of the pixels where the noise model holds; that of the others is a rough figure."""


class FrameDocument(Document):
    """What is known of a frame, whatever product of it is fetched."""

    model_config = ConfigDict(json_schema_extra={"examples": [_META_EXAMPLE]})

    frame: int
    """Counted from 1; never resets while the service runs."""
    sequence_id: int
    calibration_id: str
    reconstruction_id: int
    """Counts the settings of the reconstruction; those that it was computed with."""
    device_time_s: float
    """Start of the first exposure, by the camera's clock."""
    host_time_s: float
    """Arrival of the last image, Unix time."""
    capture_s: float
    """Measured by the camera's clock."""
    reconstruct_s: float | None = None
    """Computing time spent on this frame so far; null until something was computed."""
    base_frequency_hz: float
    harmonics: int
    zeroth: str
    exposure_s: float
    takes: int
    width: int
    height: int
    temperature_c: float
    lost_images: int
    """Images lost or corrupt between the frame before and this one."""
    rejected_images: int | None = None
    """Images left out of the average over takes as outliers; null until it was computed."""
    pixels: PixelCountsDocument | None = None
    """Null until something was computed."""
    predicted_range_std_m: PredictedStdDocument | None = None
    """Null until the range was computed."""


class HistoryDocument(Document):
    """Which frames can be had, and how many may be kept."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "first": 1099,
                    "last": 1204,
                    "count": 106,
                    "bytes": 66347520,
                    "seconds": 9.94,
                    "limit_bytes": 268435456,
                    "limit_seconds": 10.0,
                }
            ]
        }
    )

    first: int | None = None
    """Null before there is any."""
    last: int | None = None
    """Number of the latest frame."""
    count: int
    bytes: int
    """That their raw images take."""
    seconds: float
    """From the arrival of the first to that of the last."""
    limit_bytes: int
    limit_seconds: float


class ComplexDocument(Document):
    """A complex number."""

    re: float
    im: float


class ReturnDocument(Document):
    """Light that came back after one time of flight."""

    time_s: float
    weight: float
    """In DN."""


class TruthDocument(Document):
    """What the simulated scene really holds at a pixel."""

    kind: str
    range_m: float | None = None
    direct: float
    brightness: float
    returns: list[ReturnDocument]
    """At most the 16 strongest."""


class BoundsDocument(Document):
    """What every density with these moments lies between, smoothed (Sec. 5.2)."""

    radius: float
    """Of the Poisson kernel that it is smoothed with."""
    lower_per_s: list[float | None]
    """In DN/s, at `time_s` of the pixel."""
    upper_per_s: list[float | None]


class PixelDocument(Document):
    """Everything about one pixel of one frame."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "meta": _META_EXAMPLE,
                    "x": 80,
                    "y": 60,
                    "range_m": 1.694,
                    "direct": 812.1,
                    "indirect": 402.7,
                    "brightness": 1219.6,
                    "uniform": 4.8,
                    "validity": 0.0041,
                    "flags": ["biased"],
                    "moments": [{"re": 1219.6, "im": 0.0}, {"re": -310.2, "im": 844.9}],
                    "returns": [{"time_s": 1.13e-08, "weight": 812.1}],
                    "time_s": [0.0, 2.1739e-08],
                    "density_per_s": [1.1e9, 2.3e10],
                    "cumulative": [0.0, 640.2],
                    "bounds": {
                        "radius": 0.93,
                        "lower_per_s": [4.1e8, 2.7e9],
                        "upper_per_s": [8.9e9, 6.0e10],
                    },
                    "truth": None,
                }
            ]
        }
    )

    meta: FrameDocument
    x: int
    y: int
    range_m: float | None = None
    """Of the first return; null without one."""
    direct: float
    indirect: float
    brightness: float
    uniform: float
    validity: float | None = None
    """Smallest eigenvalue of the moments over the brightness; null without light."""
    flags: list[str]
    """What was wrong with the pixel; empty for nothing."""
    moments: list[ComplexDocument]
    """b_0 to b_m in DN."""
    returns: list[ReturnDocument]
    """The sparse estimate (Theorem 2), by time of flight."""
    time_s: list[float]
    density_per_s: list[float | None]
    """The maximum entropy estimate (Theorem 1) in DN/s; null where the pixel has none."""
    cumulative: list[float | None]
    """Light up to each time of flight in DN."""
    bounds: BoundsDocument
    truth: TruthDocument | None = None
    """Null where the camera is a real one."""


class LivenessDocument(Document):
    """The process answers."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"status": "alive"}]})

    status: Literal["alive"] = "alive"


class ReadinessDocument(Document):
    """Frames can be had."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"status": "ready"}]})

    status: Literal["ready"] = "ready"


class VersionsDocument(Document):
    """Which interfaces are served."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "name": "transientcam",
                    "version": "0.1.0",
                    "api": [{"name": "v1", "path": "/api/v1"}],
                }
            ]
        }
    )

    class ApiDocument(Document):
        """One version of the interface."""

        name: str
        path: str

    name: str
    version: str
    api: list[ApiDocument]
