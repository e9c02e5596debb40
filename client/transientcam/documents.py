"""What the service says of a frame, in JSON and in messages: stated here for both sides.

The service describes its interface by these fields and their descriptions.
"""

from collections.abc import Sequence
from typing import Literal

from typing_extensions import TypedDict  # that of Python 3.11 does not tell its fields to pydantic

Neighbours = Literal["edge-preserving", "gaussian", "none"]


class PixelCountsDocument(TypedDict):
    """How many pixels carry each flag; one pixel may carry several."""

    total: int
    valid: int
    biased: int
    """Moved to moments that have a density, as sharp returns or noise make it necessary: normal."""
    no_signal: int
    saturated: int
    non_finite: int
    degenerate: int
    replaced: int
    contradictory: int
    """Moments that contradict each other by more than noise explains: something is wrong."""
    unexplained: int
    """Moments that the returns of the likelihood do not explain: the range may be biased."""


class PredictedStdDocument(TypedDict):
    """Standard deviation of a frame's range in m between frames, by the noise of the sensor.

    To first order, of the returns that the frame shows; `range_std` of `accuracy` draws the noise.
    """

    median: float
    p90: float
    """90 % of the pixels are better."""
    first_order_share: float
    """Share of the pixels where the noise model holds; that of the others is a rough figure."""


class TrustCountsDocument(TypedDict):
    """How many pixels the product `trust` has under each code, in the order of the codes from 0."""

    trusted: int
    no_range: int
    """There is none: too little light, or too much, as the flags say."""
    corrupt_image: int
    """An image of the frame was lost or out of step, and could not be rebuilt."""
    motion: int
    """The light of the pixel changed while the frame was captured."""
    no_direct_light: int
    """No surface at this range can be this bright by the lamp's own light: it came around."""
    shadow: int
    """What is nearer stands between the lamp and this point."""
    edge: int
    """Near and far meet within the pixel or beside it."""
    later_light_unresolved: int
    """Later light is merged with the first: estimators disagree by much."""
    later_light: int
    """A return found close behind the first one may have moved it by much."""
    drift: int
    """The camera is far from its calibration's temperature, or moments contradict each other."""
    noise: int
    """The noise leaves the range open, or threw it off all around."""


class RangeAccuracyDocument(TypedDict):
    """Predicted errors of a frame's range: shares, and in m those of the median pixel with one."""

    trusted_share: float
    """Share of all pixels whose range is trusted."""
    within_m: float | None
    """Half width of the 90 % interval that 9 of 10 trusted pixels have, or less; null without."""
    trust: TrustCountsDocument
    range_error_m: float | None
    """Half width of the 90 % interval; null where one frequency knows no bias."""
    range_std_m: float | None
    """Standard deviation that the noise of the sensor gives."""
    range_bias_m: float | None
    """How far it is off for good, as far as the frame shows it; more takes do not reduce it."""
    every_px: int
    """The errors are those of one pixel in so many rows and columns: more than 1 where not all
    that predicts them is compiled."""
    not_judged: list[str]
    """Reasons of `trust` that no pixel can have, as nothing known would tell them: the beam of the
    light, its place, images, or both temperatures."""


class FramesAveragedDocument(TypedDict):
    """How many frames the pixels of this one are the mean of, itself included."""

    median: float
    least: int
    """1 where something moves."""


class HopDocument(TypedDict):
    """One relay that a frame came through."""

    service_id: str
    """Which service relayed it, as its `GET /info` has it."""
    latency_s: float
    """From its arrival at the service before to that at this relay, by the clocks of both."""
    missed_frames: int
    """Frames that the service before had and this relay never got, since it began."""


class ExtrinsicsDocument(TypedDict):
    """Where the sensor is in the frame ``parent``: its points p are at R p + t there."""

    parent: str
    rotation_xyzw: Sequence[float]
    """R, a unit quaternion; x right, y down, z where the camera looks."""
    translation_m: Sequence[float]


class FrameDocument(TypedDict):
    """What is known of a frame, whatever product of it is fetched."""

    frame: int
    """Counted from 1; never resets while the service runs."""
    sequence_id: int
    calibration_id: str
    reconstruction_id: int
    """Counts the settings of the reconstruction; those that it was computed with."""
    estimator: str
    """What its range, direct and indirect light are taken from."""
    neighbours: Neighbours | None
    """How its moments were averaged over pixels, once they were."""
    device_time_s: float
    """Start of the first exposure, by the camera's clock."""
    host_time_s: float
    """Arrival of the last image, Unix time."""
    captured_unix_s: float | None
    """Start of the first exposure, Unix time: the camera's clock, set by that of the service at its
    first frame. No step of the service's clock moves it."""
    capture_s: float
    """Measured by the camera's clock."""
    reconstruct_s: float | None
    """Computing time spent on this frame so far; null until something was computed."""
    base_frequency_hz: float
    harmonics: int
    zeroth: str
    exposure_s: float
    takes: int
    width: int
    height: int
    extrinsics: ExtrinsicsDocument | None
    """Null where the camera does not say where it is mounted."""
    temperature_c: float | None
    """Of the sensor; null where the camera knows none."""
    lost_images: int
    """Images lost or corrupt between the frame before and this one."""
    hops: list[HopDocument]
    """The relays that it came through, the first one first; none where the camera is here."""
    rejected_images: int | None
    """Images left out of the average over takes as outliers; null until it was computed."""
    repaired_images: int | None
    """Images that lost their synchronisation, rebuilt from the others; null until computed."""
    unrepaired_images: int | None
    """Images of pairs that contradict the others and could not be rebuilt; null until computed."""
    filled_images: list[int] | None
    """Which images are those of the frame before, by their index in it; null until computed."""
    corrected_pixels: int | None
    """Pixels from whose moments the known harmonics of the modulation were taken out; null where
    the calibration knows none, and until computed."""
    pixels: PixelCountsDocument | None
    """Null until something was computed."""
    ambient_dn: float | None
    """Light in DN an image that is not the camera's, in the median pixel; 0 where it hardly adds
    noise, null until something was computed and where no sensor is known."""
    frames_averaged: FramesAveragedDocument | None
    """With the setting `still_frames`; null without, for recordings, and until computed."""
    predicted_range_std_m: PredictedStdDocument | None
    """Null until the range was computed."""
    accuracy: RangeAccuracyDocument | None
    """Null until one of the products range_std, range_bias, range_error, trust was computed, as
    `computed=true` has it done."""


class FrameMeta(FrameDocument):
    """What is known of a frame, and which of its pixels an array holds."""

    region: list[int]
    """column and row of the first pixel, width, height"""
    decimation: int
