"""The base of effects, and the values they work on.

Effects come in four kinds, by where they happen:

- ``LightEffect``: light on its way. The scenery computes it; the effect only judges.
- ``PlaneEffect``: from light to electrons, the same for all images of a frequency.
- ``ShotEffect``: differences from one image to the next.
- ``ImageEffect``: from electrons to numbers, image by image.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sensor import Sensor
from transientcam_driver.sequence import LOW_FREQUENCY_HZ, Sequence
from transientcam_driver.simulation.effects.glimpses import Facts, Glimpse, Noise, Values
from transientcam_driver.simulation.imperfections import (
    IDEAL,
    PINHOLE,
    TYPICAL,
    DeviceProfile,
    Lens,
)
from transientcam_driver.simulation.normal import standard_normal

CALLED_ABOVE = 0.1
"""Effects are called for above this share of the noise, as a root mean square over the lit pixels.

An error of a tenth of the noise adds half a percent to it (errors add up in squares).
"""
WORST_ABOVE = 0.25
"""And above this share of its own noise in any pixel that was judged.

Two effects that are left out then change no pixel by more than half its noise.
"""

Plane = NDArray[np.float32]
_NONE = np.float32(0)


@dataclass(frozen=True)
class Conditions:
    """The conditions an effect is judged by: sensor, sequence, device, and the scene's light.

    ``glimpses`` are pixels at several times of the scene's life, ``facts`` how effects change
    their light (None if there is no geometry). ``white_e`` are electrons of unmodulated light in
    each image of a white surface; ``cosine`` (H, W) is that of pixels' rays to the lens's axis.
    """

    sensor: Sensor
    sequence: Sequence
    scale_e: float
    glimpses: tuple[Glimpse, ...]
    white_e: float = 0.0
    image_period_s: float = 0.0
    device: DeviceProfile = IDEAL
    lens: Lens = PINHOLE
    facts: Facts | None = None
    cosine: Values = field(default_factory=lambda: np.ones((1, 1)))
    moves: bool = False

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the image."""
        return self.cosine.shape[0], self.cosine.shape[1]

    @property
    def pixels(self) -> int:
        """How many the image has."""
        return self.cosine.size

    @cached_property
    def noise(self) -> Noise:
        """Noise of a moment by the brightness of its pixel, without other light."""
        sensor = self.sensor
        dark_e2 = sensor.read_noise_e**2 + sensor.gain_e_per_dn**2 / 12
        return Noise(self.scale_e, 0.0, dark_e2, self.sequence.takes)

    @cached_property
    def _typical(self) -> tuple[float, float]:
        """Mean brightness and reflectance of the lit pixels over the scene's life."""
        lit = np.concatenate([each.brightness[each.lit] for each in self.glimpses])
        reflectance = np.concatenate([each.reflectance[each.lit] for each in self.glimpses])
        return (float(lit.mean()), float(reflectance.mean())) if lit.size else (0.0, 0.0)

    @property
    def brightness_e(self) -> float:
        """Zeroth moment of a typical pixel in electrons."""
        return self._typical[0] * self.scale_e

    @property
    def brightest_e(self) -> float:
        """The highest zeroth moment over the scene's life."""
        return max(float(each.brightness.max(initial=0.0)) for each in self.glimpses) * self.scale_e

    @property
    def ambient_e(self) -> float:
        """Electrons of other light in each image of a typical pixel."""
        reflectance = np.concatenate([each.reflectance for each in self.glimpses])
        return self.white_e * float(reflectance.mean())

    @property
    def mean_e(self) -> float:
        """Electrons of a typical pixel in one image, averaged over the phases."""
        return self.brightness_e / 2 + self.ambient_e

    @property
    def brightness_dn(self) -> float:
        """Zeroth moment of a typical pixel."""
        return self.brightness_e / self.sensor.gain_e_per_dn

    @property
    def floor_dn(self) -> float:
        """The noise floor: root mean square error of one complex moment of a typical pixel.

        Of shot noise, read noise and rounding, averaged over the takes.
        """
        noise = replace(self.noise, white_e=self.ambient_e)
        relative = noise.deviation(self._typical[0], 1.0)
        return float(relative) * self.scale_e / self.sensor.gain_e_per_dn

    @property
    def highest_hz(self) -> float:
        """The highest frequency that is measured."""
        return self.sequence.harmonics * self.sequence.base_frequency_hz

    @property
    def frequencies_hz(self) -> tuple[float, ...]:
        """All frequencies that are measured."""
        f_hz = self.sequence.base_frequency_hz
        measured = tuple(j * f_hz for j in range(1, self.sequence.harmonics + 1))
        return ((LOW_FREQUENCY_HZ,) if self.sequence.zeroth == "low-frequency" else ()) + measured

    @property
    def sequence_s(self) -> float:
        """Time from the first image of the sequence to the last."""
        return (self.sequence.images - 1) * self.image_period_s

    def sub_phase_gain(self, harmonic: int) -> complex:
        """G_k: gain of a harmonic by the division of the exposure (Sec. 4.1)."""
        sub_phases = self.sequence.sub_phases
        phases = np.array(sub_phases.phases_rad)
        return complex(np.sum(sub_phases.weights * np.exp(-1j * harmonic * phases)))

    @property
    def negligible(self) -> float:
        """Brightness that changes no moment by more than a tenth of the noise of a dark pixel."""
        return CALLED_ABOVE * float(self.noise.deviation(0.0, 0.0))

    def of_light(self, share: float) -> tuple[Values, ...]:
        """Return a change by the same share of the light in every pixel, by glimpse."""
        return tuple(share * each.brightness for each in self.glimpses)

    def changes(self, effect: str) -> tuple[Values, ...]:
        """Return how far an effect of light moves the moments, by glimpse; empty if nowhere."""
        if self.facts is None:
            return ()
        return self.facts.changes(effect, self.frequencies_hz, during_s=self.sequence_s)


