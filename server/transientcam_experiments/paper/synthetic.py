"""Impulse responses whose moments, density and cumulative density are known in closed form."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import exponnorm

_Array = NDArray[Any]


@dataclass(frozen=True, slots=True)
class Return:
    """Light that comes back at a time: sharply, or as an exponentially modified Gaussian.

    The latter (Heide et al. 2014) is a normal density of deviation ``width_s`` convolved with an
    exponential one of mean ``decay_s``; both are 0 for a sharp return.
    """

    delay_s: float
    weight: float
    width_s: float = 0.0
    decay_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Response:
    """An impulse response that ends within one period of all frequencies it is measured at."""

    name: str
    returns: tuple[Return, ...]

    @property
    def brightness(self) -> float:
        """b_0."""
        return sum(each.weight for each in self.returns)

    def moment(self, frequency_hz: float | _Array) -> _Array:
        """Return ``int g(t) exp(2 pi i f t) dt`` at frequencies of any shape."""
        omega = 2 * np.pi * np.asarray(frequency_hz, dtype=float)
        moments = np.zeros(omega.shape, dtype=np.complex128)
        for each in self.returns:
            spread = np.exp(-0.5 * (omega * each.width_s) ** 2) / (1 - 1j * omega * each.decay_s)
            moments += each.weight * np.exp(1j * omega * each.delay_s) * spread
        return moments

    def moments(self, base_frequency_hz: float, m: int) -> _Array:
        """Return b_0 to b_m, shape (m + 1)."""
        return self.moment(base_frequency_hz * np.arange(m + 1))

    def density(self, time_s: _Array) -> _Array:
        """Return g at times; sharp returns have none."""
        density: _Array = np.zeros(np.shape(time_s))
        for each in self.returns:
            if each.width_s:
                density = density + each.weight * _distribution(each).pdf(time_s)
        return density

    def cumulative(self, time_s: _Array) -> _Array:
        """Return the light that is back at times."""
        light: _Array = np.zeros(np.shape(time_s))
        for each in self.returns:
            back = _distribution(each).cdf(time_s) if each.width_s else time_s >= each.delay_s
            light = light + each.weight * back
        return light


def _distribution(each: Return) -> Any:
    return exponnorm(each.decay_s / each.width_s, loc=each.delay_s, scale=each.width_s)


SPARSE: Final = Response("sparse", (Return(7e-9, 1.0), Return(14e-9, 0.6)))
"""Two sharp returns: "an ideal case for all techniques" (Sec. 6.1)."""

CONTINUOUS: Final = Response(
    "continuous",
    (
        Return(6e-9, 1.0, 0.25e-9, 0.6e-9),
        Return(13e-9, 0.7, 0.3e-9, 1.0e-9),
        Return(24e-9, 0.5, 0.4e-9, 1.6e-9),
    ),
)
"""Three exponentially modified Gaussians (Sec. 6.1, Fig. 7 and 11b)."""

PIXEL: Final = Response(
    "pixel",
    (
        Return(8e-9, 25.0, 0.5e-9, 1.0e-9),
        Return(14e-9, 20.0, 1.0e-9, 2.5e-9),
        Return(20e-9, 22.5, 1.5e-9, 4.0e-9),
    ),
)
"""A pixel with the brightness of the paper's in Fig. 5, b_0 = 67.5."""
