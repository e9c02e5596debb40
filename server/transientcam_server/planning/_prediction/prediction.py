"""What accuracy a sequence will have on a scene, before it is captured.

Noisy moments are drawn around those of the scene and go through the estimator itself, so that
noise, bias and shares come from one computation, whatever the estimator. What is drawn depends on
a sequence by its frequencies and by how noisy it is: a few steps of noise serve every exposure and
number of takes.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from statistics import NormalDist
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

import transientcam_moments as tm
from transientcam_driver import Sequence
from transientcam_server.imaging import MEDIAN_OF_NORMAL, ranges_m
from transientcam_server.planning._prediction.averaging import LEAST_SHARE, averaged
from transientcam_server.planning._prediction.measures import (
    DISAGREEING,
    DOUBTFUL,
    KNOWN,
    RESAMPLED,
    UNKNOWN,
    Figure,
    PixelErrors,
    between,
    figure,
    pixel_errors,
)
from transientcam_server.planning._prediction.resolving import Resolving
from transientcam_server.planning._scene.estimation import MOST_HARMONICS
from transientcam_server.planning._scene.scene import STRATUM, SceneStatistics, resampled
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
DRAWS: Final = 6
"""Noisy captures of each pixel for a first prediction."""
FINE_DRAWS: Final = 30
"""And for the one that is stated."""
MAP_DRAWS: Final = 8
"""And for each pixel of a map."""
_AT_ONCE: Final = 2048
"""Pixels of a map whose draws are in memory together."""
FEW: Final = slice(None, None, 2)
"""The pixels that first predictions are made of: every other one of each kind."""
STEP: Final = 4.0
"""Factor between steps of noise."""
OUTLYING: Final = 4.0
"""What noise of the look adds to one pixel, over what those alike have, at most."""
SWING: Final = 0.25
"""Error of a range that changes evenly during a capture, over that change."""
OUTVOTED: Final = 3
"""Takes of which one that lost its synchronisation is left out."""
FOUR_PHASES: Final = np.array([1, 1j, -1, -1j])
NOMINAL: Final = Sequence(exposure_s=1e-3, zeroth="estimated")
"""The steps are multiples of its noise."""
_SHARES: Final = np.linspace(0.0, 1.0, 201)
"""For which it is stated how far ranges are off."""
_FEW_DRAWS: Final = 3
"""Every third draw tells the intervals of shares."""
_OF_MEDIAN: Final = math.pi / 2
"""Variance of the median of draws, which is in their bias, over that of one, times their number."""
_HARDLY: Final = 0.8
_NORMAL: Final = np.array([NormalDist().inv_cdf(0.5 + (k + 0.5) / 64) for k in range(32)])
"""Absolute values of a standard normal variable, each as likely."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """Predicted errors of the range.

    ``range_std``, ``range_error``: Noise, and the root sum of squares of noise and bias, pixel by
    pixel.
    ``range_bias_m``: Systematic error of the median pixel.
    ``most_bias_m``: Bias of the median pixel if the light begins where the moments only just allow
    it.
    ``bias_known``: Whether the moments tell the bias: not where shapes of light that explain them
    alike put the range elsewhere, nor where estimators disagree about the direct range at all
    frequencies, nor where many pixels may be lit by other surfaces alone.
    ``off_m``: How far the ranges of a capture are off, without sign, in equal shares by rising
    value.
    ``within``: What the share of a goal of them is within; None where a goal is of the median
    pixel.
    """

    range_std: Figure
    range_error: Figure
    range_bias_m: float
    most_bias_m: float
    bias_known: bool
    off_m: tuple[float, ...] = ()
    within: Figure | None = None

    def share_within(self, tolerance_m: float) -> float:
        """Return the share of a capture's ranges that are off by no more than that."""
        return float(np.interp(tolerance_m, self.off_m, _SHARES, left=0.0))