@dataclass(frozen=True, slots=True)
class Call:
    """Whether an effect is called for, and why.

    ``size_dn`` is the error it causes in one moment, as a root mean square over the lit pixels in
    digital numbers at the worst of the times judged; ``relative`` the same of the errors over each
    pixel's own noise, and ``worst`` the largest of them; ``cost_s`` what one image costs, by the
    order of magnitude.
    """

    called: bool
    reason: str
    size_dn: float
    cost_s: float
    relative: float = 0.0
    worst: float = 0.0


def weigh(
    conditions: Conditions, changes: tuple[Values, ...], reason: str, cost_s: float = 0.0
) -> Call:
    """Call for an effect that changes moments (P), by glimpse, too far against their noise.

    ``{share}`` in the reason becomes the share of the lit pixels that change so far, at the time
    when most do.
    """
    size = relative = worst = share = 0.0
    for glimpse, change in zip(conditions.glimpses, changes, strict=True):
        counted = glimpse.lit | (change > 0)
        if not counted.any():
            continue
        moved = change[counted]
        noise = replace(conditions.noise, white_e=conditions.white_e)
        deviation = noise.deviation(glimpse.brightness[counted], glimpse.reflectance[counted])
        size = max(size, math.sqrt(np.mean(moved**2)))
        relative = max(relative, math.sqrt(np.mean((moved / deviation) ** 2)))
        worst = max(worst, float((moved / deviation).max()))
        share = max(share, float(np.mean(moved > WORST_ABOVE * deviation)))
    called = relative > CALLED_ABOVE or worst > WORST_ABOVE
    size_dn = size * conditions.scale_e / conditions.sensor.gain_e_per_dn
    words = f"{share:.1%}" if share >= 1e-3 or not share else "less than 0.1%"
    return Call(called, reason.format(share=words), size_dn, cost_s, relative, worst)


