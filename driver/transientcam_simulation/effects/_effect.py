"""The base of effects, and the values they work on.

Effects come in four kinds, by where they happen:

- ``LightEffect``: light on its way. The scenery computes it; the effect only judges.
- ``PlaneEffect``: from light to electrons, the same for all images of a frequency.
- ``ShotEffect``: differences from one image to the next.
- ``ImageEffect``: from electrons to numbers, image by image.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import ImageLabel
from transientcam_simulation.base import TYPICAL, TYPICAL_OTHER_LIGHT, standard_normal
from transientcam_simulation.effects._conditions import Call, Conditions

Plane = NDArray[np.float32]
_NONE = np.float32(0)


@dataclass(slots=True)
class LightPlanes:
    """Mean electrons of all images of one frequency, in a region (rows, columns) of the image.

    ``reflectance`` computes that of all pixels, (H, W) or one for all.
    An image at phase theta has ``constant + mean + sum_k Re(terms[k] exp(-i k theta))``, without
    light only ``constant``, of which ``dark`` comes without other light, too.
    """

    frequency_hz: float
    region: tuple[slice, slice]
    constant: Plane | np.float32
    reflectance: Callable[[], Plane | np.float32]
    mean: Plane
    terms: dict[int, NDArray[np.complex64]] = field(default_factory=dict)
    dark: np.float32 = _NONE

    def move(self, share: float, moved: Callable[[NDArray[Any]], NDArray[Any]]) -> None:
        """Move a share of all light to other pixels; what is even stays so."""

        def mixed(plane: NDArray[Any]) -> NDArray[Any]:
            return ((1 - share) * plane + share * moved(plane)).astype(plane.dtype)

        self.mean = mixed(self.mean)
        if isinstance(self.constant, np.ndarray):
            self.constant = mixed(self.constant)
        self.terms = {k: mixed(term) for k, term in self.terms.items()}


@dataclass(slots=True)
class Shot:
    """The differences of one image from the others of its frequency.

    Two taps of one ``exposure`` have numbers of their own.
    ``delay_s`` is added to all times of flight; the modulated part is multiplied by ``factor``, all
    of the camera's own light by ``power``, and other light by ``others``.
    """

    number: int
    device_time_s: float
    seed: int
    exposure: int
    label: ImageLabel
    delay_s: float = 0.0
    factor: complex = 1.0
    power: float = 1.0
    others: float = 1.0


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

    ``figures`` names the field of the device's profile, or of what else is the ``holder``, that it
    depends on, if there is one. An effect that is forced on where there are no such figures takes
    typical ones.
    """

    name: ClassVar[str]
    what: ClassVar[str]
    optional: ClassVar[bool] = True
    figures: ClassVar[str] = ""
    holder: ClassVar[str] = "device"

    def __init__(self, conditions: Conditions) -> None:
        self._sensor = conditions.sensor
        held = getattr(conditions, self.holder)
        self._figures: Any = getattr(held, self.figures) if self.figures else None

    @classmethod
    @abstractmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Judge whether these conditions call for the effect."""

    @classmethod
    def forced_on(cls, conditions: Conditions) -> Conditions:
        """Return conditions under which the effect exists."""
        held: Any = getattr(conditions, cls.holder)
        if not cls.figures or getattr(held, cls.figures) is not None:
            return conditions
        typical = TYPICAL if cls.holder == "device" else TYPICAL_OTHER_LIGHT
        figures: dict[str, Any] = {cls.figures: getattr(typical, cls.figures)}
        return replace(conditions, **{cls.holder: replace(held, **figures)})


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
