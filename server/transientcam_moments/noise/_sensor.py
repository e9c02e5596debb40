"""The sensor as far as its noise goes."""

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.errors import ParameterError

ROUNDING_VARIANCE = 1 / 12
"""Of rounding to whole digital numbers, spread evenly over one."""


@dataclass(frozen=True, slots=True)
class Sensor:
    """A pixel and its converter.

    Attributes
    ----------
    gain_e_per_dn : float
        Electrons a digital number stands for.
    full_well_e : float
        Electrons that a pixel holds.
    read_noise_e : float
        Standard deviation of a read-out, in electrons.
    dark_dn : float
        What the converter gives for an empty pixel.
    bits : int
        Of the converter.

    Raises
    ------
    ParameterError
        Naming the attribute that no sensor has.
    """

    gain_e_per_dn: float = 9.0
    full_well_e: float = 40_000.0
    read_noise_e: float = 30.0
    dark_dn: float = 64.0
    bits: int = 12

    def __post_init__(self) -> None:
        """Refuse what no sensor has (ParameterError)."""
        for field in fields(self):
            least = 0.0 if field.name in ("read_noise_e", "dark_dn") else math.ulp(0.0)
            value = getattr(self, field.name)
            if not least <= value < math.inf:
                raise ParameterError(field.name, value, "finite and >= 0" if least == 0 else "> 0")
        if not 1 <= self.bits <= 16:
            raise ParameterError("bits", self.bits, "1 to 16")

    @property
    def highest_dn(self) -> int:
        """The converter's highest code."""
        return (1 << self.bits) - 1

    @property
    def brightest(self) -> float:
        """Largest b_0 in DN whose images neither fill the well nor reach the highest code.

        An image is at most ``dark + b_0``: 1/2 (b_0 + |b_j|) at the phase of the signal.
        """
        return min(self.full_well_e / self.gain_e_per_dn, self.highest_dn - self.dark_dn)

    def image_variance(self, signal: Array) -> Array:
        """Return the variance of one image in DN^2 at a mean signal in DN above the dark level.

        Electrons come one by one (their variance is their number), the read-out adds its own, and
        so does rounding, as long as the noise before it is no finer than a digital number.
        """
        gain = self.gain_e_per_dn
        return signal / gain + (self.read_noise_e / gain) ** 2 + ROUNDING_VARIANCE


class ImageNoise(NamedTuple):
    """Variance of raw images, a straight line over their signal, as a `Sensor` has it.

    Attributes
    ----------
    dark_variance : float
        Of an image without signal, in DN^2: read noise, and light that all pixels have.
    variance_per_dn : float
        What a DN of signal adds, in DN: the inverse gain.
    dark_dn : float
        What counts as no signal.
    """

    dark_variance: float
    variance_per_dn: float
    dark_dn: float

    @property
    def gain_e_per_dn(self) -> float:
        """Electrons a digital number stands for."""
        return 1 / self.variance_per_dn

    def as_sensor(self, highest_dn: int) -> Sensor:
        """Return the sensor of whole numbers up to the highest one with this noise."""
        dark_dn, gain = max(self.dark_dn, 0.0), self.gain_e_per_dn
        read = self.image_variance(np.float64(dark_dn - self.dark_dn)) - ROUNDING_VARIANCE
        read_e = math.sqrt(max(read, 0.0)) * gain
        return Sensor(gain, gain * highest_dn, read_e, dark_dn, highest_dn.bit_length())

    def image_variance(self, signal: Array) -> Array:
        """Return the variance of one image in DN^2 at a mean signal in DN above the dark level."""
        return signal * self.variance_per_dn + self.dark_variance
