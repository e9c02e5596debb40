"""An emulated OPT8241-CDK whose frames say what they were taken with, and cost nothing."""

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import TriggeredCamera
from transientcam_driver.clock import Clock, RealClock
from transientcam_opt8241 import Opt8241
from transientcam_opt8241.emulated import EmulatedOpt8241

SERIAL = "0042"


class Marked:
    """Images whose pixels are the frequency in MHz above the zero, and more with the phase."""

    def __init__(self, quads: int) -> None:
        self._quads = quads
        self.taken: list[tuple[float, float]] = []

    def differences(
        self, frequency_hz: float, exposure_s: float, *, delay_s: float, device_time_s: float
    ) -> NDArray[np.uint16]:
        self.taken.append((frequency_hz, exposure_s))
        images = np.full((self._quads, 240, 320), 2048 + round(frequency_hz / 1e6), np.uint16)
        images += np.arange(0, 200 * self._quads, 200, dtype=np.uint16)[:, None, None]
        images[:, 0, :3] = [[0, 4095, 1]]
        images[:, 7, 11] += 1
        return images

    def temperature_c(self, device_time_s: float) -> float:
        return -3.0


def emulated(quads: int = 4, *, clock: Clock | None = None) -> EmulatedOpt8241:
    return EmulatedOpt8241(Marked(quads), serial=SERIAL, clock=clock or RealClock())


def camera_of(
    device: EmulatedOpt8241, *, quads: int = 4, clock: Clock | None = None
) -> TriggeredCamera:
    return TriggeredCamera(lambda: Opt8241(device.connect(), quads=quads), clock=clock)
