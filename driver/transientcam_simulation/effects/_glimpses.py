"""What effects are judged by: the light of pixels over the scene's life, and its noise."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Noise:
    """The noise of one complex moment of a pixel, in units of brightness.

    A moment is made of four images, (I0 - I180) + i (I90 - I270), and has twice their noise.
    """

    scale_e: float
    """Electrons of an exposure at a brightness of 1."""
    white_e: float
    """Electrons of unmodulated light in an image of a white surface."""
    dark_e2: float
    """Variance of an image without light: of the read-out, the rounding and the dark current."""
    takes: int
    """Over which moments are averaged."""

    def deviation(self, brightness: Values | float, reflectance: Values | float) -> Values:
        """Return the root mean square error of a moment, real and imaginary part together."""
        variance_e2 = self.scale_e * np.maximum(brightness, 0) / 2 + self.dark_e2
        variance_e2 = variance_e2 + self.white_e * np.asarray(reflectance)
        result: Values = 2 * np.sqrt(variance_e2 / self.takes) / self.scale_e
        return result


@dataclass(frozen=True)
class Glimpse:
    """Pixels at one time of the scene's life, flat."""

    brightness: Values
    reflectance: Values
    """``brightness``, ``reflectance``: (P) zeroth moments, and the share of light that falls on a
    surface that reaches the camera."""
    cosine: Values
    """(P) of the angle between pixels' rays and the lens's axis."""
    shape: tuple[int, int]
    """Rows and columns of these pixels."""

    @property
    def plane(self) -> Values:
        """The brightness in rows and columns."""
        return self.brightness.reshape(self.shape)

    @cached_property
    def lit(self) -> NDArray[np.bool_]:
        """Which pixels any light reaches."""
        return np.asarray(self.brightness > 0)


class Facts(Protocol):
    """The light of a scene of surfaces, with and without one effect."""

    @property
    def glimpses(self) -> tuple[Glimpse, ...]:
        """The pixels judged, at several times of the scene's life; once where it stands still."""
        ...

    @property
    def too_thin(self) -> tuple[str, ...]:
        """Names of surfaces that move and may be thinner than a pixel."""
        ...

    @property
    def pixels_per_s(self) -> float:
        """Highest speed of any surface, in pixels."""
        ...

    @property
    def carried_past(self) -> int:
        """How many surfaces a camera or a lamp that moves is carried past; 0 where none does."""
        ...

    def changes(
        self, effect: str, frequencies_hz: tuple[float, ...], *, during_s: float = 0.0
    ) -> tuple[Values, ...]:
        """Return how far an effect moves each pixel's moments, at most, by glimpse.

        ``during_s`` is the time from the first image of a sequence to the last, and for "blur" that
        of an exposure. Empty where the scene has nothing that the effect is about.
        """
        ...

    def further_cost_s(self, noise: Noise, *, moments: int, image_period_s: float) -> float:
        """Return what light over several surfaces costs an image, of so many moments in all."""
        ...

    def missing(
        self, kind: str, frequencies_hz: tuple[float, ...]
    ) -> tuple[tuple[Glimpse, ...], tuple[Values, ...]]:
        """Return pixels, and how far moments lack light of a kind, by time."""
        ...

    def further_bounces(self, tolerance: float) -> int:
        """Return how often light goes from surface to surface until less than this is left."""
        ...
