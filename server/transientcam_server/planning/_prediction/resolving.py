"""What a sequence resolves: width of the bounds on the density, and two returns found apart."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Sequence
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
LEVELS: Final = np.geomspace(5e-5, 0.5, 12)
"""Standard deviation of a moment over the brightness."""
DRAWS: Final = 24
_BOUND_PHASES: Final = 32
_BOUND_DRAWS: Final = 8


class Resolving:
    """Tables over noise, one for each order and frequency, in which pixels are looked up."""

    def __init__(
        self,
        scene: SceneStatistics,
        settings: ReconstructionSettings,
        *,
        seed: int,
        go_on: Callable[[], None],
    ) -> None:
        self._scene = scene
        self._settings = settings.model_copy(update={"estimator": "pisarenko"})
        self._seed = seed
        self._go_on = go_on
        self._widths = lru_cache(maxsize=None)(self._width_table)
        self._separations = lru_cache(maxsize=None)(self._separation_table)

    def bound_width(self, sequence: Sequence, noise: _Array) -> float:
        """Return the width of the bounds over the mean density, of the median pixel."""
        table = self._widths(sequence.harmonics, sequence.base_frequency_hz, sequence.zeroth)
        return float(np.median(_interpolated(noise, table, log=True)))

    def separation(self, sequence: Sequence, noise: _Array, distance_m: float) -> float:
        """Return how often two equal returns are both found, in a typical pixel."""
        if sequence.harmonics < 2:
            return 0.0
        table = self._separations(sequence.harmonics, sequence.base_frequency_hz, distance_m)
        return float(np.median(_interpolated(noise, table, log=False)))

    def _drawn(self, b: _Array, level: float, zeroth: str, draws: int) -> _Array:
        """Draw moments (m + 1, draws, P); b_0 is as noisy as the others if it is measured."""
        self._go_on()
        random = np.random.default_rng((self._seed, len(b), int(level * 1e9)))
        variance = np.full(b.shape, level**2)
        if zeroth == "estimated":
            variance[0] = 0
        return np.asarray(tm.noise.draw(b, tm.noise.MomentNoise(variance), random, draws=draws))

    def _reconstructed(self, b: _Array, base_frequency_hz: float, zeroth: str) -> tm.Reconstruction:
        plain = self._settings.model_copy(
            update={"neighbours": "none", "minimum_brightness_dn": 0.0}
        )
        settings = plain.for_moments(base_frequency_hz=base_frequency_hz, zeroth=zeroth)
        return tm.reconstruct(b.reshape((len(b), -1)), settings)

    def _width_table(self, harmonics: int, base_frequency_hz: float, zeroth: str) -> _Array:
        """Width of the bounds over the mean density (L, P)."""
        b = self._scene.relative_moments(harmonics, base_frequency_hz)
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
        pixels = self._scene.brightness_dn_per_s.size
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
        return float(np.median(self._scene.direct_m))


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


def _interpolated(noise: _Array, table: _Array, *, log: bool) -> _Array:
    """Look each pixel's noise up in its column of a table over `LEVELS`."""
    place = np.interp(np.log(noise), np.log(LEVELS), np.arange(len(LEVELS)))
    below = np.minimum(place.astype(int), len(LEVELS) - 2)
    part, pixel = place - below, np.arange(noise.size)
    values = np.log(np.maximum(table, 1e-12)) if log else table
    mixed: _Array = values[below, pixel] * (1 - part) + values[below + 1, pixel] * part
    return np.exp(mixed) if log else mixed
