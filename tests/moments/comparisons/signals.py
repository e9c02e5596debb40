"""Impulse responses like those of the paper's Fig. 11, whose moments are known in closed form."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complexfloating[Any, Any]]
Real = NDArray[np.floating[Any]]

# ns: two sharp returns, and three continuous ones of which the second is the weakest
SPARSE = ((12.0, 27.0), (1.0, 0.6))
CONTINUOUS = ((10.0, 19.0, 29.0), (1.0, 0.3, 0.45))
WIDTH_NS, DECAY_NS = 0.4, 1.2


def sparse(m: int, frequency_hz: float) -> Complex:
    """Moments (m + 1) of the sharp returns."""
    return _moments(*SPARSE, m, frequency_hz)


def continuous(m: int, frequency_hz: float) -> Complex:
    """Moments (m + 1) of exponentially modified Gaussians."""
    omega = 2e-9 * np.pi * frequency_hz * np.arange(m + 1)
    scatter = np.exp(-0.5 * (omega * WIDTH_NS) ** 2) / (1 - 1j * omega * DECAY_NS)
    scattered: Complex = _moments(*CONTINUOUS, m, frequency_hz) * scatter
    return scattered


def _moments(
    time_ns: tuple[float, ...], weight: tuple[float, ...], m: int, frequency_hz: float
) -> Complex:
    phase = 2e-9 * np.pi * frequency_hz * np.array(time_ns)
    waves = np.exp(1j * np.outer(np.arange(m + 1), phase))
    moments: Complex = waves @ np.array(weight)
    return moments


def noisy(b: Complex, *, ratio: float, draws: int, seed: int) -> Complex:
    """Moments (m + 1, draws) with Gaussian noise of |b_1| / ratio in both parts."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(2, len(b), draws)) * (abs(b[1]) / ratio)
    drawn: Complex = b[:, None] + noise[0] + 1j * noise[1]
    return drawn


def ns(phase_rad: Any, frequency_hz: float) -> Any:
    """Time of flight in ns."""
    return np.asarray(phase_rad) / (2e-9 * np.pi * frequency_hz)
