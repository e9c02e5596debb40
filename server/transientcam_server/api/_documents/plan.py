"""The JSON documents of planning."""

from typing import Annotated, Any, Literal

from annotated_types import Len
from pydantic import ConfigDict, Field

from transientcam_server.api._documents.document import Document, JsonInteger, RequestDocument
from transientcam_server.api._documents.frame import FrameDocument
from transientcam_server.api._documents.sequence import SequenceDocument
from transientcam_server.settings import ReconstructionSettings


class _StrictDocument(RequestDocument):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class TargetDocument(_StrictDocument):
    """What has to be reached; all that is given."""

    range_error_m: float | None = Field(default=None, gt=0)
    """How far the range is off, noise and bias together, at most; in `share` of the pixels."""
    range_std_m: float | None = Field(default=None, gt=0)
    """Standard deviation of the range of a typical pixel, at most."""
    separation_m: float | None = Field(default=None, gt=0)
    """Distance at which two equal returns are both found."""
    separation_share: float = Field(default=0.9, gt=0, lt=1)
    """Share of captures in which both are found."""
    bound_width: float | None = Field(default=None, gt=0)
    """Width of the bounds on the density over the mean density, at most."""


class BudgetDocument(_StrictDocument):
    """What may be spent; all that is given."""

    capture_s: float | None = Field(default=None, gt=0)
    """Time of one capture, at most."""
    frame_rate_hz: float | None = Field(default=None, gt=0)
    """Frames a second back to back, at least."""
    computing_share: float | None = Field(default=None, gt=0)
    """Share of the time between two frames that reconstruction may take, at most."""


class GivenReturnDocument(_StrictDocument):
    """Light that comes back from one range."""

    range_m: float = Field(gt=0, le=1e6)
    weight: float = Field(default=1.0, gt=0, le=1e6)
    """Relative to the others."""


class SceneDocument(_StrictDocument):
    """A scene of equal pixels."""

    brightness_dn_per_s: float = Field(gt=0, le=1e12)
    """Zeroth moment in DN for each second of exposure."""
    ambient_dn_per_s: float = Field(default=0.0, ge=0, le=1e12)
    """Light that is not the camera's, in DN an image for each second of exposure."""
    returns: list[GivenReturnDocument] = Field(
        default_factory=lambda: [GivenReturnDocument(range_m=2.0)], min_length=1, max_length=32
    )


Share = Annotated[float | None, Field(gt=0, lt=1)]
"""Of the pixels of a capture."""
Corner = Annotated[list[int], Len(2, 2)]
"""Column and row of a pixel."""
RegionOfPixels = Annotated[list[int], Len(4, 4)] | list[Corner]
"""Column and row of the first pixel, width and height of a box; or the corners of a polygon."""


class PlanRequest(_StrictDocument):
    """What a sequence is wanted for."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {"target": {"range_error_m": 0.005}},
                {"target": {"range_error_m": 0.02}, "share": 0.95, "region": [40, 30, 60, 40]},
                {"budget": {"frame_rate_hz": 15.0}, "fixed": {"zeroth": "low-frequency"}},
            ]
        },
    )

    target: TargetDocument = TargetDocument()
    budget: BudgetDocument = BudgetDocument()
    share: Share = 0.9
    """Of the pixels of a capture that are to be within the target. Null plans for the error of the
    median pixel over many captures, which two of three pixels of a capture are within."""
    region: RegionOfPixels | None = None
    """Whose lit pixels count; null for the whole picture. What is outside may saturate."""
    map: bool = False
    """Whether a job is to predict the error of each pixel, too."""
    fixed: dict[str, Any] = Field(default_factory=dict)
    """Fields of the sequence that must stay as given here."""
    estimator: str | None = Field(default=None, max_length=64)
    """The only estimator to plan with: single-frequency, maximum-entropy, likelihood, pisarenko, or
    one of another package; null considers the first three."""
    scene: SceneDocument | None = None
    """Null looks at the scene: by a simulated camera of its own in virtual time, or else by the
    current frame."""
    look: bool = False
    """Whether a camera that is not simulated looks at all frequencies, in place of the current
    frame: some seconds without other frames. That takes the lease and the right to light."""
    ambient_dn_per_s: float | None = Field(default=None, ge=0)
    """Light on that scene that is not the camera's; null measures it."""


