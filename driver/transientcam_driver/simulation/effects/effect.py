"""The base of effects, and the values they work on.

Effects come in four kinds, by where they happen:

- ``LightEffect``: light on its way. The scenery computes it; the effect only judges.
- ``PlaneEffect``: from light to electrons, the same for all images of a frequency.
- ``ShotEffect``: differences from one image to the next.
- ``ImageEffect``: from electrons to numbers, image by image.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sensor import Sensor
from transientcam_driver.sequence import LOW_FREQUENCY_HZ, Sequence
from transientcam_driver.simulation.imperfections import IDEAL, PROTOTYPE, DeviceProfile
from transientcam_driver.simulation.responses import Scatter

CALLED_ABOVE = 0.1
"""Effects are called for above this share of the noise floor.

An error of a tenth of the noise adds half a percent to it (errors add up in squares).
"""

Plane = NDArray[np.float32]
_NONE = np.float32(0)


class Facts(Protocol):
    """Figures of a scene's light; shares are of a typical pixel's light."""

    @property
    def mirror_share(self) -> float:
        """Share of the light that comes over mirrors."""
        ...

    @property
    def indirect_share(self) -> float:
        """Share of the light that comes over more than one scattering surface, by an estimate."""
        ...

    @property
    def scatter(self) -> Scatter | None:
        """The widest spread of light inside a surface; None where there is none."""
        ...

    @property
    def scatter_share(self) -> float:
        """Share of the pixels that see a surface that light enters."""
        ...

    @property
    def edges(self) -> tuple[float, float]:
        """Share of the pixels at an edge, and the typical step of range there in m."""
        ...

    @property
    def speed_m_s(self) -> float:
        """Of the fastest surface."""
        ...

    @property
    def moving_share(self) -> float:
        """Share of the pixels that see something moving, or its shadow, at some time."""
        ...


@dataclass(frozen=True, slots=True)
class Conditions:
    """The conditions an effect is judged by: sensor, sequence, device and brightness of the scene.

    ``brightness_e`` is the mean zeroth moment over the pixels that light reaches, in electrons
    at the sequence's exposure; 0 in the dark. ``brightest_e`` is the highest one.
    ``ambient_white_e`` are electrons of other light in each image of a white surface,
    ``ambient_e`` in that of a typical pixel.
    """

    sensor: Sensor
    sequence: Sequence
    brightness_e: float
    pixels: int
    brightest_e: float = 0.0
    ambient_white_e: float = 0.0
    ambient_e: float = 0.0
    image_period_s: float = 0.0
    device: DeviceProfile = IDEAL
    facts: Facts | None = None
    shape: tuple[int, int] = (1, 1)

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

        Of shot noise, read noise and rounding, averaged over the takes. A moment is made of four
        images, (I0 - I180) + i (I90 - I270), and has twice their noise.
        """
        gain = self.sensor.gain_e_per_dn
        variance_e2 = self.mean_e + self.sensor.read_noise_e**2 + gain**2 / 12
        return float(2 * np.sqrt(variance_e2 / self.sequence.takes) / gain)

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
    def images_per_moment_s(self) -> float:
        """Time from the first to the last of the four images of a moment."""
        between = self.sequence.takes if self.sequence.take_order == "interleaved" else 1
        return 3 * self.image_period_s * between

    def sub_phase_gain(self, harmonic: int) -> complex:
        """G_k: gain of a harmonic by the division of the exposure (Sec. 4.1)."""
        sub_phases = self.sequence.sub_phases
        phases = np.array(sub_phases.phases_rad)
        return complex(np.sum(sub_phases.weights * np.exp(-1j * harmonic * phases)))


@dataclass(frozen=True, slots=True)
class Call:
    """Whether an effect is called for, and why.

    ``size_dn`` is the error it causes in one moment of a typical pixel, as a root mean square in
    digital numbers; ``cost_s`` what one image costs, by the order of magnitude.
    """

    called: bool
    reason: str
    size_dn: float
    cost_s: float


def weigh(conditions: Conditions, size_dn: float, reason: str, cost_s: float) -> Call:
    """Call for an effect whose size is above a share of the noise floor."""
    floor_dn = conditions.floor_dn
    called = size_dn > CALLED_ABOVE * floor_dn
    return Call(called, reason, size_dn, cost_s)


@dataclass(slots=True)
class LightPlanes:
    """Mean electrons of all images of one frequency.

    An image at phase theta has ``constant + mean + sum_k Re(terms[k] exp(-i k theta))``, without
    light only ``constant``.
    """

    frequency_hz: float
    constant: Plane | np.float32
    reflectance: Plane | np.float32
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
        noise = exposure.random.standard_normal(exposure.signal.shape, dtype=np.float32)
        noise *= np.sqrt(exposure.variance_e2)
        exposure.signal += noise
        exposure.variance_e2 = _NONE


class Effect(ABC):
    """An effect, and whether a scene calls for it.

    ``figures`` names the field of the device's profile that it depends on, if there is one. An
    effect that is forced on where the device has no such figures takes the prototype's.
    """

    name: ClassVar[str]
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
        figures: dict[str, Any] = {cls.figures: getattr(PROTOTYPE, cls.figures)}
        return replace(conditions, device=replace(device, **figures))


class LightEffect(Effect):
    """Light on its way; the scenery computes it."""


class PlaneEffect(Effect):
    """From light to electrons, the same for all images of a frequency."""

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
