"""Effects of the sensor: from electrons to whole numbers."""

import math

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.effects._conditions import Call, Conditions, always, weigh
from transientcam_simulation.effects._effect import Exposure, ImageEffect, LightPlanes, PlaneEffect

_SATURATION_COST_S_PER_PIXEL = 4e-10
_SHOT_COST_S_PER_PIXEL = 1.2e-8
_READ_COST_S_PER_PIXEL = 8e-9
_QUANTISATION_COST_S_PER_PIXEL = 3e-9
_SPREADS = (
    4  # standard deviations of noise that may fill a pixel, or bring it below the converter's end
)
_FURTHER_LIGHT = 0.25  # that comes over several surfaces, at most, where a pixel is brightest
FEW_E = 100.0
"""Below this mean a pixel is drawn from the Poisson distribution itself.

Above it the normal distribution of the same mean and variance takes its place: it is cheaper to
draw, and its draw is shared with other noise. At 100 electrons the skewness it leaves out is 0.1,
and the read noise that follows hides that further.
"""


class DarkCurrentElectrons(PlaneEffect):
    """Adds the same electrons to every pixel, and with them their shot noise."""

    name = "dark-current"
    what = "electrons that come without light"
    figures = "dark_current"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self._electrons = np.float32(_electrons(conditions))

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where their shot noise counts."""
        electrons = _electrons(conditions)
        if not electrons:
            return Call(False, "the pixels of the device stay empty in the dark", 0.0, 0.0)
        error = 2 * math.sqrt(electrons / conditions.sequence.takes) / conditions.scale_e
        changes = tuple(np.full(each.brightness.shape, error) for each in conditions.glimpses)
        return weigh(conditions, changes, f"{electrons:.0f} electrons in each image without light")

    def on_light(self, planes: LightPlanes) -> None:
        """Add them to the part without the camera's light."""
        planes.constant = planes.constant + self._electrons
        planes.dark += self._electrons


def _electrons(conditions: Conditions) -> float:
    current = conditions.device.dark_current
    return current.electrons_per_s * conditions.sequence.exposure_s if current else 0.0


class Saturation(ImageEffect):
    """Light beyond the full well is lost."""

    name = "saturation"
    what = "full pixels hold no more light"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the brightest pixel may fill up before the converter is at its end."""
        sensor = conditions.sensor
        full_well_e = sensor.full_well_e
        highest_e = (sensor.highest_dn - sensor.dark_dn) * sensor.gain_e_per_dn
        if full_well_e >= highest_e + _SPREADS * sensor.read_noise_e:
            reason = f"the converter ends at {highest_e / full_well_e:.0%} of a full well"
            return Call(False, reason, 0.0, 0.0)
        brightest_e = conditions.brightest_e * (1 + _FURTHER_LIGHT) + conditions.white_e
        cost_s = conditions.pixels * _SATURATION_COST_S_PER_PIXEL
        over_e = max(0.0, brightest_e + _SPREADS * math.sqrt(brightest_e) - full_well_e)
        share = brightest_e / full_well_e
        reason = f"the brightest pixel gets up to {share:.0%} of a full well"
        size_dn = math.sqrt(2) * over_e / sensor.gain_e_per_dn
        relative = size_dn / conditions.floor_dn
        return Call(over_e > 0, reason, size_dn, cost_s, relative, relative)

    def apply(self, exposure: Exposure) -> None:
        """Clip at the full well."""
        np.minimum(exposure.signal, np.float32(self._sensor.full_well_e), out=exposure.signal)


class ShotNoise(ImageEffect):
    """Variance equal to the mean."""

    name = "shot-noise"
    what = "light comes in single electrons"
    adds_variance = True

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Call for it always: what is dark now may be lit later."""
        mean_e = conditions.mean_e
        # a moment is made of four images and has twice their noise
        size_dn = 2 * math.sqrt(mean_e / conditions.sequence.takes)
        size_dn /= conditions.sensor.gain_e_per_dn
        cost_s = conditions.pixels * _SHOT_COST_S_PER_PIXEL
        return always(conditions, size_dn, f"{mean_e:.0f} electrons in a typical pixel", cost_s)

    def apply(self, exposure: Exposure) -> None:
        """Draw few electrons one by one; give many their variance."""
        few = np.flatnonzero(exposure.signal < FEW_E)
        exposure.variance_e2 = exposure.variance_e2 + exposure.signal
        if few.size:
            exposure.variance_e2.reshape(-1)[few] -= exposure.signal.reshape(-1)[few]
            draw_few(exposure, few)


def draw_few(exposure: Exposure, few: NDArray[np.intp]) -> None:
    """Draw the electrons of some pixels, by rising index, one by one."""
    flat = exposure.signal.reshape(-1)
    lit = few[flat[few] > 0]
    flat[lit] = exposure.random.poisson(flat[lit])


class ReadNoise(ImageEffect):
    """Normal, the same for every pixel, independent of the light."""

    name = "read-noise"
    what = "the amplifier adds noise"
    adds_variance = True

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self.variance_e2 = np.float32(conditions.sensor.read_noise_e**2)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Wherever the sensor has any."""
        noise_e = conditions.sensor.read_noise_e
        cost_s = conditions.pixels * _READ_COST_S_PER_PIXEL
        if noise_e == 0:
            return Call(False, "the sensor reads without noise", 0.0, cost_s)
        # a moment is made of four images and has twice their noise
        size_dn = 2 * noise_e / math.sqrt(conditions.sequence.takes)
        size_dn /= conditions.sensor.gain_e_per_dn
        return always(conditions, size_dn, f"{noise_e:g} electrons at each read-out", cost_s)

    def apply(self, exposure: Exposure) -> None:
        """Add its variance."""
        exposure.variance_e2 = exposure.variance_e2 + self.variance_e2


class Quantisation(ImageEffect):
    """Round to the nearest code. Always there: an image holds integers."""

    name = "quantisation"
    what = "images hold whole numbers"
    optional = False

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        self.dn_per_e = np.float32(1 / conditions.sensor.gain_e_per_dn)
        self.dark_dn = np.float32(conditions.sensor.dark_dn)
        self.highest_dn = np.float32(conditions.sensor.highest_dn)

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Call for it always; its error is that of rounding four images, 1 / sqrt(12) each."""
        reason = f"{conditions.sensor.bits} bits of {conditions.sensor.gain_e_per_dn:g} electrons"
        size_dn = 2 / math.sqrt(12 * conditions.sequence.takes)
        return always(
            conditions, size_dn, reason, conditions.pixels * _QUANTISATION_COST_S_PER_PIXEL
        )

    def apply(self, exposure: Exposure) -> None:
        """Turn electrons into codes."""
        image = exposure.signal
        image *= self.dn_per_e
        image += self.dark_dn
        np.rint(image, out=image)
        np.clip(image, np.float32(0), self.highest_dn, out=image)