class Predictor:
    """Predicts for one scene, one sensor and one way to reconstruct.

    ``scene``: Of typical pixels.
    ``sensor``: Of the camera.
    ``settings``: Of the reconstruction; `estimator` is that of sequences that name none.
    ``seed``: Of all draws: the same arguments give the same result.
    ``go_on``: Called several times a second while this computes; whatever it raises ends that.
    ``closely``: Predict with all pixels of the scene, and not with few of them.
    ``share``: Of the ranges of a capture whose largest error is predicted; None for noise and bias
    together of the median pixel.
    """

    def __init__(
        self,
        scene: SceneStatistics,
        sensor: tm.noise.Sensor,
        settings: ReconstructionSettings,
        *,
        seed: int = 0,
        go_on: Callable[[], None] = lambda: None,
        closely: bool = False,
        share: float | None = None,
    ) -> None:
        self._share = share
        self._go_on = go_on
        self._whole = scene
        self.scene = scene if closely else scene.few()
        self.sensor = sensor
        self.settings = settings
        self._seed = seed
        self._averages = settings.neighbours == "edge-preserving"
        self._left = tm.noise.smoothing_factor(0.0 if self._averages else settings.gaussian_px)
        self._nominal = self.relative_noise(NOMINAL)
        self._column = lru_cache(maxsize=None)(self._drawn_column)
        self._exact = lru_cache(maxsize=None)(self._bias_without_noise)
        self.resolving = Resolving(self.scene, settings, seed=seed, go_on=go_on)

    def longest_exposure_s(self) -> float:
        """Exposure at which the scene's bright pixels just do not saturate."""
        light = self.scene.brightest_dn_per_s
        return self.sensor.brightest / light if light > 0 else math.inf

    def noise_scale(self, sequence: Sequence) -> float:
        """Return how noisy a sequence is, in units of a nominal one: 1 ms, one take."""
        return float(np.median(self.relative_noise(sequence) / self._nominal))

    def quick(self, estimator: str, sequence: Sequence, scale: float) -> tuple[float, float, float]:
        """Return deviation and bias in m of the median pixel, and the error, at a scale of noise.

        Between the steps that were drawn the logarithms of each pixel's errors are interpolated.
        """
        key = (estimator, self._harmonics(estimator, sequence), sequence.base_frequency_hz)
        place = math.log(scale) / math.log(STEP)
        below = math.floor(place)
        part = place - below
        low, high = (self._column(*key, below + k) for k in (0, 1))
        std, bias = (
            np.exp((1 - part) * np.log(one) + part * np.log(other))
            for one, other in ((low[0], high[0]), (low[1], high[1]))
        )
        bias = np.hypot(bias, self._drift_m)
        if self._share is None:
            error_m = np.median(np.hypot(std, bias))
        else:
            both = np.concatenate([_NORMAL, -_NORMAL])
            own = np.sqrt(np.maximum(bias**2 - _OF_MEDIAN / DRAWS * std**2, 0.0))
            error_m = np.quantile(np.abs(own + both[:, None] * std), self._share)
        return float(_typical(std)), float(np.median(bias)), float(error_m)

    def least_noise_m(self, estimator: str, sequence: Sequence, scale: float) -> float:
        """Return a bound in m on the noise of the median pixel: that of Cramer and Rao.

        Of one return with all the light, whose phase all frequencies tell together. As half of the
        pixels are noisier, a share s of all ranges reaches as far as 2 s - 1 of that pixel's.
        """
        m = self._harmonics(estimator, sequence)
        noise = float(np.median(self._nominal)) * scale
        noise *= math.sqrt(LEAST_SHARE) if self._averages else 1.0
        contrast = self.scene.contrast_at(m, sequence.base_frequency_hz)
        std_rad = noise / float(np.linalg.norm(np.arange(m + 1) * contrast))
        if self._share is not None:
            std_rad *= NormalDist().inv_cdf(max(self._share, 0.5))
        return float(tm.range_m(std_rad, sequence.base_frequency_hz))

    def least_bias_m(self, estimator: str, sequence: Sequence) -> float:
        """Return what the bias hardly lets the error fall below: that without noise.

        As half of a pixel's ranges are further off than it is, that is for a share s of them the
        bias of the share 2 s - 1 of the pixels.
        """
        m = self._harmonics(estimator, sequence)
        return self._exact(estimator, m, sequence.base_frequency_hz)

    def _bias_without_noise(
        self, estimator: str, harmonics: int, base_frequency_hz: float
    ) -> float:
        """Bias in m that no exposure and no takes reduce."""
        self._go_on()
        scene = self.scene
        if scene.again:  # whose noise would be in it
            return 0.0
        b = scene.relative_moments(harmonics, base_frequency_hz)[:, FEW]
        variance = np.broadcast_to((self._nominal[FEW] * STEP**-4) ** 2, b.shape).astype(np.float32)
        variance[0] = 0
        range_m = ranges_m(b, variance, estimator, base_frequency_hz, self.settings)
        bias_m = np.hypot(range_m - scene.direct_m[FEW], scene.uncertainty_m[FEW])
        # noise of the look itself is in this, and in the direct range
        share = 0.5 if self._share is None else max(0.0, 2 * self._share - 1)
        known = np.sort(np.nan_to_num(bias_m, nan=math.inf))
        return _HARDLY * float(known[int(share * (known.size - 1))])

    def predict(
        self, estimator: str, sequence: Sequence, *, closely: bool = False, capture_s: float = 0.0
    ) -> Prediction:
        """Predict the errors of a sequence and an estimator, with intervals.

        ``closely``, with all pixels of the scene: several times the work, and narrower intervals.
        What moves while it is captured, for ``capture_s``, is part of the errors.
        """
        if closely:
            return self._closer.predict(estimator, sequence, capture_s=capture_s)
        harmonics = self._harmonics(estimator, sequence)
        noise = self.relative_noise(sequence)
        lost = self.scene.lost_share if sequence.takes < OUTVOTED else 0.0
        if sequence.harmonics > 1:  # rebuilt from the opposite image and the sums
            noise, lost = noise * math.sqrt(1 + 2 * lost), 0.0
        errors = self._errors(
            estimator,
            harmonics,
            sequence.base_frequency_hz,
            noise,
            FINE_DRAWS,
            sequence.zeroth,
            lost=(lost, sequence.takes),
        )
        farthest_m = errors.farthest_m(self.scene.earliest_m, self.scene.latest_m)
        if self.scene.swing_m_per_s is not None:
            moved_m = SWING * capture_s * self.scene.swing_m_per_s
            errors = replace(errors, bias_m=np.hypot(errors.bias_m, moved_m))
        known = bool(
            self.scene.calibrated
            and not self.scene.lit_in_part
            and self.scene.disagreement_m <= DISAGREEING * _median(errors.error_m)
            and _median(np.hypot(errors.std_m, farthest_m)) <= DOUBTFUL * _median(errors.error_m)
        )
        picks = resampled(noise.size, RESAMPLED, self._seed)
        most_m = None if known else farthest_m
        drifted_m = np.hypot(errors.bias_m, self._drift_m)
        within = None
        if self._share is not None:
            within = _within(self._share, errors, most_m, picks, self._drift_m)
        return Prediction(
            figure(errors.std_m, _typical, picks),
            _error(
                lambda bias_m: np.hypot(errors.std_m, bias_m),
                _median,
                errors,
                most_m,
                picks,
                self._drift_m,
            ),
            float(_median(drifted_m)),
            float(_median(farthest_m)),
            known,
            tuple(_quantiles(_SHARES, errors.off_m(drifted_m)).tolist()),
            within,
        )

    @property
    def _drift_m(self) -> float:
        """What is expected of a drift that is known only to be no larger than so much."""
        return self.scene.drift_m / 2

    def of_each(self, estimator: str, sequence: Sequence) -> tuple[_Array, _Array, _Array]:
        """Predict deviation in m over `left_noise`, bias in m, and that noise, of each (P)."""
        harmonics, noise = self._harmonics(estimator, sequence), self.relative_noise(sequence)
        arguments = estimator, harmonics, sequence.base_frequency_hz, noise, MAP_DRAWS
        parts = [
            self._errors(*arguments, sequence.zeroth, slice(first, first + _AT_ONCE))
            for first in range(0, noise.size, _AT_ONCE)
        ]
        std_m, bias_m = (
            np.concatenate([getattr(each, name) for each in parts]) for name in ("std_m", "bias_m")
        )
        left = self.left_noise(sequence)
        return std_m / left, np.hypot(bias_m, self._drift_m), left

    def brighter(self, times: float) -> "Predictor":
        """Return the predictor of the same scene with so many times the camera's own light."""
        ambient = float(np.median(self._whole.ambient_dn_per_s))
        return self._with(
            replace(
                self._whole,
                brightness_dn_per_s=times * self._whole.brightness_dn_per_s,
                brightest_dn_per_s=times * (self._whole.brightest_dn_per_s - ambient) + ambient,
            )
        )

    def beyond_scene(self, sequence: Sequence) -> bool:
        """Whether a sequence sees more of the scene than the look that describes it."""
        scene = self.scene
        if scene.relative_noise is None:
            return False
        finer = float(np.median(self.left_noise(sequence) / scene.relative_noise)) < 0.5
        return finer or not scene.covers(sequence.harmonics, sequence.base_frequency_hz)

    def bound_width(self, sequence: Sequence) -> float:
        """Predict the width of the bounds on the density, over the mean density, median pixel."""
        return self.resolving.bound_width(sequence, self._noise_of_all(sequence))

    def separation(self, sequence: Sequence, distance_m: float) -> float:
        """Predict how often two equal returns at a distance are both found, in a typical pixel."""
        return self.resolving.separation(sequence, self._noise_of_all(sequence), distance_m)

    def _noise_of_all(self, sequence: Sequence) -> _Array:
        """Return the deviation (P) that stands for all frequencies, of those with less contrast."""
        contrast = self.scene.contrast_at(sequence.harmonics, sequence.base_frequency_hz)[1:]
        return self.left_noise(sequence) / float(np.sqrt(np.mean(contrast**2)))

    def left_noise(self, sequence: Sequence) -> _Array:
        """Return `relative_noise` once neighbours are averaged that agree."""
        noise = self.relative_noise(sequence)
        how = sequence.harmonics, sequence.base_frequency_hz
        parts = (slice(first, first + _AT_ONCE) for first in range(0, noise.size, _AT_ONCE))
        return np.concatenate([self._averaged(*how, noise[part], part)[1] for part in parts])

    def _averaged(
        self, harmonics: int, base_frequency_hz: float, noise: _Array, pixels: slice
    ) -> tuple[_Array, _Array]:
        """Return relative moments (m + 1, P) of pixels, and their noise (P), as averaging has them.

        ``noise``: Of these pixels, as of `relative_noise`.
        """
        scene = self.scene
        b = scene.relative_moments(harmonics, base_frequency_hz)[:, pixels]
        if not self._averages:
            return b, noise
        if scene.picture is None or scene.pixels is None or scene.relative_noise is None:
            return b, noise * math.sqrt(LEAST_SHARE)  # all pixels are alike
        # where the look has other frequencies, its nearest ones tell which neighbours agree
        j = np.arange(harmonics + 1)
        nearest = np.round(j * base_frequency_hz / scene.base_frequency_hz).astype(int)
        picture = scene.picture[np.clip(nearest, np.minimum(j, 1), len(scene.picture) - 1)]
        places, light = scene.pixels[pixels], scene.brightness_dn_per_s[pixels]
        contrast = scene.contrast_at(harmonics, base_frequency_hz)[:, None]
        variance = (noise * light / contrast) ** 2
        variance[0] = 0
        seen = (scene.relative_noise[pixels] / noise) ** 2
        mean, share = averaged(picture, places, variance, seen)
        if scene.covers(harmonics, base_frequency_hz):
            mixed = mean - picture.reshape((len(picture), -1))[:, places]
            b = (b + mixed / light).astype(b.dtype)
        return b, noise * np.sqrt(share)

    def relative_noise(self, sequence: Sequence) -> _Array:
        """Return the deviation (P) of the parts of the moments, over each pixel's brightness.

        Before neighbours are averaged that agree, but after a Gaussian.
        """
        b0 = np.maximum(self.scene.brightness_dn_per_s * sequence.exposure_s, 1e-12)
        sub_phases = sequence.sub_phases
        noise = tm.noise.moment_noise(
            b0,
            self.sensor,
            calibration=tm.nominal_calibration(
                1, sub_phases.phases_rad, sub_phases.weights, zeroth=sequence.zeroth
            ),
            zeroth=sequence.zeroth,
            takes=sequence.takes,
            ambient=self.scene.ambient_dn_per_s * sequence.exposure_s,
        )
        relative: _Array = np.sqrt(noise.variance[1] * self._left) / b0
        return relative

    @cached_property
    def _closer(self) -> "Predictor":
        return self._with(self._whole, closely=True)

    def _with(self, scene: SceneStatistics, *, closely: bool = False) -> "Predictor":
        return Predictor(
            scene,
            self.sensor,
            self.settings,
            seed=self._seed,
            go_on=self._go_on,
            share=self._share,
            closely=closely,
        )

    def _harmonics(self, estimator: str, sequence: Sequence) -> int:
        """How many harmonics the estimator looks at."""
        return min(sequence.harmonics, MOST_HARMONICS.get(estimator, sequence.harmonics))

    def _drawn_column(
        self, estimator: str, harmonics: int, base_frequency_hz: float, step: int
    ) -> tuple[_Array, _Array]:
        """Deviation and bias (P) at a step of noise, none of them 0."""
        noise = self._nominal * STEP**step
        errors = self._errors(
            estimator, harmonics, base_frequency_hz, noise, DRAWS, NOMINAL.zeroth, FEW
        )
        return np.clip(errors.std_m, 1e-9, 1e3), np.clip(errors.bias_m, 1e-9, 1e3)

    def _errors(
        self, estimator: str, harmonics: int, base_frequency_hz: float, noise: _Array, draws: int,
        zeroth: str, pixels: slice = slice(None), lost: tuple[float, int] = (0.0, 1),
    ) -> PixelErrors:  # fmt: skip
        self._go_on()
        b, left = self._averaged(harmonics, base_frequency_hz, noise[pixels], pixels)
        variance = np.broadcast_to(left**2, b.shape).astype(np.float32)
        if zeroth == "estimated":
            variance[0] = 0
        contrast = self.scene.contrast_at(harmonics, base_frequency_hz)[:, None]
        random = np.random.default_rng((self._seed, harmonics, draws))
        of_device = tm.noise.MomentNoise((variance / contrast**2).astype(np.float32))
        drawn = tm.noise.draw(b, of_device, random, draws=draws)
        drawn = drawn if not lost[0] else _out_of_step(drawn, *lost, random)
        # frames take the noise of a nominal device, too
        spread = np.broadcast_to(variance[:, None], drawn.shape)
        range_m = ranges_m(
            drawn.reshape((len(b), -1)),
            spread.reshape((len(b), -1)),
            estimator,
            base_frequency_hz,
            self.settings,
            zeroth=zeroth,
        )
        errors = pixel_errors(
            range_m.reshape((draws, -1)),
            self.scene.direct_m[pixels],
            self.scene.uncertainty_m[pixels],
        )
        if not self.scene.again:
            return errors
        return self._without_noise_of_look(
            errors, (estimator, harmonics, base_frequency_hz), variance, pixels
        )

    def _without_noise_of_look(
        self, errors: PixelErrors, how: tuple[str, int, float], variance: _Array, pixels: slice
    ) -> PixelErrors:
        """Return errors whose bias has no noise of the look in it, by what pixels alike share.

        What noise adds to the square of a bias it adds once more to that of what was seen with more
        noise: extrapolated to none (Cook and Stefanski 1994).
        """
        scene, squares, (estimator, harmonics, base_hz) = self.scene, [], how
        for each in (scene, *(replace(scene, **drawn) for drawn in scene.again)):
            b = each.relative_moments(harmonics, base_hz)[:, pixels]
            range_m = ranges_m(b, variance, estimator, base_hz, self.settings)
            off_m = np.hypot(range_m - each.direct_m[pixels], each.uncertainty_m[pixels])
            squares.append(np.nan_to_num(off_m) ** 2)
        here = np.maximum(uniform_filter1d(squares[0], STRATUM), 1e-18)
        noise = np.minimum(np.mean(squares[1:], axis=0) - squares[0], OUTLYING * here)
        left = np.sqrt(np.clip(1 - uniform_filter1d(noise, STRATUM) / here, 0.0, 1.0))
        left = np.where(np.isfinite(errors.bias_m), left, 1.0)
        centre_m = errors.centre_m - (1 - left) * errors.signed_m
        return replace(errors, bias_m=left * errors.bias_m, centre_m=centre_m)


