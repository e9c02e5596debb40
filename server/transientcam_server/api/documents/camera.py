"""The JSON documents about the camera, and whether it captures."""

from typing import Any, Literal

from pydantic import ConfigDict

from transientcam_server.api.documents.document import Document


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
