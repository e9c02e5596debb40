"""A mock: 14.9 MHz at three phases, and an incommensurable frequency near 100 MHz at five."""

import math
import threading
from typing import Any

import numpy as np

from transientcam_driver import (
    Camera,
    CameraName,
    CameraPlugin,
    Capture,
    Description,
    Exposure,
    FreeRunningCamera,
    Sensor,
)
from transientcam_supervisor import OffSwitch

WIDTH, HEIGHT, RATE_HZ, C_M_S = 64, 48, 25.0, 299_792_458.0
RANGE_M = 5.0 + 2.0 * np.arange(WIDTH) / WIDTH + np.zeros((HEIGHT, 1))
FREQUENCIES_HZ = (14.9e6, 14.9e6 * math.sqrt(45.0))
SENSOR = Sensor(50_000.0, 12.0, 40.0, 100.0, 12)
LIGHT_DN_S = 8e5
MEASURED = tuple(
    Exposure(f_hz, 2 * np.pi * k / count, exposure_s)
    for f_hz, count, exposure_s in zip(FREQUENCIES_HZ, (3, 5), (1e-3, 2e-3), strict=True)
    for k in range(count)
)


class Device:
    off_switch = OffSwitch()

    def __init__(self) -> None:
        self.number, self.rng, self.stopped = 0, np.random.default_rng(3), threading.Event()
        self.description = Description(
            model="odd",
            serial="O1",
            firmware="1",
            width=WIDTH,
            height=HEIGHT,
            frame_rate_hz=RATE_HZ,
            measurements=MEASURED,
            sensor=SENSOR,
            max_range_m=9.0,
        )

    def start(self, exposure_s: float) -> None:
        self.stopped.clear()

    def receive(self, timeout_s: float) -> Capture | None:
        if self.stopped.wait(1 / RATE_HZ):
            return None
        images = []
        for each in MEASURED:
            turn = 4 * np.pi * each.frequency_hz * RANGE_M / C_M_S - each.phase_rad
            light_e = 12.0 * LIGHT_DN_S * each.exposure_s * (1 + np.cos(turn)) / 2
            seen_e = self.rng.poisson(light_e) + 40.0 * self.rng.standard_normal(light_e.shape)
            images.append(np.rint(100.0 + seen_e / 12.0).clip(0, 4095).astype(np.uint16))
        self.number += 1
        return Capture(images, self.number, 7e5 + self.number / RATE_HZ, 33.0)

    def temperature_c(self) -> float:
        return 33.0

    def light_off(self) -> None:
        self.stopped.set()

    def close(self) -> None:
        self.stopped.set()


def _open(name: CameraName, clock: Any) -> Camera:
    return FreeRunningCamera(Device)


PLUGIN = CameraPlugin("a mock of incommensurable frequencies", "odd:", _open)
