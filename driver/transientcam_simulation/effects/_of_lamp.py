"""Effects of the lamp and its clock: how deep light is modulated, and when it comes."""

import math

import numpy as np

from transientcam_simulation.base import Drift, RollOff
from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightPlanes, PlaneEffect, Shot, ShotEffect


class AmplitudeRollOff(PlaneEffect):
    """Multiplies the modulated part by an amplitude that depends on the frequency."""

    name = "roll-off"
    what = "high frequencies are modulated less"
    figures = "roll_off"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the device's amplitude falls off between the frequencies that are measured."""
        roll_off = conditions.device.roll_off
        if roll_off is None:
            return Call(False, "the device modulates alike at all frequencies", 0.0, 0.0)
        least = min(amplitude(roll_off, f_hz) for f_hz in conditions.frequencies_hz)
        changes = conditions.of_light(1 - least)
        return weigh(conditions, changes, f"down to {least:.0%} of the amplitude")

    def on_light(self, planes: LightPlanes) -> None:
        """Weaken the modulated part."""
        if planes.frequency_hz:
            factor = np.float32(amplitude(self._figures, planes.frequency_hz))
            for term in planes.terms.values():
                term *= factor


def amplitude(roll_off: RollOff, frequency_hz: float) -> float:
    """Amplitude at a frequency."""
    return float(np.interp(frequency_hz, roll_off.frequency_hz, roll_off.amplitude))


class ThermalDrift(ShotEffect):
    """All times of flight grow with the temperature above that at the start."""

    name = "thermal-drift"
    what = "the light comes later as the camera warms up"
    figures = "drift"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the whole rise of the device's temperature shows."""
        drift = conditions.device.drift
        if drift is None:
            return Call(False, "the device stays as warm as it is", 0.0, 0.0)
        delay_s = abs(drift.rise_c * drift.delay_s_per_c)
        turn = abs(np.exp(2j * np.pi * conditions.highest_hz * delay_s) - 1)
        reason = f"{delay_s * 1e12:.0f} ps by {drift.rise_c:g} degrees in the end"
        return weigh(conditions, conditions.of_light(float(turn)), reason)

    def rise_c(self, device_time_s: float) -> float:
        """How much warmer the device is than at its start."""
        return rise_c(self._figures, device_time_s)

    def on_shot(self, shot: Shot) -> None:
        """Delay the light."""
        shot.delay_s += self._figures.delay_s_per_c * self.rise_c(shot.device_time_s)


def rise_c(drift: Drift, device_time_s: float) -> float:
    """Newton's law: the temperature nears its end value exponentially."""
    return -drift.rise_c * math.expm1(-device_time_s / drift.time_constant_s)


class SynchronisationOutliers(ShotEffect):
    """A share of the images has, for some part of the exposure, a random phase.

    The paper reports 5 to 10 % of all images (Sec. 6). Which ones depends on the seed and the
    image's number only, and on no other effect.
    """

    name = "outliers"
    what = "images that lose their synchronisation"
    figures = "outliers"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the device has any."""
        outliers = conditions.device.outliers
        if outliers is None or not outliers.share:
            return Call(False, "the device never loses its synchronisation", 0.0, 0.0)
        # a random phase for a part uniform in [0.2, 1]: E part^2 = 0.41; two images a component
        error = math.sqrt(outliers.share * 2 * 0.41 * 2) / 2
        changes = conditions.of_light(error * abs(conditions.sub_phase_gain(1)))
        return weigh(conditions, changes, f"{outliers.share:.0%} of the images", 1e-5)

    def on_shot(self, shot: Shot) -> None:
        """Give a share of the images a random phase."""
        random = np.random.Generator(
            np.random.SFC64(np.random.SeedSequence((shot.seed, shot.number, 0x0071)))
        )
        if random.random() < self._figures.share:
            part = random.uniform(0.2, 1.0)
            shot.factor *= (1 - part) + part * complex(np.exp(2j * np.pi * random.random()))