def _out_of_step(b: _Array, share: float, takes: int, random: np.random.Generator) -> _Array:
    """Return moments (m + 1, draws, P) of captures of which images lost their synchronisation.

    Nothing tells such an image among the four of one frequency: for a part of the exposure, taken
    as uniform from 0 to 1, its phase is a random one. Losses of each pixel are drawn by
    themselves: few draws of whole images would miss how many there are.
    """
    shape = takes, *b.shape[1:], len(FOUR_PHASES)
    part = random.uniform(size=shape) * (random.uniform(size=shape) < share)
    turned = 1 - part + part * np.exp(2j * np.pi * random.uniform(size=shape))
    seen = np.real(b[1][..., None] * turned.mean(axis=0) / FOUR_PHASES)
    out: _Array = b.copy()
    out[1] = (seen * FOUR_PHASES).sum(axis=-1) / 2
    return out


def _error(
    of_bias: Callable[[_Array], _Array],
    value: Callable[[_Array], _Array],
    errors: PixelErrors,
    farthest_m: _Array | None,
    picks: _Array,
    drift_m: float,
) -> Figure:
    """Return the figure of an error; ``farthest_m`` (P) is the most bias, where none is known.

    ``of_bias``: Returns the errors of pixels (P, ...) were their bias (P) the one given.
    ``value``: Of errors (..., P, ...), the figure (...).
    ``drift_m``: Expected; there may be none, and twice as much.
    """
    expected = figure(of_bias(np.hypot(errors.bias_m, drift_m)), value, picks)
    reach = KNOWN if farthest_m is None else UNKNOWN
    least_m = reach.least_bias * errors.bias_m
    most_m = np.hypot(reach.most_bias * errors.bias_m, 2 * drift_m)
    least, most = (
        figure(of_bias(bias_m), value, picks, reach.spread) for bias_m in (least_m, most_m)
    )
    found = between(expected, least, most)
    if farthest_m is not None:  # how much more than the least this look cannot tell
        return replace(found, high=math.inf)
    # with the most bias it is known as closely as intervals say
    return replace(found, with_margin=min(found.with_margin, most.with_margin))