class FigureDocument(Document):
    """A predicted error of the range in m."""

    median: float
    """Of the median lit pixel."""
    low: float
    """What is measured lies above this with 95 %."""
    high: float | None
    """And below this; null where the bias is not known, and how much more it is the look cannot
    tell."""
    p90: float
    """Of 90 % of the pixels; fewer are better where much light comes back close
    behind the direct one, as near the edge of a corner, and no frequency resolves it."""


class WithinDocument(Document):
    """How many pixels of a capture are how close, noise and bias together."""

    share: float
    """Of the pixels, as the goal has it."""
    error_m: float
    """So many are within this."""
    low: float
    high: float | None
    """It is measured between them with 90 %; null where the bias is not known, and how much more
    it is the look cannot tell."""
    target_m: float | None = None
    target_share: float | None = None
    """So many are within the target."""


class PredictedDocument(Document):
    """Predicted accuracy."""

    range_error_m: FigureDocument
    """Noise and bias together: root sum of squares, pixel by pixel."""
    range_std_m: FigureDocument
    """Noise: standard deviation between captures."""
    range_bias_m: float
    """How far the mean range of the median pixel is off; more captures do not reduce it."""
    range_bias_most_m: float
    """How far it is off where light begins as early, or as late, as the moments of the look only
    just allow."""
    bias_known: bool
    """Whether the look tells the bias. It does not where shapes of light that explain its moments
    alike put the range elsewhere, nor where its two estimators disagree about the direct range,
    nor where many pixels may be lit by other surfaces alone: then `range_bias_m` holds only for
    the simplest light, and `summary` says why."""
    within: WithinDocument | None = None
    """What the share of the goal is within; null where the goal is of the median pixel."""
    beyond: dict[str, float] = Field(default_factory=dict)
    """Shares of the pixels of a capture that are further off than errors in m."""
    beyond_scene: bool
    """Whether it sees more of the scene than the look that the scene was judged by, so that the
    prediction is a bound on how good it can be."""
    bound_width: float | None = None
    separation_share: float | None = None


class ChoiceDocument(Document):
    """A sequence and what is predicted of it."""

    sequence: SequenceDocument
    """The body for `PUT /sequence`."""
    estimator: str
    """What the range is to be taken from, as in `PUT /reconstruction`."""
    applied: dict[str, Any]
    """What the camera would make of it."""
    capture_s: float
    frame_rate_hz: float
    reconstruct_s: float | None
    """Processor time of one frame on this machine; null as long as the kernels that it needs are
    not compiled. With a budget `computing_share` they are, before the answer."""
    computing_share: float | None
    """That over the time between two frames: what a core is busy with."""
    price: dict[str, float | None]
    """Times of a capture: `light_s` of exposure, `readout_s`, and `settling_s` of the modulation;
    `transport_s` until the last image arrives beyond the least that the link took, by the newest
    frame, and `computing_s` on one core, null where not known; their `sum_s`. And `light_share`,
    the part with the light on, which dose and heat go with, and `data_bytes` of images."""
    predicted: PredictedDocument


class PlanNeighbourDocument(ChoiceDocument):
    """Another choice on the front, beside the recommended one."""

    time_factor: float
    """Its capture time over the recommended one's."""
    error_factor: float | None = None
    """Its error over the recommended one's."""


class SeenDocument(Document):
    """The scene that was planned for, by its median lit pixel."""

    range_m: float
    brightness_dn_per_s: float
    """Zeroth moment for each second of exposure."""
    ambient_dn_per_s: float
    """Light that is not the camera's, in DN an image for each second of exposure."""
    lit_share: float
    """Share of all pixels whose light stands clear of the noise; no others count."""
    dim_share: float
    """Share of those that are so dim, at their range, that other surfaces may light them alone."""
    moving_share: float
    """Share of the lit pixels that changed while the scene was looked at. Plans are for the others,
    with the error that the speed of what moves adds during a capture."""
    ambiguity_checked: bool
    """Whether a second base frequency showed that no range is short by a period."""
    calibrated: bool
    """Whether what was seen is known to be the scene's; of one frame by nominal gains it is not."""
    uncalibrated_m: float
    """How far nominal gains put the range of the median pixel off. Plans are for a camera that is
    calibrated with their sequence."""
    lost_share: float
    """Share of the images that lose their synchronisation."""
    drift_m: float
    """By how much ranges may have drifted since the calibration in use, by the temperature."""
    of_one_frame: bool
    """Whether the current frame had to do in the place of a look."""


