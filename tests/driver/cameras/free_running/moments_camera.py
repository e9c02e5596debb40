"""A mock: complex moments of 20 and 100 MHz, each with a noise of its own, in its own unit."""

import threading
from typing import Any

import numpy as np

from transientcam_driver import (
    Camera,
    CameraName,
    CameraPlugin,
    Capture,
    Description,
    Extrinsics,
    FreeRunningCamera,
    Lens,
    Moment,
)
from transientcam_supervisor import OffSwitch

WIDTH, HEIGHT, RATE_HZ, C_M_S = 64, 48, 25.0, 299_792_458.0
RANGE_M = 4.0 + 2.0 * np.arange(WIDTH) / WIDTH + np.zeros((HEIGHT, 1))
GAIN = np.exp(0.4j) * (1 + 0.1 * np.arange(HEIGHT) / HEIGHT)[:, None] + np.zeros((1, WIDTH))
MEASURED = (Moment(20e6, 0.004, 2.0), Moment(100e6, 0.01, 2.0, GAIN))


class Device:
    off_switch = OffSwitch()

    def __init__(self) -> None:
        self.number, self.rng, self.stopped = 0, np.random.default_rng(2), threading.Event()
        self.description = Description(
            model="moments",
            serial="M1",
            firmware="1",
            width=WIDTH,
            height=HEIGHT,
            frame_rate_hz=RATE_HZ,
            measurements=MEASURED,
            lens=Lens(60.0, 60.0, 31.5, 23.5),
            extrinsics=Extrinsics("base_link", (0.5, -0.5, 0.5, 0.5), (0.2, -0.1, 1.3)),
        )

    def start(self, exposure_s: float) -> None:
        self.stopped.clear()

    def receive(self, timeout_s: float) -> Capture | None:
        if self.stopped.wait(1 / RATE_HZ):
            return None
        images = []
        for each in MEASURED:
            noise = self.rng.standard_normal((2, HEIGHT, WIDTH)) * each.std
            turn = 4 * np.pi * each.frequency_hz * RANGE_M / C_M_S
            images.append(each.gain * 0.7 * np.exp(1j * turn) + noise[0] + 1j * noise[1])
        self.number += 1
        return Capture(images, self.number, 50.0 + self.number / RATE_HZ)

    def temperature_c(self) -> None:
        """It has no thermometer."""

    def light_off(self) -> None:
        self.stopped.set()

    def close(self) -> None:
        self.stopped.set()


def _open(name: CameraName, clock: Any) -> Camera:
    return FreeRunningCamera(Device)


PLUGIN = CameraPlugin("a mock of complex moments", "moments:", _open)
