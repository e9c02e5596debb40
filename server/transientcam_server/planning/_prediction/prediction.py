"""What accuracy a sequence will have on a scene, before it is captured.

Noisy moments are drawn around those of the scene and go through the estimator itself, so that
noise, bias and shares come from one computation, whatever the estimator. What is drawn depends on
a sequence by its frequencies and by how noisy it is: a few steps of noise serve every exposure and
number of takes.
"""

import math
from collections.abc import Callable, Sequence as Several
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from statistics import NormalDist
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Sequence
from transientcam_server.imaging import ranges_m
from transientcam_server.planning._prediction.averaging import LEAST_SHARE, averaged
from transientcam_server.planning._prediction.measures import (
    DISAGREEING,
    DOUBTFUL,
    RESAMPLED,
    Figure,
    PixelErrors,
    error_figure,
    figure,
    median,
    pixel_errors,
    quantiles,
    resampled,
    share_figure,
    summed_up,
    typical,
)
from transientcam_server.planning._prediction.resolving import Resolving
from transientcam_server.planning._scene.estimation import MOST_HARMONICS
from transientcam_server.planning._scene.scene import SceneStatistics
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
SWING: Final = 0.25
"""Error of a range that changes evenly during a capture, over that change."""
OUTVOTED: Final = 3
"""Takes of which one that lost its synchronisation is left out."""
FOUR_PHASES: Final = np.array([1, 1j, -1, -1j])
NOMINAL: Final = Sequence(exposure_s=1e-3, zeroth="estimated")
"""The steps are multiples of its noise."""
Settings = tuple[Several[float], Several[int]]
"""Exposures in s, and takes."""
_SHARES: Final = np.linspace(0.0, 1.0, 201)
"""For which it is stated how far ranges are off."""
_HARDLY: Final = 0.8


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
    ``longest_exposure_s``: At which the scene's bright pixels just do not saturate.
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
        self.scene = scene if closely else scene.few()
        self.sensor = sensor
        self.settings = settings
        self._seed = seed
        self._averages = settings.neighbours == "edge-preserving"
        self._left = tm.noise.smoothing_factor(0.0 if self._averages else settings.gaussian_px)
        self._drift_m = self.scene.drift_m / 2  # what is expected of one that is no larger
        self._clear = self.scene.calibrated and not self.scene.lit_in_part
        self._disagreement_m = self.scene.disagreement_m
        light = self.scene.brightest_dn_per_s
        self.longest_exposure_s = sensor.brightest / light if light > 0 else math.inf
        self._column = lru_cache(maxsize=None)(self._drawn_column)
        self._once = lru_cache(maxsize=None)(self.noise_scale)
        self._least_bias_m = lru_cache(maxsize=None)(self._bias_without_noise)
        self._resolving = Resolving(self.scene, settings, seed=seed, go_on=go_on)
        self._closer = self
        if not closely:
            self._closer = Predictor(
                scene, sensor, settings, seed=seed, go_on=go_on, closely=True, share=share
            )

    def noise_scale(self, sequence: Sequence) -> float:
        """Return how noisy a sequence is, in units of a nominal one: 1 ms, one take."""
        return float(np.median(self.relative_noise(sequence) / self._nominal))

    def bounds(
        self, estimator: str, sequence: Sequence, settings: Settings, *, biased: bool = True
    ) -> tuple[list[float], list[float], float]:
        """Return `noise_scale` of settings, and what noise and bias in m hardly fall below.

        Noise of the median pixel is that of one return with all the light, whose phase all
        frequencies tell together (Cramer and Rao). As half of the pixels are noisier, a share s of
        all ranges reaches as far as 2 s - 1 of that pixel's. The bias, if it is wanted, is that
        without noise: for a share s of the ranges that of the share 2 s - 1 of the pixels, as half
        of a pixel's ranges are further off than it is.
        """
        m, base_frequency_hz = self._harmonics(estimator, sequence), sequence.base_frequency_hz
        like = replace(NOMINAL, zeroth=sequence.zeroth, sub_phases=sequence.sub_phases)
        once = {each: self._once(replace(like, exposure_s=each)) for each in set(settings[0])}
        scales = [once[each] / n**0.5 for each, n in zip(*settings, strict=True)]
        bias_m = self._least_bias_m(estimator, m, base_frequency_hz) if biased else 0.0
        noise = float(np.median(self._nominal)) * np.array(scales)
        noise *= math.sqrt(LEAST_SHARE) if self._averages else 1.0
        contrast = self.scene.contrast_at(m, base_frequency_hz)
        std_rad = noise / float(np.linalg.norm(np.arange(m + 1) * contrast))
        if self._share is not None:
            std_rad *= NormalDist().inv_cdf(max(self._share, 0.5))
        return scales, tm.range_m(std_rad, base_frequency_hz).tolist(), bias_m

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
        return summed_up(std, np.hypot(bias, self._drift_m), self._share, DRAWS)

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
        drawn = noise, FINE_DRAWS, sequence.zeroth, slice(None), (lost, sequence.takes)
        errors = self._errors(estimator, harmonics, sequence.base_frequency_hz, *drawn)
        farthest_m = errors.farthest_m(self.scene.earliest_m, self.scene.latest_m)
        if self.scene.swing_m_per_s is not None:
            moved_m = SWING * capture_s * self.scene.swing_m_per_s
            errors = replace(errors, bias_m=np.hypot(errors.bias_m, moved_m))
        error_m = median(errors.error_m)
        known = bool(
            self._clear
            and self._disagreement_m <= DISAGREEING * error_m
            and median(np.hypot(errors.std_m, farthest_m)) <= DOUBTFUL * error_m
        )
        most_m = None if known else farthest_m
        drifted_m = np.hypot(errors.bias_m, self._drift_m)
        how = errors, most_m, resampled(noise.size, RESAMPLED, self._seed), self._drift_m
        return Prediction(
            figure(errors.std_m, typical, how[2]),
            error_figure(*how),
            float(median(drifted_m)),
            float(median(farthest_m)),
            known,
            tuple(quantiles(_SHARES, errors.off_m(drifted_m)).tolist()),
            None if self._share is None else share_figure(self._share, *how),
        )

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

    def beyond_scene(self, sequence: Sequence) -> bool:
        """Whether a sequence sees more of the scene than the look that describes it."""
        scene = self.scene
        if scene.relative_noise is None:
            return False
        finer = float(np.median(self.left_noise(sequence) / scene.relative_noise)) < 0.5
        return finer or not scene.covers(sequence.harmonics, sequence.base_frequency_hz)

    def bound_width(self, sequence: Sequence) -> float:
        """Predict the width of the bounds on the density, over the mean density, median pixel."""
        return self._resolving.bound_width(sequence, self._noise_of_all(sequence))

    def separation(self, sequence: Sequence, distance_m: float) -> float:
        """Predict how often two equal returns at a distance are both found, in a typical pixel."""
        return self._resolving.separation(sequence, self._noise_of_all(sequence), distance_m)

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
    def _nominal(self) -> _Array:
        return self.relative_noise(NOMINAL)

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
        flat, spread = drawn.reshape((len(b), -1)), spread.reshape((len(b), -1))
        how = estimator, base_frequency_hz, self.settings
        range_m = ranges_m(flat, spread, *how, zeroth=zeroth).reshape((draws, -1))
        squares = []
        for again in ({}, *self.scene.again) if self.scene.again else ():
            seen = replace(self.scene, **again)
            b = seen.relative_moments(harmonics, base_frequency_hz)[:, pixels]
            off_m = np.hypot(
                ranges_m(b, variance, *how) - seen.direct_m[pixels], seen.uncertainty_m[pixels]
            )
            squares.append(np.nan_to_num(off_m) ** 2)
        truth = self.scene.direct_m[pixels], self.scene.uncertainty_m[pixels]
        errors = pixel_errors(range_m, *truth)
        return errors.without_noise_of_look(squares) if squares else errors


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