class PlanDocument(ChoiceDocument):
    """A recommendation and its neighbours."""

    compared_by: str
    """The target that neighbours are compared by."""
    summary: str
    """Noise and bias in a sentence, what half the error costs, and why a bias is not known."""
    scene: SeenDocument
    region: list[Corner] | None = None
    """Corners of the region whose pixels count."""
    computing_s: dict[str, float | None]
    """Computing time of a frame of the sequence, by estimator; null as in `price`."""
    changes: list[dict[str, float | str]]
    """What would be, the best first, with the same frequencies and `what`, twice the `light` or a
    `readout` twice as fast: `capture_s` and `error`, and how many times less they are."""
    price_summary: str
    """What the time goes into, and what would buy most, in a sentence."""
    half_time: PlanNeighbourDocument | None = None
    """What half the time gives; null where nothing is that quick."""
    twice_accuracy: PlanNeighbourDocument | None = None
    """What half the error costs; null where nothing is that accurate."""


class RangeErrorDocument(Document):
    """Error of the range against the simulated truth, in m."""

    median: float
    rms: float
    no_direct_light_share: float
    """Of all pixels, those with a range and without direct light: no error counts them."""


class CurrentDocument(Document):
    """Where the current frame stands."""

    meta: FrameDocument
    sequence: SequenceDocument
    capture_s: float
    frame_rate_hz: float
    range_error_m: RangeErrorDocument | None = None
    """Null for a real camera."""


class PointDocument(Document):
    """Predicted errors of the range of the median pixel, in m."""

    capture_s: float
    range_std_m: float
    range_bias_m: float
    range_error_m: float
    """With a share what that is within, and of the median pixel without."""


class LineDocument(Document):
    """How the error of the same frequencies falls with capture time."""

    estimator: str
    harmonics: int
    base_frequency_hz: float
    points: list[PointDocument]


AccuracyName = Literal["range_error_m", "range_std_m", "bound_width"]
"""Which accuracy capture time is held against."""


class TradeoffRequest(_StrictDocument):
    """What the front is wanted for."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"by": "range_error_m"}]}
    )

    by: AccuracyName = "range_error_m"
    """The accuracy that capture time is held against."""
    share: Share = None
    """Of the pixels of a capture, whose error counts; null for that of the median pixel."""
    region: RegionOfPixels | None = None
    """Whose pixels count; null for the whole picture."""
    estimator: str | None = Field(default=None, max_length=64)
    """The only estimator to predict with, as of a plan."""


class TradeoffDocument(Document):
    """What accuracy costs on the scene before the camera."""

    compared_by: str
    scene_of_frame: int
    """Number of the frame that the scene was judged by."""
    current: CurrentDocument
    front: list[ChoiceDocument]
    """By rising capture time and falling error."""
    lines: list[LineDocument]
    """Of every estimator and set of frequencies on the front: noise falls onto the bias."""
    summary: str
    """From where on bias rules and time buys little, and the best there is, in a sentence."""


MAX_SETTINGS = 64
_EXAMPLE = {"settings": [{"sequence": {"harmonics": 3}}, {"sequence": {"harmonics": 4}}]}


class SettingRequest(RequestDocument):
    """A row of a series; what is absent stays as it is at present."""

    sequence: dict[str, Any] = Field(default_factory=dict)
    """Fields of `PUT /sequence`."""
    reconstruction: ReconstructionSettings = ReconstructionSettings()
    """Fields of `PUT /reconstruction`; frames are not averaged over `still_frames`."""


class SeriesRequest(RequestDocument, json_schema_extra={"examples": [_EXAMPLE]}):
    """What is to be compared."""

    settings: list[SettingRequest] = Field(min_length=1, max_length=MAX_SETTINGS)
    frames: JsonInteger = Field(default=100, ge=2, le=10_000)
    """At each setting."""
    target_m: float | None = Field(default=None, gt=0)
    """`within_share` is of the ranges that are so close to the truth, or to the plane."""
    region: RegionOfPixels | None = None
    """Whose pixels count; null for all."""
