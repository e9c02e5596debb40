"""What every technique says of itself, so that one can be exchanged for another."""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._estimate import Estimate
from transientcam_moments.noise import MomentNoise

_WORDS: Final = tomllib.loads(Path(__file__).with_name("techniques.toml").read_text("utf-8"))
TEXTS: Final[dict[str, dict[str, Any]]] = {
    name: {"name": name, **texts} for name, texts in _WORDS.items()
}
"""What each of ours says in words, by its name: the arguments of `Technique` that are texts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Technique:
    """A way from what a camera measures to an impulse response.

    Attributes
    ----------
    name
        What it is chosen by.
    label
        Where it comes from. "After ..." says that it follows what is known of a publication whose
        text was not at hand, not that it is the authors' implementation.
    returns
        The most returns that it separates, as a function of m in words; "density" where it
        gives no returns but light over time.
    frequencies
        What it needs to be measured, in words.
    harmonics
        From m to the multiples of the base frequency that it looks at, ascending; 0 is b_0.
    least_harmonics
        The smallest m that it works with.
    assumptions, cost, failure
        What it takes for granted, what it costs a pixel, and what happens where it does not hold.
    estimate
        From calibrated moments (m + 1, ...) to an `Estimate`, or from the samples (N, ...) of a
        code's correlation; options are keywords.
    informed
        Whether ``estimate`` also takes the keywords ``noise``, a `noise.MomentNoise` or None, and
        ``frequencies_hz`` (m + 1,) of the moments.
    measures
        "moments" of equidistant frequencies, or samples of a "code".
    planar
        Whether all pixels are computed at once; else each by itself in a loop, which is no way to
        live images.
    """

    name: str
    label: str
    returns: str
    frequencies: str
    harmonics: Callable[[int], tuple[int, ...]]
    least_harmonics: int
    assumptions: str
    cost: str
    failure: str
    estimate: Callable[..., Estimate]
    measures: Literal["moments", "code"] = "moments"
    planar: bool = True
    informed: bool = False

    def of(
        self, b: Array, noise: MomentNoise | None = None, frequencies_hz: Array | None = None
    ) -> Estimate:
        """Return the estimate of moments (m + 1, ...), told what it asks for beside them."""
        told = {"noise": noise, "frequencies_hz": frequencies_hz} if self.informed else {}
        return self.estimate(b, **told)

    def frequencies_hz(self, base_frequency_hz: float, m: int | None = None) -> tuple[float, ...]:
        """Return the frequencies that it looks at, of a sequence of order m or of its smallest."""
        order = self.least_harmonics if m is None else m
        return tuple(j * base_frequency_hz for j in self.harmonics(order))


def from_first(m: int) -> tuple[int, ...]:
    """Return all harmonics but the zeroth: 1 .. m."""
    return tuple(range(1, m + 1))


def from_zeroth(m: int) -> tuple[int, ...]:
    """Return all harmonics: 0 .. m."""
    return tuple(range(m + 1))
