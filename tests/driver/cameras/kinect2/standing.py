"""An emulated Kinect v2 whose frames are all the same, so that none has to be computed."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.kinect2 import (
    HEIGHT,
    MEASURED,
    SUB_IMAGE_BYTES,
    WIDTH,
    DepthParameters,
    Kinect2,
    Kinect2Camera,
    P0Tables,
)
from transientcam_driver.clock import Clock, RealClock
from transientcam_simulation.emulated._kinect2 import EmulatedFirmware, EmulatedKinect2

READ_S = 600.0  # against a test that hangs, not against a machine that is slow
SERIAL = "001234567890"
LENS = DepthParameters(365.0, 365.0, 256.0, 205.0)
TABLES = P0Tables(np.full((3, HEIGHT, WIDTH), 10_000, np.uint16))
PARAMETERS, P0 = LENS.pack(), TABLES.pack()


class Still:
    """Sub-images of random bytes, the same for all frames."""

    def __init__(self) -> None:
        random = np.random.default_rng(1)
        self.data = random.integers(0, 256, (MEASURED, SUB_IMAGE_BYTES), np.uint8)

    def sub_images(self, number: int, *, device_time_s: float) -> NDArray[np.uint8]:
        return self.data


STILL = Still()


def firmware(serial: str = SERIAL, *, polls: int = 1) -> EmulatedFirmware:
    return EmulatedFirmware(serial, PARAMETERS, P0, polls=polls)


def emulated(serial: str = SERIAL, *, clock: Clock | None = None) -> EmulatedKinect2:
    return EmulatedKinect2(lambda: firmware(serial), STILL, clock=clock or RealClock())


def ignore(_: object) -> None:
    """Take a pause, a packet or a failure, and do nothing."""


def camera_of(device: EmulatedKinect2, **options: Any) -> Kinect2Camera:
    def connect(serial: str | None) -> Kinect2:
        return Kinect2(device.connect(), pause=ignore, serial=serial)

    return Kinect2Camera(connect, **{"silence_s": READ_S, **options})
