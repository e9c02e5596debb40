"""Roll-off: the higher the frequency, the weaker the modulation."""

import numpy as np

from transientcam_simulation.base import RollOff
from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import LightPlanes, PlaneEffect


class AmplitudeRollOff(PlaneEffect):
    """Multiplies the modulated part by an amplitude that depends on the frequency."""

    name = "roll-off"
    what = "high frequencies are modulated less"
    figures = "roll_off"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        assert conditions.device.roll_off is not None  # noqa: S101  (else it is not built)
        self._roll_off = conditions.device.roll_off

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
            factor = np.float32(amplitude(self._roll_off, planes.frequency_hz))
            for term in planes.terms.values():
                term *= factor


def amplitude(roll_off: RollOff, frequency_hz: float) -> float:
    """Amplitude at a frequency."""
    return float(np.interp(frequency_hz, roll_off.frequency_hz, roll_off.amplitude))
