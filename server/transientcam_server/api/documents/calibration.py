"""The JSON documents about calibrations."""

from typing import Any, Final

from pydantic import ConfigDict, Field

from transientcam_driver.calibration.capture import DEFAULT_TAKES
from transientcam_server.api.documents.document import Document

MAX_NAME: Final = 200


class DeviceDocument(Document):
    """The camera that a calibration is of."""

    model: str
    serial: str
    width: int
    height: int


class DriftDocument(Document):
    """How well the active calibration still does.

    A pixel is invalid where its moments contradict each other by more than noise explains, as
    they do after thermal drift: a share that has grown much calls for a new calibration.
    """

    invalid_share: float = Field(ge=0.0, le=1.0)
    """Of the pixels with light, in the best of the newest frames."""
    invalid_share_at_capture: float | None = Field(default=None, ge=0.0, le=1.0)
    """The same in the measurement itself; null where it was not counted."""
    frame: int
    """The newest of those frames."""


class CalibrationDocument(Document):
    """A calibration, and whether it is good for what is captured at present."""

    id: str
    name: str
    created_at: float
    """Unix time of its last image."""
    age_s: float
    device: DeviceDocument
    sequence: dict[str, Any]
    """What it was measured with, and is good for; the number of takes does not matter."""
    exposure_s: float
    temperature_c: float
    """Of the sensor, while it was measured."""
    bytes: int
    """Size of its file."""
    fits: bool
    """Whether it is good for this camera with its present sequence."""
    reason: str | None = None
    """Why not."""
    active: bool
    """Whether frames are calibrated by it, as long as it fits."""
    drift: DriftDocument | None = None
    """Null where it is not active, or no frame was calibrated by it yet."""


class ActiveDocument(Document):
    """The calibration that is active, and what frames are really calibrated by."""

    id: str
    """`nominal` for the gains that an ideal modulation would have."""
    calibration_id: str
    """What frames carry: `nominal` also where the active one is not good for the sequence."""
    reason: str | None = None
    """Why it is not."""


class CalibrationsDocument(Document):
    """All calibrations there are."""

    active: str
    """Id of the active one, or `nominal`."""
    directory: str
    """Where the service keeps them."""
    calibrations: list[CalibrationDocument]
    """The newest first."""


class CalibrationRequest(Document):
    """A calibration that is to be measured with the present sequence."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        json_schema_extra={"examples": [{"name": "after warm-up", "frames": 40}]},
    )

    name: str = Field(default="", max_length=MAX_NAME)
    frames: int = Field(default=DEFAULT_TAKES, ge=2, le=10_000)
    """Captured with the light on, and as many in the dark; averaged without outliers."""
    activate: bool = False
    """Use it at once."""


class ActivationRequest(Document):
    """The calibration that frames are to be calibrated by."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        json_schema_extra={"examples": [{"id": "SIM-prototype-0-3f9c2a71b04e"}, {"id": "nominal"}]},
    )

    id: str = Field(max_length=200)
    """`nominal` for none."""
