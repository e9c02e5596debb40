"""The JSON documents about frames."""

from pydantic import ConfigDict, JsonValue

from transientcam_server.api.documents.document import Document

META_EXAMPLE: dict[str, JsonValue] = {
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

    model_config = ConfigDict(json_schema_extra={"examples": [META_EXAMPLE]})

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
