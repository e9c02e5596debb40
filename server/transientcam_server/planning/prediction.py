"""What accuracy a sequence will have on a scene, before it is captured.

Where first order holds, the noise model gives it. Where it does not, because returns merge,
hide in noise or are fewer than harmonics, noisy moments are drawn and go through the estimator.
Both depend on a pixel only by its relative noise, so that a table over that serves every exposure
and number of takes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Sequence
from transientcam_server.imaging.noise import MEDIAN_OF_NORMAL
from transientcam_server.planning.scene import SceneStatistics
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
DRAWS: Final = 24
"""Noisy captures of each pixel and noise level."""
LEVELS: Final = np.geomspace(5e-5, 0.5, 12)
"""Standard deviation of a moment over the brightness."""
_NORMAL: Final = np.array([NormalDist().inv_cdf(0.5 + (k + 0.5) / 64) for k in range(32)])
"""Absolute values of a standard normal variable, each as likely."""
_BOUND_PHASES: Final = 32
_BOUND_DRAWS: Final = 8
_RESAMPLED: Final = 200


@dataclass(frozen=True, slots=True)
class Deviation:
    """Standard deviation of the range.

    Attributes
    ----------
    median_m, p90_m
        Of a typical pixel, and one that 90 % of the pixels are better than.
    first_order_share
        Share of the pixels where first order holds; of the others noise was drawn.
    """

    median_m: float
    p90_m: float
    first_order_share: float


class Predictor:
    """Predicts for one scene, one sensor and one way to reconstruct.

    Parameters
    ----------
    scene
        Of typical pixels.
    sensor
        Of the camera.
    settings
        Of the reconstruction.
    seed
        Of all draws: the same arguments give the same result.
    go_on
        Called several times a second while this computes; whatever it raises ends that.
    """

    def __init__(
        self,
        scene: SceneStatistics,
        sensor: tm.noise.Sensor,
        settings: ReconstructionSettings,
        *,
        seed: int = 0,
        go_on: Callable[[], None] = lambda: None,
    ) -> None:
        self._go_on = go_on
        self.scene = scene
        self.sensor = sensor
        self._settings = settings
        self._seed = seed
        self._left = tm.noise.smoothing_factor(settings.smoothing_px)
        self._ranges = lru_cache(maxsize=None)(self._range_table)
        self._biases = lru_cache(maxsize=None)(self._bias_of)
        self._widths = lru_cache(maxsize=None)(self._width_table)
        self._separations = lru_cache(maxsize=None)(self._separation_table)

    def longest_exposure_s(self) -> float:
        """Exposure at which the scene's bright pixels just do not saturate."""
        light = self.scene.brightest_dn_per_s + self.scene.ambient_dn_per_s
        return self.sensor.brightest / light if light > 0 else float("inf")

    def range_std(self, sequence: Sequence) -> Deviation:
        """Predict the deviation of the range."""
        each, holds = self._deviations(sequence)
        return Deviation(_typical(each), float(np.quantile(each, 0.9)), float((holds > 0.5).mean()))

    def range_std_interval(self, sequence: Sequence) -> tuple[float, float]:
        """Return the 95 % interval of the typical pixel's deviation, in m.

        By a bootstrap over the pixels that stand for the scene.
        """
        each, _ = self._deviations(sequence)
        picks = np.random.default_rng(self._seed).integers(0, each.size, (_RESAMPLED, each.size))
        low, high = np.quantile([_typical(each[pick]) for pick in picks], [0.025, 0.975])
        return float(low), float(high)

    def _deviations(self, sequence: Sequence) -> tuple[_Array, _Array]:
        """Deviation in m of each pixel, and share of first order in it."""
        self._go_on()
        noise = self._relative_noise(sequence)
        key = (sequence.harmonics, sequence.base_frequency_hz, self._zeroth_of(sequence))
        deviation, holds = self._ranges(*key)
        return (
            _interpolated(noise, deviation, log=True),
            _interpolated(noise, holds.astype(float), log=False),
        )

    def range_bias_m(self, sequence: Sequence) -> float:
        """Predict by how much the range of the median pixel is off without any noise.

        It is not 0 where the pixel has more returns than the estimator resolves.
        """
        key = (sequence.harmonics, sequence.base_frequency_hz, self._zeroth_of(sequence))
        return self._biases(*key)

    def beyond_scene(self, sequence: Sequence) -> bool:
        """Whether a sequence resolves more than the frame that describes the scene."""
        scene = self.scene
        if scene.harmonics is None:
            return False
        finer = float(np.median(self._relative_noise(sequence))) < 0.5 * scene.relative_noise
        return finer or sequence.harmonics > scene.harmonics

    def bound_width(self, sequence: Sequence) -> float:
        """Predict the width of the bounds on the density, over the mean density, median pixel."""
        table = self._widths(sequence.harmonics, sequence.base_frequency_hz, sequence.zeroth)
        each = _interpolated(self._relative_noise(sequence), table, log=True)
        return float(np.median(each))

    def separation(self, sequence: Sequence, distance_m: float) -> float:
        """Predict how often two equal returns at a distance are both found, in a typical pixel."""
        if sequence.harmonics < 2:
            return 0.0
        table = self._separations(sequence.harmonics, sequence.base_frequency_hz, distance_m)
        each = _interpolated(self._relative_noise(sequence), table, log=False)
        return float(np.median(each))

    @property
    def least_harmonics(self) -> int:
        """The smallest number of harmonics that there is a range of."""
        return self._settings.least_harmonics

    def _zeroth_of(self, sequence: Sequence) -> str:
        """How b_0 is measured, where that matters: Pisarenko's returns do not depend on it."""
        return sequence.zeroth if self._settings.estimator == "maximum-entropy" else "estimated"

    def _relative_noise(self, sequence: Sequence) -> _Array:
        """Return the deviation of the parts of the moments, over each pixel's brightness."""
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

    def _drawn(self, b: _Array, level: float, zeroth: str, draws: int) -> _Array:
        """Draw moments (m + 1, draws, P); b_0 is as noisy as the others if it is measured."""
        self._go_on()
        random = np.random.default_rng((self._seed, len(b), int(level * 1e9)))
        return np.asarray(tm.noise.draw(b, _white(b, level, zeroth), random, draws=draws))

    def _reconstructed(self, b: _Array, base_frequency_hz: float, zeroth: str) -> tm.Reconstruction:
        settings = self._settings.for_moments(base_frequency_hz=base_frequency_hz, zeroth=zeroth)
        flat = b.reshape((len(b), -1)).astype(np.complex64)
        return tm.reconstruct(flat, settings)

    def _range_table(
        self, harmonics: int, base_frequency_hz: float, zeroth: str
    ) -> tuple[_Array, _Array]:
        """Deviation in m of every pixel at every level (L, P), and where first order holds."""
        b = self.scene.relative_moments(harmonics, base_frequency_hz)
        exact = tm.pisarenko(b)
        drawn = [self._drawn(b, level, zeroth, 2 * DRAWS) for level in LEVELS]
        found = self._reconstructed(np.stack(drawn, 1), base_frequency_hz, zeroth)
        phase = np.asarray(found.phase_rad).reshape((len(LEVELS), 2, DRAWS, -1)).astype(float)
        # the same measure as of captured frames: the typical difference of two
        apart = np.median(np.abs(phase[:, 0] - phase[:, 1]), axis=1)
        deviation = apart / (np.sqrt(2) * MEDIAN_OF_NORMAL)
        holds = np.zeros(deviation.shape, dtype=bool)
        if self._settings.estimator == "pisarenko":
            for index, level in enumerate(LEVELS):
                first_order = tm.noise.return_noise(
                    exact, _white(b, level, zeroth), threshold=self._settings.return_threshold
                )
                holds[index] = first_order.holds
                deviation[index] = np.where(
                    first_order.holds, first_order.direct_phase_std_rad, deviation[index]
                )
        return tm.range_m(np.nan_to_num(deviation, nan=np.pi), base_frequency_hz), holds

    def _bias_of(self, harmonics: int, base_frequency_hz: float, zeroth: str) -> float:
        b = self.scene.relative_moments(harmonics, base_frequency_hz)
        found = self._reconstructed(b, base_frequency_hz, zeroth)
        true_m = self.scene.direct_m(self._settings.return_threshold)
        bias_m = np.abs(np.asarray(found.range_m) - true_m)
        return float(np.median(np.nan_to_num(bias_m, nan=np.inf)))

    def _width_table(self, harmonics: int, base_frequency_hz: float, zeroth: str) -> _Array:
        """Width of the bounds over the mean density (L, P)."""
        b = self.scene.relative_moments(harmonics, base_frequency_hz)
        phase = 2 * np.pi * np.arange(_BOUND_PHASES) / _BOUND_PHASES
        widths = []
        for level in LEVELS:
            drawn = self._drawn(b, level, zeroth, _BOUND_DRAWS)
            moments = self._reconstructed(drawn, base_frequency_hz, zeroth).moments
            lower, upper = tm.bounds(moments, phase)
            width = 2 * np.pi * (upper - lower).mean(axis=0) / moments[0].real
            widths.append(width.reshape((_BOUND_DRAWS, -1)).mean(axis=0))
        return np.array(widths)

    def _separation_table(
        self, harmonics: int, base_frequency_hz: float, distance_m: float
    ) -> _Array:
        """Share of draws in which two equal returns are both found (L, P)."""
        pixels = self.scene.brightness_dn_per_s.size
        period_m = tm.SPEED_OF_LIGHT_M_S / (2 * base_frequency_hz)
        middle_m = min(max(self._middle_m(), distance_m), period_m - distance_m)
        near_m, far_m = middle_m - distance_m / 2, middle_m + distance_m / 2
        phase = 2 * np.pi * np.array([near_m, far_m]) / period_m
        j = np.arange(harmonics + 1)[:, None]
        b = np.repeat(0.5 * np.exp(1j * j * phase).sum(axis=1)[:, None], pixels, axis=1)
        shares = []
        for level in LEVELS:
            drawn = self._drawn(b, level, "estimated", DRAWS)
            returns = self._reconstructed(drawn, base_frequency_hz, "estimated").returns
            found = both_found(returns, phase, threshold=self._settings.return_threshold)
            shares.append(found.reshape((DRAWS, -1)).mean(axis=0))
        return np.array(shares)

    def _middle_m(self) -> float:
        return float(np.nanmedian(self.scene.delay_s)) * tm.SPEED_OF_LIGHT_M_S / 2


