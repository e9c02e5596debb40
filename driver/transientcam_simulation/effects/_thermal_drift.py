"""Thermal drift: the device warms up, and its light comes later."""

import math

import numpy as np

from transientcam_simulation.base import Drift
from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import Shot, ShotEffect


class ThermalDrift(ShotEffect):
    """All times of flight grow with the temperature above that at the start."""

    name = "thermal-drift"
    what = "the light comes later as the camera warms up"
    figures = "drift"

    def __init__(self, conditions: Conditions) -> None:
        super().__init__(conditions)
        assert conditions.device.drift is not None  # noqa: S101  (else it is not built)
        self._drift = conditions.device.drift

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
        return rise_c(self._drift, device_time_s)

    def on_shot(self, shot: Shot) -> None:
        """Delay the light."""
        shot.delay_s += self._drift.delay_s_per_c * self.rise_c(shot.device_time_s)


def rise_c(drift: Drift, device_time_s: float) -> float:
    """Newton's law: the temperature nears its end value exponentially."""
    return -drift.rise_c * math.expm1(-device_time_s / drift.time_constant_s)
