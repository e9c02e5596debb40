"""The JSON documents about one pixel of a frame."""

from pydantic import ConfigDict

from transientcam_server.api.documents.document import Document
from transientcam_server.api.documents.frame import META_EXAMPLE, FrameDocument


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
                    "meta": META_EXAMPLE,
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
