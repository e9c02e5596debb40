"""What an effect is."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import Sequence
from transientcam_driver.simulation.sensor import Sensor

_NONE = np.float32(0)


@dataclass(frozen=True, slots=True)
class Conditions:
    """What an effect judges by: the sensor, the sequence, and how bright the scene is.

    ``brightness_e`` is the mean zeroth moment over the pixels that light reaches, in electrons
    at the sequence's exposure; 0 in the dark.
    """

    sensor: Sensor
    sequence: Sequence
    brightness_e: float
    pixels: int


@dataclass(frozen=True, slots=True)
class Call:
    """Whether an effect is called for, and why.

    ``size_dn`` is the standard deviation or error it causes in a typical pixel of one image, in
    digital numbers; ``cost_s`` what one image costs, by the order of magnitude.
    """

    called: bool
    reason: str
    size_dn: float
    cost_s: float


@dataclass(slots=True)
class Exposure:
    """One image on its way through the sensor.

    ``signal`` (H, W) is in electrons until it is quantised. Normal noise is not added by each
    effect: their variances add up in ``variance_e2``, of which ``NormalDraw`` draws once. The sum
    of independent normal variables is normal, and drawing is what noise costs.
    """

    signal: NDArray[np.float32]
    random: np.random.Generator
    variance_e2: NDArray[np.float32] | np.float32 = _NONE


class Stage(ABC):
    """Something that happens to every image."""

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


class Effect(Stage):
    """A stage that says whether a scene calls for it."""

    name: ClassVar[str]
    optional: ClassVar[bool] = True

    def __init__(self, conditions: Conditions) -> None:
        self._sensor = conditions.sensor

    @classmethod
    @abstractmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Say whether these conditions call for the effect."""
