"""What follows from the moments of an image: each property computed once, when first read."""

import math
from collections.abc import Callable
from functools import cached_property, partial
from html import escape
from typing import Any

import numpy as np

from transientcam_compiled import Spread, at_once
from transientcam_moments._dispatch import elsewhere
from transientcam_moments.arrays import Array, in_turn, map_html, namespace
from transientcam_moments.comparisons import (
    PLUGINS,
    TECHNIQUES,
    Technique,
    check_order,
    separated,
    technique_of,
)
from transientcam_moments.errors import ParameterError, UnlabelledImages
from transientcam_moments.images import HarmonicCorrection, Repair
from transientcam_moments.likelihood import (
    CORRECTED_ERROR,
    MODEL_ERROR,
    MOST_RETURNS,
    Likelihood,
    Unwrapped,
    fitted,
    fitted_pairs,
    merge_returns,
    unwrap,
)
from transientcam_moments.moment_problem import (
    Coefficients,
    Peaks,
    Returns,
    Separation,
    bias,
    cumulative,
    density,
    estimate_zeroth,
    levinson,
    peaks,
    pisarenko,
    separate,
    smallest_eigenvalue,
)
from transientcam_moments.noise import (
    CapturedImages,
    ImageNoise,
    MomentNoise,
    Sensor,
    image_noise,
    scatter,
    smoothed_of,
)
from transientcam_moments.plugins import CALLERS
from transientcam_moments.reconstruction._detection import undetected, undetected_pixels
from transientcam_moments.reconstruction._flags import INVALID, Flags, flags
from transientcam_moments.reconstruction._neighbours import (
    applicable,
    over_neighbours,
    sensor_noise,
)
from transientcam_moments.reconstruction._ranging import range_m
from transientcam_moments.reconstruction._settings import (
    ESTIMATORS,
    OF_ANY_MULTIPLES,
    OWN,
    Settings,
)
from transientcam_moments.reconstruction._turns import beginning_at, begun, turned

_SHOWN = ("smoothed", "flags", "coefficients", "returns", "range_m")
"""Properties that the short text of a reconstruction names once they are computed."""


