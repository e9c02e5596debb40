"""A mock: raw exposures of 80 and 100 MHz by four taps, swapped in every second image.

It runs by itself: frames wait in a queue of two, where the newest wins. Each tap has a gain and an
offset of its own, and the light a shot noise. Its clock began 1000 s before it was started.
"""

import queue
import threading
from typing import Any

import numpy as np

from transientcam_driver import (
    Camera,
    CameraLost,
    CameraName,
    CameraPlugin,
    Capture,
    Description,
    Exposure,
    FreeRunningCamera,
    Sensor,
)
from transientcam_supervisor import OffSwitch

WIDTH, HEIGHT, RATE_HZ, C_M_S = 64, 48, 20.0, 299_792_458.0
RANGE_M = 1.3 + 0.6 * np.arange(WIDTH) / WIDTH + np.zeros((HEIGHT, 1))
TAPS = ((1.00, 200.0), (1.03, 220.0), (0.97, 190.0), (1.05, 240.0))  # gain, offset in DN
LIGHT_DN, AMBIENT_DN = 900.0, 150.0
SENSOR = Sensor(60_000.0, 15.0, 50.0, 0.0, 12)
MEASURED = tuple(
    Exposure(f_hz, k * np.pi / 2, 2e-3, *TAPS[(k + 2 * swapped) % 4])
    for f_hz in (100e6, 80e6)
    for swapped in (0, 1)
    for k in range(4)
)


class Stream(threading.Thread):
    """The device itself."""

    def __init__(self, spoilt: threading.Event) -> None:
        super().__init__(daemon=True)
        self.frames: queue.Queue[Capture] = queue.Queue(2)
        self.ended, self._spoilt = threading.Event(), spoilt

    def run(self) -> None:
        rng, number = np.random.default_rng(1), 0
        while not self.ended.wait(1 / RATE_HZ):
            images = []
            for each in MEASURED:
                turn = 4 * np.pi * each.frequency_hz * RANGE_M / C_M_S - each.phase_rad
                light = AMBIENT_DN + LIGHT_DN * (1 + np.cos(turn)) / 2
                noise = np.sqrt(light / 15.0 + (50.0 / 15.0) ** 2)
                seen = light + noise * rng.standard_normal(light.shape)
                image = np.rint(each.offset_dn + each.gain * seen).clip(0, 4095).astype(np.uint16)
                images.append(image)
            if not self._spoilt.is_set():
                if self.frames.full():
                    self.frames.get()
                self.frames.put(Capture(images, number, 1000.0 + number / RATE_HZ, 41.5))
            self._spoilt.clear()
            number += 1


class Device:
    off_switch = OffSwitch()
    unplugged, spoilt = threading.Event(), threading.Event()
    lit = 0

    def __init__(self) -> None:
        self.temperature_c()
        self.description = Description(
            model="taps",
            serial="T1",
            firmware="1",
            width=WIDTH,
            height=HEIGHT,
            frame_rate_hz=RATE_HZ,
            measurements=MEASURED,
            sensor=SENSOR,
        )
        self.stream: Stream | None = None

    def start(self, exposure_s: float) -> None:
        self.stream = Stream(self.spoilt)
        self.stream.start()
        Device.lit = 1

    def receive(self, timeout_s: float) -> Capture | None:
        self.temperature_c()
        try:
            return None if self.stream is None else self.stream.frames.get(timeout=timeout_s)
        except queue.Empty:
            return None

    def temperature_c(self) -> float:
        if self.unplugged.is_set():
            raise CameraLost("unplugged")
        return 41.5

    def light_off(self) -> None:
        Device.lit = 0
        if self.stream is not None:
            self.stream.ended.set()
            self.stream.join()

    def close(self) -> None:
        self.light_off()


def _open(name: CameraName, clock: Any) -> Camera:
    return FreeRunningCamera(Device)


PLUGIN = CameraPlugin("a mock of four taps", "taps:", _open)
