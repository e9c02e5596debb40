"""The result of a technique for a known response, without noise and with it."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_experiments.paper.contenders import Contender, samples
from transientcam_experiments.paper.synthetic import Response

_Array = NDArray[Any]
SIGNAL_TO_NOISE: Final = 70.0
END_S: Final = 40e-9
_TIMES: Final = 800


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """Cumulative densities over the brightness: the true one, without and with noise."""

    time_s: _Array
    """Shape (T)."""
    truth: _Array
    clean: _Array
    """``truth``, ``clean``: shape (T)."""
    noisy: _Array
    """Shape (T, D)."""

    @property
    def clean_error(self) -> float:
        """Mean distance from the truth over time, without noise."""
        return float(np.abs(self.clean - self.truth).mean())

    @property
    def clean_error_of_shape(self) -> float:
        """The same after the light that is found was brought to the true amount."""
        found = self.clean * (self.truth[-1] / self.clean[-1])
        return float(np.abs(found - self.truth).mean())

    @property
    def noisy_error(self) -> float:
        """The same with noise, mean over the draws."""
        return float(np.abs(self.noisy - self.truth[:, None]).mean())

    @property
    def spread(self) -> float:
        """Deviation between draws, mean over time."""
        return float(self.noisy.std(axis=1).mean())

    def at(self, time_s: float) -> int:
        """Return the index of a time."""
        return int(np.abs(self.time_s - time_s).argmin())

    def error_at(self, time_s: float) -> float:
        """Return the distance from the truth at a time, without noise."""
        index = self.at(time_s)
        return float(abs(self.clean[index] - self.truth[index]))


def outcome(
    contender: Contender, response: Response, *, draws: int, rng: np.random.Generator
) -> Outcome:
    """Reconstruct a response by a technique, without noise and ``draws`` times at 70 : 1."""
    # between the points of any round grid, so that no step falls on one
    time_s = (np.arange(_TIMES) + 0.5) * (END_S / _TIMES)
    phase = 2 * np.pi * contender.base_frequency_hz * time_s
    clean = samples(contender, response, noise=0.0, draws=1, rng=rng)
    noisy = samples(contender, response, noise=1 / SIGNAL_TO_NOISE, draws=draws, rng=rng)
    return Outcome(
        time_s,
        response.cumulative(time_s) / response.brightness,
        contender.estimate(clean).cumulative(phase)[:, 0] / response.brightness,
        contender.estimate(noisy).cumulative(phase) / response.brightness,
    )