class Reconstruction:
    """A transient image and all that follows from it.

    Every property is computed when it is first read, from the ones it needs, and kept; some are
    there from the start where a `Reconstructor` has computed them in one pass. All have the shape
    of the pixels; brightnesses are in the unit of the moments, and direct + indirect + uniform =
    brightness. Arrays belong to this object alone and stay as they are.

    Parameters
    ----------
    moments : array, shape (m + 1, ...)
        Calibrated.
    settings : Settings
        How to go on.
    saturated_pixels : boolean array, shape (...), optional
        Pixels to be flagged.
    bad_pixels : boolean array, shape (...), optional
        Pixels to be flagged as replaced.
    kept : boolean array, shape (takes, N), optional
        Which images went into the moments; all, when left out.
    repaired : Repair, optional
        What was done to the images before.
    calibration : array, shape (m + 1,) or (m + 1, ...), optional
        Gains that the moments were divided by, for their noise; 1, when left out.
    correction : HarmonicCorrection, optional
        What is taken out of the moments once they are smoothed.
    spread : callable, optional
        How the likelihood uses several threads, as `kernels.over` returns it.
    images : CapturedImages, optional
        What the moments were measured from, which tells their noise.
    low : array, shape (...), optional
        Light at the low frequency of b_0, whose phase tells turns; within one, when left out.
    frames : array, shape (H, W), optional
        How many frames each pixel of the moments is the mean of; one, when left out.
    known_noise : Sensor or ImageNoise, optional
        Of the images, where it was looked for before; that of the settings, when left out.
    device : callable, optional
        Computes what kernels do on a device, where there is one; see `kernels.use_device`.

    Raises
    ------
    ParameterError
        When the settings have other multiples than 1 to m, which `reconstruct` serves.
    """

    _of_any_multiples = False

    def __init__(
        self,
        moments: Array,
        settings: Settings,
        saturated_pixels: Array | None = None,
        *,
        bad_pixels: Array | None = None,
        kept: Array | None = None,
        repaired: Repair | None = None,
        calibration: Array | None = None,
        correction: HarmonicCorrection | None = None,
        spread: Spread = at_once,
        images: CapturedImages | None = None,
        low: Array | None = None,
        frames: Array | None = None,
        known_noise: Sensor | ImageNoise | None = None,
        device: Callable[..., Any] | None = None,
    ) -> None:
        if not (settings.consecutive or self._of_any_multiples):
            raise ParameterError("multiples", settings.multiples, "1 to m")
        known = settings.sensor if known_noise is None else known_noise
        self.settings = applicable(settings, known)
        if known is not None:
            self.image_noise = known
        self._correction = correction
        self._spread = spread
        self._device = device
        self._measured = moments
        self._saturated = saturated_pixels
        self._bad = bad_pixels
        self._kept = kept
        self._repaired = repaired
        self._calibration = calibration
        self._images = images
        self._low = low
        self.frames_averaged = frames

    @cached_property
    def measured(self) -> Array:
        """Calibrated moments (m + 1, ...) of the frame alone, not smoothed."""
        return self._measured

    @cached_property
    def rejected_images(self) -> int:
        """How many images were left out of the average over takes, as outliers."""
        return 0 if self._kept is None else int((~self._kept).sum())

    @cached_property
    def repaired_images(self) -> int:
        """How many images that lost their synchronisation were rebuilt from the others."""
        return 0 if self._repaired is None else int(self._repaired.repaired.sum())

    @cached_property
    def unrepaired_images(self) -> int:
        """How many images are of pairs that contradict the others and could not be repaired."""
        return 0 if self._repaired is None else int(self._repaired.unrepaired.sum())

    @cached_property
    def filled_images(self) -> tuple[tuple[int, int], ...]:
        """Take and place in it of the images that are those of the frame before."""
        if self._repaired is None:
            return ()
        return tuple((int(t), int(i)) for t, i in np.argwhere(self._repaired.filled))

    @cached_property
    def _averaged(self) -> tuple[Array, Array | None]:
        """Moments averaged over neighbours, and `variance_share`."""
        left_out, gains = (self._saturated, self._bad), self._calibration
        how = self._images, self._spread, self.frames_averaged
        known = self.image_noise if self.settings.neighbours == "edge-preserving" else None
        return over_neighbours(self._measured, self.settings, known, gains, left_out, *how)

    @property
    def variance_share(self) -> Array | None:
        """What averaging over neighbours that agree and over frames has left of the variance.

        (H, W), over that of one frame by itself, or after the Gaussian; None where there was none.
        """
        return self._averaged[1]

    @cached_property
    def _corrected(self) -> tuple[Array, Array | None]:
        """Smoothed moments without the known harmonics, and where these were taken out."""
        moments = self._averaged[0]
        return (moments, None) if self._correction is None else self._correction(moments)

    @cached_property
    def corrected_pixels(self) -> int | None:
        """Of how many pixels known harmonics were taken out; None where none are known."""
        corrected = self._corrected[1]
        return None if corrected is None else int(corrected.sum())

    @cached_property
    def smoothed(self) -> Array:
        """Moments (m + 1, ...) smoothed over pixels, b_0 estimated where it wasn't measured.

        Known harmonics of the modulation are taken out.
        """
        moments = self._corrected[0]
        if self.settings.zeroth == "estimated":
            moments = estimate_zeroth(moments, self.settings.epsilon)
        return moments

    @cached_property
    def eigenvalue(self) -> Array:
        """Smallest eigenvalue of the Toeplitz matrix before biasing."""
        if self.settings.zeroth == "estimated":  # by construction
            return self.settings.epsilon * self.smoothed[0].real
        return smallest_eigenvalue(self.smoothed)

    @cached_property
    def validity(self) -> Array:
        """Smallest eigenvalue over b_0 before biasing; NaN without signal."""
        xp = namespace(self.eigenvalue)
        b0 = self.smoothed[0].real
        with np.errstate(divide="ignore", invalid="ignore"):
            return xp.where(b0 > 0, self.eigenvalue / b0, np.nan).astype(b0.dtype)

    @cached_property
    def _biased(self) -> tuple[Array, Array]:
        if self.settings.zeroth == "estimated":  # has its uniform part by construction
            return self.smoothed, namespace(self.smoothed).zeros(self.eigenvalue.shape, dtype=bool)
        return bias(
            self.smoothed,
            self.settings.epsilon,
            keep=self.settings.keep,
            eigenvalue=self.eigenvalue,
        )

    @property
    def moments(self) -> Array:
        """Moments (m + 1, ...) with a positive definite Toeplitz matrix wherever there is light."""
        return self._biased[0]

    @cached_property
    def flags(self) -> Array:
        """Flags of every pixel, uint8 of `Flags`."""
        xp = namespace(self.smoothed)
        found = self._flags_of_moments
        if self._open is not None:
            open_ = self._open & self._has_phase
            found = found | xp.where(open_, int(Flags.CONTRADICTORY), 0).astype(xp.uint8)
        if self.settings.technique not in OF_ANY_MULTIPLES or self.noise is None:
            return found
        estimate = self.estimate
        unexplained = self.has_range & ~estimate.explained()
        undetermined = self.has_range & estimate.ambiguous()
        found = found | xp.where(unexplained, int(Flags.UNEXPLAINED), 0)
        found = found | xp.where(undetermined, int(Flags.DEGENERATE), 0)
        return found.astype(xp.uint8)

    @cached_property
    def _flags_of_moments(self) -> Array:
        """Those that follow from moments and images alone."""
        xp = namespace(self.smoothed)
        found = flags(
            self.smoothed,
            minimum_brightness=self.settings.least_light(self.smoothed.dtype),
            eigenvalue=self.eigenvalue,
        )
        # biasing made the matrix definite; what is left of its defect is the flag for biasing
        found = xp.where(found == int(Flags.DEGENERATE), 0, found)
        if self._undetected is not None:
            found = found | xp.where(self._undetected, int(Flags.NO_SIGNAL), 0)
        found = found | xp.where(self._biased[1], int(Flags.BIASED), 0)
        if self._saturated is not None:
            found = found | xp.where(xp.asarray(self._saturated), int(Flags.SATURATED), 0)
        if self._bad is not None:
            found = found | xp.where(xp.asarray(self._bad), int(Flags.REPLACED), 0)
        return found.astype(xp.uint8)

    @cached_property
    def _undetected(self) -> Array | None:
        """Where the moments are no more than noise; None where none are, or it isn't known."""
        moments, noise_of = self.smoothed, self._noise_of(None)
        if noise_of is None:
            return None
        if not isinstance(moments, np.ndarray):
            return undetected(moments, self.noise) if self.noise is not None else None
        sigma_px, gains = self.settings.gaussian_px, self._calibration
        brightness, share = self._least_brightness, self.variance_share
        return undetected_pixels(
            moments, brightness, noise_of, sigma_px, gains, self.ambient, share
        )

    def _noise_of(self, gains: Array | None) -> Callable[..., MomentNoise] | None:
        """Return what tells the noise of moments divided by gains, of the brightness."""
        return sensor_noise(self.settings, self.image_noise, gains, len(self.smoothed))

    def add_flag(self, flag: Flags, where: Array) -> None:
        """Add a flag to pixels, of which something is known that the moments do not show.

        Parameters
        ----------
        flag
            Such as `Flags.CONTRADICTORY`, which rests on the noise of the sensor.
        where : boolean array, shape (...)
        """
        xp = namespace(self.flags)
        self.flags = self.flags | xp.asarray(where).astype(xp.uint8) * xp.uint8(flag)

    @property
    def has_range(self) -> Array:
        """Where there is light, more than noise where that is known, all moments are finite, and a
        low frequency does not leave open which turn a range is in.
        """
        return self._has_phase if self._open is None else self._has_phase & ~self._open

    @property
    def _open(self) -> Array | None:
        """Where a low frequency leaves open which turn a range is in; None where none tells."""
        # other packages' estimators can fail, which is no reason to have no flags
        own = self.settings.technique in ESTIMATORS
        return self._turned[1] if own and self._turned is not None else None

    @property
    def _has_phase(self) -> Array:
        return (self._flags_of_moments & int(INVALID)) == 0

    @cached_property
    def coefficients(self) -> Coefficients:
        """Coefficients of the maximum entropy density."""
        return levinson(self.moments)

    @cached_property
    def returns(self) -> Returns:
        """Sharp returns and the uniform part (Pisarenko)."""
        return pisarenko(self.moments, eigenvalue=self._eigenvalue_after)

    @property
    def _eigenvalue_after(self) -> Array:
        """Smallest eigenvalue after biasing, which need not be searched for again."""
        if self.settings.keep == "harmonics":
            with np.errstate(invalid="ignore"):  # of pixels that are not finite
                return self.eigenvalue + (self.moments[0].real - self.smoothed[0].real)
        xp = namespace(self.moments)
        least = self.settings.epsilon * self.moments[0].real
        return xp.where(self._biased[1], least, self.eigenvalue)

    @cached_property
    def peaks(self) -> Peaks:
        """Local maxima of the maximum entropy density above the threshold."""
        return peaks(self.coefficients, threshold=self.settings.threshold)

    @cached_property
    def image_noise(self) -> Sensor | ImageNoise | None:
        """Noise of the images: of the settings' sensor, else as they show it themselves.

        None of moments alone, and where the images do not tell.
        """
        if self.settings.sensor is not None or self._images is None:
            return self.settings.sensor
        return image_noise(self._images, self._least_brightness)

    @cached_property
    def noise_ratio(self) -> float | None:
        """Deviation of the images over that of the settings' sensor, at the median of b_0.

        None without such a sensor, and where the images do not tell: nor do those that a driver
        made of moments, which hold no more noise than that of rounding.
        """
        sensor, brightness = self.settings.sensor, np.asarray(self._least_brightness)
        if sensor is None or self._images is None:
            return None
        found = image_noise(self._images, brightness)
        if found is None:
            return None
        signal = np.median(brightness[brightness > 0]) / 2
        stated = sensor.image_variance(np.maximum(signal + found.dark_dn - sensor.dark_dn, 0))
        shown = float(found.image_variance(signal))
        return float(np.sqrt(shown / stated)) if shown > 2 / 12 else None

    @cached_property
    def noise(self) -> MomentNoise | None:
        """Noise of the smoothed moments (m + 1, ...) by that of the images; None without."""
        moments, noise_of = self.smoothed, self._noise_of(self._calibration)
        if noise_of is None:
            return None
        brightness, share = self._least_brightness, self.variance_share
        sigma_px = self.settings.gaussian_px
        if sigma_px > 0 and moments.ndim == 3:
            noise = smoothed_of(noise_of, brightness, sigma_px, ambient=self.ambient)
        else:
            noise = noise_of(brightness, ambient=0.0 if self.ambient is None else self.ambient)
        return noise if share is None else MomentNoise(noise.variance * share)

    @cached_property
    def ambient(self) -> Array | None:
        """Light (...) in DN an image that is not the camera's, by `noise.ambient_light`.

        None where there is hardly any, and without images or their noise. Light that all pixels
        have counts as dark level where no sensor is stated.
        """
        if self._images is None or self.image_noise is None:
            return None
        return self._images.ambient(self._least_brightness, self.image_noise)

    @property
    def _least_brightness(self) -> Array:
        """What is known of b_0: how bright an image is, and so how noisy."""
        return self.smoothed[0].real

    @cached_property
    def likelihood(self) -> Likelihood:
        """Few returns, or one with a tail, with what they are worth; of moments as measured."""
        moments, noise, harmonics, error = self._evidence
        most = MOST_RETURNS
        if harmonics is not None:
            most = min(most, sum(j > 0 for j in harmonics))
        at = self.settings.threshold
        with elsewhere(self._device):
            return fitted(
                moments, noise, self._spread, harmonics, most, model_error=error, threshold=at
            )

    @cached_property
    def two_returns(self) -> Likelihood:
        """One or two returns, as many as the noise justifies, with what they are worth."""
        moments, noise, harmonics, error = self._evidence
        at = self.settings.threshold
        return fitted_pairs(moments, noise, self._spread, harmonics, error, at)

    @cached_property
    def unwrapped(self) -> Unwrapped:
        """One return by the phases of all frequencies, and how clear it is."""
        moments, noise, harmonics, error = self._evidence
        most_rad = self.settings.most_rad
        return unwrap(moments, noise, harmonics=harmonics, model_error=error, most_rad=most_rad)

    @property
    def estimate(self) -> Likelihood | Unwrapped:
        """That of the settings if it is one of `OF_ANY_MULTIPLES`; `likelihood` else."""
        if self.settings.technique == "two-returns":
            return self.two_returns
        return self.unwrapped if self.settings.technique == "unwrapped-phase" else self.likelihood

    @property
    def _evidence(self) -> tuple[Array, MomentNoise | None, tuple[int, ...] | None, float]:
        """Moments as measured, their noise and multiples, and what is wrong with them beside it."""
        error = MODEL_ERROR if self._correction is None else CORRECTED_ERROR
        if self.noise is None:  # assumed noise is large beside it
            error = 0.0
        return self.smoothed, self.noise, None, error

    @cached_property
    def reduced_chi_square(self) -> Array:
        """Chi-square of `estimate` over its degrees of freedom; NaN without a range or any."""
        xp = namespace(self.smoothed)
        found = self.estimate.reduced_chi_square
        return xp.where(self.has_range, found, np.nan).astype(found.dtype)

    @cached_property
    def range_std_m(self) -> Array:
        """Standard deviation in m of the range of `estimate`; NaN where there is none.

        With the noise of a sensor, errors of calibration (`MODEL_ERROR`) are in it, too: frames
        scatter less, by `range_scatter_m`.
        """
        xp = namespace(self.smoothed)
        estimate = self.estimate
        if isinstance(estimate, Unwrapped):
            std = estimate.phase_std_rad
        else:
            std = estimate.direct_phase_std_rad(self.settings.threshold)
        found = range_m(std, self._base_frequency_hz)
        return xp.where(self.has_range, found, np.nan).astype(std.dtype)

    def range_scatter_m(self, pixels: Array | slice = slice(None)) -> Array:
        """Return the standard deviation in m of that range between frames: `range_std_m` by noise.

        Parameters
        ----------
        pixels
            Which of the flat pixels, all by default.

        Returns
        -------
        array, shape (P)
            To first order, as `tm.noise.scatter` has it; NaN where there is no range.
        """
        moments, noise, harmonics, error = self._evidence
        std = self.range_std_m.reshape(-1)[pixels]
        if noise is None or not error:
            return std
        multiples = range(len(moments)) if harmonics is None else harmonics
        flat = moments.reshape((len(moments), -1))[:, pixels]
        variance = namespace(flat).broadcast_to(noise.variance, moments.shape)
        of_them = MomentNoise(variance.reshape((len(moments), -1))[:, pixels])
        return (std * scatter(flat, of_them, multiples, error)).astype(std.dtype)

    @cached_property
    def _sharp(self) -> Returns | Likelihood:
        """Returns, one of which is the direct one."""
        if self.settings.technique in ("likelihood", "two-returns"):
            return self.two_returns if self.settings.technique == "two-returns" else self.likelihood
        merged = self.settings.technique == "pisarenko-merged"
        return merge_returns(self.returns, self.noise) if merged else self.returns

    @cached_property
    def _separation(self) -> Separation:
        """Direct and indirect light of the turn from the least range on."""
        at, technique = self.settings.threshold, self._technique
        if technique is not None:
            xp = namespace(self.smoothed)
            b = np.asarray(self.smoothed)
            check_order(b.shape[0] - 1, least=technique.least_harmonics, name=technique.name)
            # as measured: none of them needs biased moments
            if technique.name in TECHNIQUES:
                parts = technique.estimate(b).separate(at)
            else:
                told = self._variance, self._frequencies_hz
                call = partial(CALLERS[-1], PLUGINS.group, separated, technique.name)
                parts = call(b, *told, at)
            return self._lone(Separation(*(xp.asarray(part) for part in parts)))
        if self.settings.technique == "unwrapped-phase":
            return self._lone(self.unwrapped.separate())
        sharp = self._sharp
        found = sharp.separate(at) if isinstance(sharp, Likelihood) else separate(sharp, at)
        return self._first(found, sharp.phase_rad, sharp.weight)

    def _first(self, found: Separation, phase: Array, weight: Array) -> Separation:
        """Return the first of several; strong just below 0 where the least range is 0."""
        least = self.settings.threshold if self.settings.least_range_m else 0.75
        return beginning_at(self.settings.start_rad, found, phase, weight, least)

    def _lone(self, found: Separation) -> Separation:
        turn = 2 * np.pi / math.gcd(*(self.settings.multiples or (1,)))
        return found._replace(phase_rad=begun(found.phase_rad, self.settings.start_rad, turn))

    @property
    def _technique(self) -> Technique | None:
        """The technique of the settings where this class does not implement it itself."""
        name = self.settings.technique
        return None if name in OWN else technique_of(name)

    @property
    def _variance(self) -> Array | None:
        """Variance (m + 1, ...) of the moments, of each pixel, where it is known."""
        noise = self.noise
        return None if noise is None else np.broadcast_to(noise.variance, self.smoothed.shape)

    @property
    def _frequencies_hz(self) -> Array:
        return (self.settings.base_frequency_hz or np.nan) * np.arange(len(self.smoothed))

    @cached_property
    def brightness(self) -> Array:
        """b_0, after biasing."""
        return self.moments[0].real

    @cached_property
    def uniform(self) -> Array:
        """Brightness of the uniform part; of another technique, what it leaves unexplained.

        That is negative where noise, or a contradiction, makes the returns brighter than b_0.
        """
        if self.settings.technique not in ("pisarenko", "maximum-entropy", "single-frequency"):
            return self.brightness - self.direct - self.indirect
        return self.returns.uniform

    @cached_property
    def direct(self) -> Array:
        """Brightness of the direct return."""
        return self._placed.direct

    @cached_property
    def indirect(self) -> Array:
        """Brightness of all later returns, and of earlier ones below the threshold."""
        return self._placed.indirect

    @cached_property
    def phase_rad(self) -> Array:
        """Phase of the direct return by the estimator of the settings; NaN where there is none.

        With the turns before it, where the phase at a low frequency was measured.
        Raises ParameterError, as `direct` does, where the estimator needs more harmonics.
        """
        xp = namespace(self.moments)
        found, there = self._in_turn, self.has_range
        if self._turned is not None:
            found, there = self._turned[0], there & ~self._turned[1]
        return xp.where(there, found.phase_rad, np.nan).astype(self.brightness.dtype)

    @property
    def _placed(self) -> Separation:
        return self._separation if self._turned is None else self._turned[0]

    @cached_property
    def _turned(self) -> tuple[Separation, Array] | None:
        """What `turned` returns; None where no low frequency tells, and without a range at all."""
        if self._low is None or len(self.smoothed) <= self.settings.least_harmonics:
            return None
        settings, found, technique = self.settings, self._in_turn, self.settings.technique
        peaky = technique == "maximum-entropy"
        phase, weight = self.peaks[2:] if peaky else (self._sharp.phase_rad, self._sharp.weight)
        # the phase of one moment, or of all, is of no return that could come first instead
        lone = technique in ("single-frequency", "unwrapped-phase")
        light, noise_of = self.smoothed[0].real, self._noise_of(self._calibration)
        sigma_px = settings.smoothing_sigma_px * (settings.neighbours != "none")
        std: Array | float = 0.0
        with np.errstate(all="ignore"):  # of pixels without light
            if noise_of is not None:
                noise = noise_of(light, ambient=0.0 if self.ambient is None else self.ambient)
                std = namespace(light).sqrt(noise.variance[0]) / light
            placed, open_ = turned(
                self._low, settings.low_ratio, found, phase, weight, std, sigma_px,
                np.inf if lone else settings.threshold,
            )  # fmt: skip
        return self._separation._replace(phase_rad=placed.phase_rad) if peaky else placed, open_

    @cached_property
    def _in_turn(self) -> Separation:
        """Direct light and its phase from the least range on, whatever it is worth."""
        found, b = self._separation, self.moments[1]
        if self.settings.technique == "maximum-entropy":
            first = found._replace(phase_rad=self.peaks.first_rad)
            of_peaks = self._first(first, self.peaks.phase_rad, self.peaks.density)
            return found._replace(phase_rad=of_peaks.phase_rad)
        if self.settings.technique == "single-frequency":
            phase = in_turn(namespace(b).arctan2(b.imag, b.real))
            return self._lone(found._replace(phase_rad=phase))
        return found

    @cached_property
    def range_m(self) -> Array:
        """Range in m; NaN where there is none.

        Raises UnlabelledImages where the settings have no base frequency.
        """
        return range_m(self.phase_rad, self._base_frequency_hz)

    def density(self, time_s: Array, *, evaluation: str = "modulus") -> Array:
        """Return the density (T, ...) in the unit of the moments per second at times of flight."""
        turn = 2 * np.pi * self._base_frequency_hz
        time = np.asarray(time_s, dtype=float)
        with elsewhere(self._device):
            return turn * density(self.coefficients, turn * time, evaluation=evaluation)

    def cumulative(self, time_s: Array) -> Array:
        """Return the brightness (T, ...) that has come back until times of flight in s."""
        turn = 2 * np.pi * self._base_frequency_hz
        with elsewhere(self._device):
            return cumulative(self.coefficients, turn * np.asarray(time_s, dtype=float))

    @property
    def _base_frequency_hz(self) -> float:
        if self.settings.base_frequency_hz is None:
            raise UnlabelledImages(("base_frequency_hz",))
        return self.settings.base_frequency_hz

    def __repr__(self) -> str:
        """State order, pixels, light and how far it was computed; nothing is computed for it."""
        known = vars(self)
        order, shape = self._shape
        frequency_hz = self.settings.base_frequency_hz
        at = "" if frequency_hz is None else f" at {frequency_hz / 1e6:g} MHz"
        parts = [f"m = {order}{at}", f"pixels {' x '.join(map(str, shape)) or '1'}"]
        parts += [f"estimator {self.settings.technique}"]
        if "range_m" in known:
            parts.append(_in_metres(self.range_m))
        computed = [name for name in _SHOWN if name in known]
        return f"<Reconstruction {', '.join(parts)}; computed: {', '.join(computed) or 'nothing'}>"

    def _repr_html_(self) -> str:
        """Return its range as a map, for notebooks; the brightness without a base frequency."""
        shown = ""
        if len(self._shape[1]) == 2:
            if self.settings.base_frequency_hz is None:
                shown = map_html(self.brightness, title="brightness", unit="(as the moments)")
            else:
                shown = map_html(self.range_m, title="range", unit="m")
        return f"<p>{escape(repr(self))}</p>{shown}"

    @property
    def _shape(self) -> tuple[int, tuple[int, ...]]:
        """Order m, and the shape of the pixels."""
        planes = self._measured
        return planes.shape[0] - 1, tuple(planes.shape[1:])


def _in_metres(range_m: Array) -> str:
    """Return the least, middle and greatest range in words."""
    values = np.asarray(range_m)
    there = values[np.isfinite(values)]
    if not there.size:
        return "no range"
    low, middle, high = there.min(), np.median(there), there.max()
    without = 1 - there.size / values.size
    gaps = f", {without:.1%} without" if without else ""
    return f"range {low:.3f} to {high:.3f} m, median {middle:.3f} m{gaps}"