def both_found(returns: tm.Returns, phase_rad: _Array, *, threshold: float) -> _Array:
    """Return in which pixels (...) two true returns are both found, each by itself.

    Found is one with a return of at least ``threshold`` times the strongest one within a quarter
    of the distance between the two.
    """
    weight = np.asarray(returns.weight)
    counts = (weight >= threshold * weight.max(axis=0)) & (weight > 0)
    apart = float(abs(phase_rad[1] - phase_rad[0]))
    found = [
        (counts & (np.abs(np.nan_to_num(returns.phase_rad, nan=np.inf) - each) < apart / 4)).any(0)
        for each in phase_rad
    ]
    both: _Array = found[0] & found[1]
    return both


def _typical(deviations: _Array) -> float:
    """Return the typical difference of two captures over all pixels, as a deviation.

    The same measure as of captured frames, whose bright and dark pixels are mixed.
    """
    mixed = np.median(_NORMAL[:, None] * deviations)
    return float(mixed / MEDIAN_OF_NORMAL)


def _white(b: _Array, level: float, zeroth: str) -> tm.noise.MomentNoise:
    variance = np.full(b.shape, level**2)
    if zeroth == "estimated":
        variance[0] = 0
    return tm.noise.MomentNoise(variance)


def _interpolated(noise: _Array, table: _Array, *, log: bool) -> _Array:
    """Look each pixel's noise up in its column of a table over `LEVELS`."""
    place = np.interp(np.log(noise), np.log(LEVELS), np.arange(len(LEVELS)))
    below = np.minimum(place.astype(int), len(LEVELS) - 2)
    part, pixel = place - below, np.arange(noise.size)
    values = np.log(np.maximum(table, 1e-12)) if log else table
    mixed: _Array = values[below, pixel] * (1 - part) + values[below + 1, pixel] * part
    return np.exp(mixed) if log else mixed
