"""How moments become range, and what the range may be taken from."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike

from transientcam_moments.arrays import MAX_HARMONICS, MAX_MULTIPLE, chosen, in_range
from transientcam_moments.comparisons import PLUGINS, TECHNIQUES, technique_of
from transientcam_moments.errors import ParameterError, PluginFailed
from transientcam_moments.images import FOUR_PHASES_RAD, SIGMA_PX, ZEROTH_IMAGES, phase_weights
from transientcam_moments.moment_problem import DIRECT_THRESHOLD, EPSILON
from transientcam_moments.noise import MOST_FRAMES, Sensor
from transientcam_moments.reconstruction._ranging import range_m

NEIGHBOURS = ("edge-preserving", "gaussian", "none")
"""How moments are averaged over neighbouring pixels; see `Settings`."""

CORRUPT_IMAGES = ("keep", "repair", "fill")
"""What becomes of images that lost their synchronisation; see `Settings`."""

OF_ANY_MULTIPLES = ("likelihood", "two-returns", "unwrapped-phase")
"""Estimators that serve moments of any multiples of the base frequency."""
OWN = (
    "pisarenko", "maximum-entropy", "likelihood", "single-frequency", "pisarenko-merged",
    "two-returns", "unwrapped-phase",
)  # fmt: skip
"""Estimators that `Reconstruction` implements itself."""
ESTIMATORS = (
    *OWN,
    *(
        each.name
        for each in TECHNIQUES.values()
        if each.measures == "moments" and each.name not in OWN
    ),
)
"""What the range may be taken from; see `transientcam_moments.comparisons`."""


def automatic(multiples: tuple[int, ...] | None) -> str:
    """Return the estimator that "automatic" is for frequencies; none stand for consecutive ones."""
    if not multiples or multiples[-1] == len(multiples):
        return "likelihood"
    # two returns of three frequencies leave something to judge them by
    return (
        "two-returns"
        if len(multiples) > 2 and multiples[-1] <= MAX_HARMONICS
        else "unwrapped-phase"
    )


def least_harmonics(estimator: str) -> int:
    """Return the smallest m that an estimator gives a range of; 1 where it cannot be used."""
    try:
        return technique_of(estimator).least_harmonics
    except (KeyError, PluginFailed):
        return 1


@dataclass(frozen=True, slots=True)
class Settings:
    """How moments become range.

    Attributes
    ----------
    base_frequency_hz : float, optional
        f, of the first harmonic. Ranges and times of flight need it.
    zeroth : {"low-frequency", "on-off", "estimated"}, optional
        How b_0 was measured (Sec. 4.3). Raw images need it; moments whose b_0 is 0 since it was
        not measured are "estimated".
    low_frequency_hz : float, optional
        Where b_0 was measured so: of raw images ranges are unambiguous to half its wavelength.
    delay_s : float
        Of light within the camera, as its data sheet has it: which turn that is.
    takes : int, optional
        Captures in the images, averaged without outliers. Raw images need it.
    multiples : tuple of int, optional
        Which multiples of the base frequency were measured, ascending; 1 to m, when left out. Only
        `OF_ANY_MULTIPLES` serve others, and "unwrapped-phase" alone those above 32.
    phases_rad : tuple of float, optional
        Of the raw images of each frequency, in their order, three or more: 0, 90, 180 and 270
        degrees, when left out.
    epsilon : float
        Least uniform part relative to b_0 (Sec. 4.3), 0 <= epsilon < 1.
    keep : {"harmonics", "brightness"}
        What biasing leaves as it is.
    neighbours : {"edge-preserving", "gaussian", "none"}
        How moments are averaged over neighbouring pixels: "edge-preserving", the default, is
        `average_neighbours`, and the Gaussian where the noise is neither stated nor told by images;
        those of a reconstruction say which was applied. "gaussian" is the paper's (Sec. 6). There
        is none without two image axes.
    still_frames : int
        How many frames of a stream `Reconstructor.average` averages where nothing changes, at most;
        1 to `noise.MOST_FRAMES`. A frame by itself never uses others.
    smoothing_sigma_px : float
        Of the Gaussian; 0 for none.
    least_range_m : float
        Of the sensor, where a turn of the phase, c / (2 f), begins, and so "first". For 0 strong
        first light in the last 64th is below 0: noise puts nothing at 0 m to the far end.
    max_range_m : float, optional
        No target is beyond it, which multiples above 32 need; what the frequencies tell apart, when
        left out.
    threshold : float
        The range is that of the first return, or peak, with this share of the strongest one's
        weight, or density.
    estimator : str
        What the range is taken from: "automatic" is "likelihood", or "two-returns" where the
        multiples have gaps ("unwrapped-phase" of two). By name also "pisarenko" as the paper has
        it, "pisarenko-merged" (see `merge_returns`), "maximum-entropy", "two-returns" (see
        `two_returns`), "unwrapped-phase" (see `unwrap`), "single-frequency", which is the usual
        arg b_1, or another of the `comparisons` of moments, or that of another package.
    minimum_brightness : float
        Pixels with b_0 at or below it have no signal, in the unit of the moments.
    full_scale : float
        Largest value of a raw image; pixels that reach it are saturated.
    spoilt_images : {"repair", "fill", "keep"}
        What becomes of raw images that lost their synchronisation (Sec. 6): rebuilt where sums of
        opposite images find them (`repair`), and where those don't, also filled in from the
        frame before, or kept as they are.
    sensor : noise.Sensor, optional
        Whose noise the images have; "likelihood", "two-returns" and "unwrapped-phase" weigh the
        moments by it, and "pisarenko-merged" merges by it. Without one it is measured in the
        images (`noise.image_noise`), and of moments alone some is assumed, see `likelihood`.
    """

    base_frequency_hz: float | None = None
    zeroth: str | None = None
    takes: int | None = None
    multiples: tuple[int, ...] | None = None
    phases_rad: tuple[float, ...] | None = None
    epsilon: float = EPSILON
    keep: str = "harmonics"
    neighbours: str = "edge-preserving"
    smoothing_sigma_px: float = SIGMA_PX
    threshold: float = DIRECT_THRESHOLD
    estimator: str = "automatic"
    minimum_brightness: float = 0.0
    full_scale: float = 4095.0
    spoilt_images: str = "repair"
    sensor: Sensor | None = None
    low_frequency_hz: float | None = None
    delay_s: float = 0.0
    still_frames: int = 1
    least_range_m: float = 0.0
    max_range_m: float | None = None

    def __post_init__(self) -> None:
        """Refuse what no stage could work with (ParameterError)."""
        if self.base_frequency_hz is not None and not 0 < self.base_frequency_hz < float("inf"):
            raise ParameterError("base_frequency_hz", self.base_frequency_hz, "> 0 and finite")
        if self.zeroth is not None:
            chosen("zeroth", self.zeroth, tuple(ZEROTH_IMAGES))
        if self.takes is not None and self.takes < 1:
            raise ParameterError("takes", self.takes, ">= 1")
        if self.sensor is not None:
            for field in ("zeroth", "takes"):
                if getattr(self, field) is None:
                    raise ParameterError(field, None, "stated, for the noise of a sensor")
        phase_weights(self.sampled_rad)
        most = MAX_HARMONICS if self.max_range_m is None else MAX_MULTIPLE
        if self.multiples is not None and not _ascending(self.multiples, most):
            raise ParameterError("multiples", self.multiples, f"ascending, from 1 to {most}")
        if self.max_range_m is not None and not 0 < self.max_range_m < float("inf"):
            raise ParameterError("max_range_m", self.max_range_m, "> 0 m and finite")
        in_range("epsilon", self.epsilon, 0.0, float(np.nextafter(1.0, 0.0)), "0 <= epsilon < 1")
        chosen("keep", self.keep, ("harmonics", "brightness"))
        chosen("neighbours", self.neighbours, NEIGHBOURS)
        in_range("still_frames", self.still_frames, 1, MOST_FRAMES, f"1 to {MOST_FRAMES}")
        in_range("smoothing_sigma_px", self.smoothing_sigma_px, 0.0, 100.0, "0 to 100 pixels")
        in_range("least_range_m", self.least_range_m, -1000.0, 1000.0, "-1000 to 1000 m")
        in_range("threshold", self.threshold, 0.0, 1.0, "0 to 1")
        if self.estimator not in ESTIMATORS:
            chosen("estimator", self.estimator, ("automatic", *ESTIMATORS, *PLUGINS.names()))
        chosen("spoilt_images", self.spoilt_images, CORRUPT_IMAGES)

    @property
    def least_harmonics(self) -> int:
        """The smallest m that the estimator gives a range of."""
        return least_harmonics(self.technique)

    @property
    def technique(self) -> str:
        """The estimator, also where it is automatic."""
        return automatic(self.multiples) if self.estimator == "automatic" else self.estimator

    def least_light(self, dtype: DTypeLike) -> float:
        """Return the brightness that is no signal: subnormal moments have too few digits, too."""
        return max(self.minimum_brightness, float(np.finfo(dtype).tiny))

    @property
    def start_rad(self) -> float:
        """Phase at the base frequency where a turn begins."""
        if not self.least_range_m or self.base_frequency_hz is None:
            return -2 * np.pi / 64
        return self.least_range_m / float(range_m(1.0, self.base_frequency_hz))

    @property
    def most_rad(self) -> float | None:
        """Phase at the base frequency of the largest range; None for a turn."""
        if self.max_range_m is None or self.base_frequency_hz is None:
            return None
        most = self.max_range_m / float(range_m(1.0, self.base_frequency_hz))
        return most if most < 2 * np.pi else None

    @property
    def low_ratio(self) -> float:
        """The low frequency over the base frequency; 0 where it cannot tell turns."""
        ratio = (self.low_frequency_hz or 0.0) / (self.base_frequency_hz or math.inf)
        return ratio if ratio < 1 else 0.0

    @property
    def sampled_rad(self) -> tuple[float, ...]:
        """Phases of the raw images of each frequency."""
        return FOUR_PHASES_RAD if self.phases_rad is None else self.phases_rad

    @property
    def gaussian_px(self) -> float:
        """Standard deviation of the Gaussian that moments are smoothed with; 0 for none."""
        return self.smoothing_sigma_px if self.neighbours == "gaussian" else 0.0

    @property
    def consecutive(self) -> bool:
        """Whether the multiples are 1 to m, as the trigonometric moment problem needs."""
        return self.multiples is None or self.multiples[-1] == len(self.multiples)


def _ascending(multiples: tuple[int, ...], most: int) -> bool:
    """Return whether there are multiples, each larger than the one before."""
    inside = bool(multiples) and multiples[0] >= 1 and multiples[-1] <= most
    return inside and list(multiples) == sorted(set(multiples))