def _within(
    share: float, errors: PixelErrors, farthest_m: _Array | None, picks: _Array, drift_m: float
) -> Figure:
    """Return the figure of what a share of the ranges is within; few draws tell its interval."""

    def value(off_m: _Array) -> _Array:
        return _quantiles(share, off_m)

    few = replace(errors, apart_m=errors.apart_m[::_FEW_DRAWS])
    found = _error(few.off_m, value, few, farthest_m, picks, drift_m)
    whole = float(value(errors.off_m(np.hypot(errors.bias_m, drift_m))))
    scale = whole / found.median if 0 < found.median < math.inf else 1.0
    return Figure(*(scale * getattr(found, each.name) for each in fields(Figure)))


def _quantiles(shares: _Array | float, off_m: _Array) -> _Array:
    """Return how far shares (S) of the ranges (..., P, D) are off at most: (S, ...)."""
    flat = off_m.reshape((*off_m.shape[:-2], -1))
    return np.asarray(np.quantile(flat, shares, axis=-1, method="higher"))


def _typical(deviations: _Array) -> _Array:
    """Return the typical difference of two captures over pixels (..., P), as a deviation (...).

    The same measure as of captured frames, whose bright and dark pixels are mixed.
    """
    mixed = (_NORMAL[:, None] * deviations[..., None, :]).reshape((*deviations.shape[:-1], -1))
    return _median(mixed) / MEDIAN_OF_NORMAL


def _median(values: _Array) -> _Array:
    """Return the median over pixels (..., P), which are last."""
    return np.asarray(np.median(values, axis=-1))
