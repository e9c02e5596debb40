"""What an effect is."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import Sequence
from transientcam_driver.simulation.sensor import Sensor

Electrons = NDArray[np.float32]


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


class Effect(ABC):
    """A stage of the sensor that works on one image in place."""

    name: ClassVar[str]
    optional: ClassVar[bool] = True

    def __init__(self, conditions: Conditions) -> None:
        self._sensor = conditions.sensor

    @classmethod
    @abstractmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Say whether these conditions call for the effect."""

    @abstractmethod
    def apply(self, image: Electrons, random: np.random.Generator) -> None:
        """Work on one image (H, W), in place."""
