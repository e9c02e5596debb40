"""The techniques of Figures 11 and 12, each with the frequencies that it is tried with."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_experiments.paper.synthetic import Response
from transientcam_moments.comparisons import TECHNIQUES, Estimate, Technique

_Array = NDArray[Any]
OURS: Final = ("maximum-entropy", "pisarenko")
"""The paper's own."""
PRINTED: Final = ("godbaz", "spumic", "sra", "pisarenko", "maximum-entropy")
"""Those that the paper shows in Figure 11."""


@dataclass(frozen=True, slots=True)
class Contender:
    """A technique at frequencies f, 2 f, .. m f."""

    name: str
    base_frequency_hz: float
    m: int
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def technique(self) -> Technique:
        """Its entry in the registry."""
        return TECHNIQUES[self.name]

    @property
    def label(self) -> str:
        """Its name for people."""
        return self.technique.label

    @property
    def frequencies(self) -> str:
        """Frequencies in MHz, as text."""
        if self.technique.measures == "code":
            return f"{self.base_frequency_hz / 1e6:g}, coded"
        multiples = self.technique.harmonics(self.m)
        values = [f"{j * self.base_frequency_hz / 1e6:g}" for j in multiples]
        return ", ".join(values) if len(values) < 4 else f"{values[0]}, {values[1]} .. {values[-1]}"

    def estimate(self, b: _Array) -> Estimate:
        """Estimate from moments (m + 1, ...) with noise, or samples of a code.

        The maximum entropy estimate gets moments that are biased (Sec. 4.3), as everywhere.
        """
        if self.name == "maximum-entropy":
            b = tm.bias(b).moments
        return self.technique.estimate(b, **self.options)


_F: Final = 23e6
_HALF: Final = 11e6
CONTENDERS: Final = (
    Contender("maximum-entropy", _F, 3), Contender("pisarenko", _F, 3),
    Contender("pisarenko-merged", _F, 3), Contender("likelihood", _F, 3),
    Contender("godbaz", _HALF, 4), Contender("spumic", _HALF, 6), Contender("sra", _F, 3),
    Contender("sra-table", _F, 3), Contender("single-frequency", _F, 1),
    Contender("dorrington", _F, 2), Contender("high-frequency", _F, 3),
    Contender("inverse-fourier", _F, 3), Contender("regularised", _HALF, 8),
    Contender("logarithmic", _F, 3), Contender("matrix-pencil", _HALF, 7),
    Contender("matching-pursuit", _HALF, 8, {"returns": 3}),
    Contender("frequency-domain", _HALF, 8, {"returns": 3}), Contender("coded", _F, 1),
)  # fmt: skip
"""At the frequencies of the paper's Figure 11 where it prints them, else at those they need."""


def samples(
    contender: Contender, response: Response, *, noise: float, draws: int, rng: np.random.Generator
) -> _Array:
    """Return what a contender measures of a response (N, draws), with Gaussian noise.

    ``noise``: deviation of each real measurement over the brightness.
    """
    if contender.technique.measures == "code":
        clean: _Array = _code_samples(contender, response)
        deviation = rng.normal(size=(clean.size, draws))
        return clean[:, None] + noise * response.brightness * deviation
    b = response.moments(contender.base_frequency_hz, contender.m)
    drawn = rng.normal(size=(2, b.size, draws))
    drawn[1, 0] = 0  # b_0 is real
    noisy: _Array = b[:, None] + noise * response.brightness * (drawn[0] + 1j * drawn[1])
    return noisy


def _code_samples(contender: Contender, response: Response) -> _Array:
    """Correlate a finely divided response with the code, at 62 shifts."""
    from transientcam_moments.comparisons import equal_shifts_rad, maximum_length_code

    turn = 2 * np.pi * contender.base_frequency_hz
    period_s = 1 / contender.base_frequency_hz
    edges_s = np.linspace(0, period_s, 8001)
    light = np.diff(response.cumulative(edges_s))
    middles_s = (edges_s[1:] + edges_s[:-1]) / 2
    at_s, weight = middles_s[light > 0], light[light > 0]
    if all(not each.width_s for each in response.returns):
        at_s = np.array([each.delay_s for each in response.returns])
        weight = np.array([each.weight for each in response.returns])
    shifts = equal_shifts_rad(62)
    found: _Array = maximum_length_code().sample(
        (turn * at_s)[:, None], weight[:, None], shifts_rad=shifts
    )[:, 0]
    return found
