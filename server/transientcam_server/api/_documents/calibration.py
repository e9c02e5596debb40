"""The JSON documents about calibrations."""

from typing import Any, Final, Literal

from pydantic import Field

from transientcam_driver.calibration import DEFAULT_TAKES
from transientcam_server.api._documents.document import Document, JsonInteger, RequestDocument

MAX_NAME: Final = 200


class DeviceDocument(Document):
    """The camera that a calibration is of."""

    model: str
    serial: str
    width: int
    height: int


class DriftDocument(Document):
    """How well the active calibration still does.

    A pixel is invalid where its moments contradict each other by more than noise explains (the flag
    `contradictory`), as they do after thermal drift: a share that has grown much calls for a new
    calibration.
    """

    invalid_share: float = Field(ge=0.0, le=1.0)
    """Of the pixels with light, in the best of the newest frames."""
    invalid_share_at_capture: float | None = Field(default=None, ge=0.0, le=1.0)
    """The same in the measurement itself; null where it was not counted."""
    frame: int
    """The newest of those frames."""


class FindingDocument(Document):
    """One test of a verdict."""

    test: str
    """What was tested: shares of the pixels, ranges in metres, phases in radian."""
    value: float | None = None
    """What was found; null where no pixel could be judged."""
    limit: float
    """The most that a diffuser may have, either sign."""
    unit: Literal["share", "m", "rad"]
    kept: bool


class VerdictDocument(Document):
    """Whether a calibration was measured on a diffuser, by what its images look like.

    Through a diffuser all pixels see one return at the same time; a scene has ranges, and several
    returns in a pixel.
    """

    verdict: Literal["diffusor", "in-doubt", "scene"]
    """Only the first is used without `force`."""
    reason: str | None = None
    """What speaks against a diffuser; null where nothing does."""
    tests: list[FindingDocument]
    block_px: int
    """Side in pixels of the blocks that were judged."""
    blocks: list[str]
    """A text for each row of blocks: `.` like a diffuser, `#` unlike one, `?` not judged."""
    reference: str
    """What it was compared with: the id of a calibration, or `nominal`."""


class HarmonicsDocument(Document):
    """Odd harmonics of the modulation, over the fundamental; from a phase sweep.

    They are taken out of the moments, unless `modulation_harmonics` of the reconstruction is
    `keep`.
    """

    orders: list[int]
    """3, 5, 7, ..."""
    share: list[list[float]]
    """Magnitude over that of the fundamental: for each frequency, each order."""
    phase_rad: list[list[float]]
    """Phase where that of the fundamental is zero."""
    largest_share: float


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
    temperature_c: float | None
    """Of the sensor, while it was measured; null where the camera knows none."""
    bytes: int
    """Size of its file."""
    fits: bool
    """Whether it is good for this camera with its present sequence."""
    reason: str | None = None
    """Why not."""
    active: bool
    """Whether frames are calibrated by it, as long as it fits."""
    verdict: VerdictDocument
    forced: bool
    """Whether it was to be used whatever the verdict, when it was measured."""
    harmonics: HarmonicsDocument | None = None
    """Null where they were not measured."""
    drift: DriftDocument | None = None
    """Null where it is not active, no frame was calibrated by it yet, or the zeroth moment is
    estimated, as drift does not show then."""


class ActiveDocument(Document):
    """The calibration that is active, and what frames are really calibrated by."""

    id: str
    """`nominal` for the gains that an ideal modulation would have."""
    calibration_id: str
    """What frames carry: `nominal`, or `factory` of a camera that reports its gains, also where the
    active one is not good for the sequence."""
    reason: str | None = None
    """Why it is not."""
    warning: str | None = None
    """That it was measured at another temperature, and what that may do to ranges."""
    former: str | None = None
    """What was active before, to which `POST /calibrations/active/undo` returns."""


class CalibrationsDocument(Document):
    """All calibrations there are."""

    active: str
    """Id of the active one, or `nominal`."""
    former: str | None = None
    """What was active before; null where nothing was, or it was deleted."""
    directory: str
    """Where the service keeps them."""
    calibrations: list[CalibrationDocument]
    """The newest first."""


class CalibrationRequest(
    RequestDocument,
    strict=True,
    json_schema_extra={"examples": [{"name": "after warm-up", "frames": 40}]},
):
    """A calibration that is to be measured with the present sequence."""

    name: str = Field(default="", max_length=MAX_NAME)
    frames: JsonInteger = Field(default=DEFAULT_TAKES, ge=2, le=10_000)
    """Captured with the light on, and as many in the dark; averaged without outliers."""
    activate: bool = False
    """Use it at once, if it was measured on a diffuser."""
    force: bool = False
    """Let it be used whatever the verdict on it."""
    harmonics: bool = True
    """Sweep the phase as well, to measure the harmonics of the modulation; with 30 frames or more,
    if the camera can."""


class ActivationRequest(
    RequestDocument,
    strict=True,
    json_schema_extra={"examples": [{"id": "SIM-prototype-0-3f9c2a71b04e"}, {"id": "nominal"}]},
):
    """The calibration that frames are to be calibrated by."""

    id: str = Field(max_length=200)
    """`nominal` for none."""
    force: bool = False
    """Use it even if it was not measured on a diffuser."""