def always(conditions: Conditions, size_dn: float, reason: str, cost_s: float) -> Call:
    """Call for what is physics of the sensor, whatever its size."""
    relative = size_dn / conditions.floor_dn
    return Call(True, reason, size_dn, cost_s, relative, relative)


@dataclass(slots=True)
class LightPlanes:
    """Mean electrons of all images of one frequency, in a region (rows, columns) of the image.

    ``reflectance`` computes that of all pixels, (H, W) or one for all.
    An image at phase theta has ``constant + mean + sum_k Re(terms[k] exp(-i k theta))``, without
    light only ``constant``.
    """

    frequency_hz: float
    region: tuple[slice, slice]
    constant: Plane | np.float32
    reflectance: Callable[[], Plane | np.float32]
    mean: Plane
    terms: dict[int, NDArray[np.complex64]] = field(default_factory=dict)


@dataclass(slots=True)
class Shot:
    """The differences of one image from the others of its frequency.

    ``delay_s`` is added to all times of flight; the modulated part is multiplied by ``factor``.
    """

    number: int
    device_time_s: float
    seed: int
    delay_s: float = 0.0
    factor: complex = 1.0


@dataclass(slots=True)
class Exposure:
    """One image on its way through the sensor.

    ``signal`` (H, W) is in electrons until it is quantised. Normal noise is not added by each
    effect: their variances add up in ``variance_e2``, of which ``NormalDraw`` draws once. The sum
    of independent normal variables is normal, and the draw is the cost of noise.
    """

    signal: Plane
    random: np.random.Generator
    variance_e2: Plane | np.float32 = _NONE


class Stage(ABC):
    """A step from electrons to numbers, for every image."""

    adds_variance: ClassVar[bool] = False

    @abstractmethod
    def apply(self, exposure: Exposure) -> None:
        """Work on one image, in place."""


class NormalDraw(Stage):
    """Draw the normal noise whose variance the stages before have added up."""

    def apply(self, exposure: Exposure) -> None:
        """Add it to the signal."""
        noise = standard_normal(exposure.random, exposure.signal.shape)
        noise *= np.sqrt(exposure.variance_e2)
        exposure.signal += noise
        exposure.variance_e2 = _NONE


class Effect(ABC):
    """An effect, what it is in a few words, and whether a scene calls for it.

    ``figures`` names the field of the device's profile that it depends on, if there is one. An
    effect that is forced on where the device has no such figures takes typical ones.
    """

    name: ClassVar[str]
    what: ClassVar[str]
    optional: ClassVar[bool] = True
    figures: ClassVar[str] = ""

    def __init__(self, conditions: Conditions) -> None:
        self._sensor = conditions.sensor

    @classmethod
    @abstractmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Judge whether these conditions call for the effect."""

    @classmethod
    def forced_on(cls, conditions: Conditions) -> Conditions:
        """Return conditions under which the effect exists."""
        device = conditions.device
        if not cls.figures or getattr(device, cls.figures) is not None:
            return conditions
        figures: dict[str, Any] = {cls.figures: getattr(TYPICAL, cls.figures)}
        return replace(conditions, device=replace(device, **figures))


class LightEffect(Effect):
    """Light on its way; the scenery computes it."""


class PlaneEffect(Effect):
    """From light to electrons, the same for all images of a frequency.

    ``local``: a pixel depends on its own light only, so that a region can be computed by itself.
    """

    local: ClassVar[bool] = True

    @abstractmethod
    def on_light(self, planes: LightPlanes) -> None:
        """Work on the planes of one frequency, in place."""


class ShotEffect(Effect):
    """Differences from one image to the next."""

    @abstractmethod
    def on_shot(self, shot: Shot) -> None:
        """Work on one image's own figures, in place."""


class ImageEffect(Effect, Stage):
    """From electrons to numbers, image by image."""
