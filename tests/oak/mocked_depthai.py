"""What the plug-in asks of depthai 3.12, and no more: names and arguments are the documented ones.

The device before it looks at a slanted wall. Raw images lie as the plug-in's README assumes.
"""

import queue
import threading
from dataclasses import dataclass
from datetime import timedelta
from enum import Enum
from functools import cache
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT, C_M_S = 640, 480, 299_792_458.0
RANGE_M = 2.0 + 1.5 * np.arange(WIDTH) / WIDTH + np.zeros((HEIGHT, 1))
NOISE_DN, BEGUN_S = 3.0, 500.0
FX = 400.0


class CameraExposureOffset(Enum):
    START = 0
    MIDDLE = 1
    END = 2


class CameraSensorType(Enum):
    COLOR = 0
    TOF = 2


@dataclass
class ImgFrame:
    number: int
    fps: float
    image: NDArray[np.uint16]

    def getFrame(self) -> NDArray[np.uint16]:
        return self.image

    def getType(self) -> Any:
        return SimpleNamespace(name="RAW12")

    def getSequenceNum(self) -> int:
        return self.number

    def getTimestampDevice(self, offset: CameraExposureOffset) -> timedelta:
        assert offset is CameraExposureOffset.START
        return timedelta(seconds=BEGUN_S) + self.number * timedelta(seconds=1 / self.fps)

    def getSensorTemperature(self) -> float | None:
        return 44.5


class MessageQueue:
    def __init__(self, maxSize: int, blocking: bool) -> None:
        assert not blocking
        self.messages: queue.Queue[ImgFrame] = queue.Queue(maxSize)

    def get(self, timeout: timedelta) -> ImgFrame | None:
        if Device.unplugged:
            raise RuntimeError("Communication exception - possible device error")
        try:
            return self.messages.get(timeout=timeout.total_seconds())
        except queue.Empty:
            return None

    def push(self, message: ImgFrame) -> None:
        if self.messages.full():
            self.messages.get()
        self.messages.put(message)


class ToF:
    def build(self, boardSocket: Any, profile: Any, fps: float) -> "ToF":
        assert boardSocket == "CAM_A"
        assert profile == "MID_RANGE"
        self.fps, self.raw = fps, self
        return self

    def createOutputQueue(self, maxSize: int = 16, blocking: bool = False) -> MessageQueue:
        self.queue = MessageQueue(maxSize, blocking)
        return self.queue


@cache
def raw_image(number: int) -> NDArray[np.uint16]:
    rng = np.random.default_rng(number)
    image = np.zeros((2 * HEIGHT + 2, 2 * WIDTH), np.uint16)
    f_hz, swapped = (80e6, 100e6)[number // 2 % 2], number % 2
    for tap in range(4):
        turn = 4 * np.pi * f_hz * RANGE_M / C_M_S - (tap + 2 * swapped) % 4 * np.pi / 2
        light = 300 + 700 * (1 + np.cos(turn)) + NOISE_DN * rng.standard_normal(turn.shape)
        image[tap // 2 : 2 * HEIGHT : 2, tap % 2 :: 2] = np.rint(light)
    return image


class Pipeline:
    def __init__(self, defaultDevice: "Device") -> None:
        self._ended, self._begun = threading.Event(), False
        self._device = defaultDevice

    def create(self, node: type[ToF]) -> ToF:
        self._tof = node()
        return self._tof

    def start(self) -> None:
        if self._begun:
            raise RuntimeError("Pipeline is already started")
        self._begun, Device.lit = True, True
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        Device.lit = False
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        number = 2  # it does not begin with a frame's first image
        while not self._ended.wait(1 / self._tof.fps):
            if number not in Device.losing:
                self._tof.queue.push(ImgFrame(number, self._tof.fps, raw_image(number % 16)))
            number += 1


class Device:
    lit = unplugged = False
    losing: frozenset[int] = frozenset()
    sensors: tuple[str, ...] = ("CAM_A",)

    def __init__(self, nameOrDeviceId: str = "") -> None:
        if Device.unplugged or nameOrDeviceId not in ("", "14442C10D1F8"):
            raise RuntimeError("No available devices")

    @staticmethod
    def getAllAvailableDevices() -> list[Any]:
        return [SimpleNamespace(name="1.2", getDeviceId=lambda: "14442C10D1F8")]

    def getConnectedCameras(self, type: CameraSensorType) -> tuple[str, ...]:
        assert type is CameraSensorType.TOF
        return self.sensors

    def getDeviceId(self) -> str:
        return "14442C10D1F8"

    def getProductName(self) -> str:
        return "OAK-D-SR-POE"

    def getChipTemperature(self) -> Any:
        if Device.unplugged:
            raise RuntimeError("Communication exception")
        return SimpleNamespace(average=51.0)

    def readCalibration(self) -> "Device":
        return self

    def getCameraIntrinsics(
        self, cameraId: str, resizeWidth: int, resizeHeight: int
    ) -> list[list[float]]:
        assert (resizeWidth, resizeHeight) == (WIDTH, HEIGHT)
        return [[FX, 0.0, 320.0], [0.0, FX, 240.0], [0.0, 0.0, 1.0]]

    def getDistortionCoefficients(self, cameraId: str) -> list[float]:
        return [0.1, -0.2, 0.001, 0.002, 0.05, *(9 * [0.0])]

    def close(self) -> None:
        Device.lit = False


def module() -> ModuleType:
    """Return it as the module that is imported."""
    found = ModuleType("depthai")
    for each in (Device, Pipeline, CameraExposureOffset, CameraSensorType):
        setattr(found, each.__name__, each)
    ToFConfig = SimpleNamespace(Profile=SimpleNamespace(MID_RANGE="MID_RANGE"))
    vars(found).update(__version__="3.12.0", node=SimpleNamespace(ToF=ToF), ToFConfig=ToFConfig)
    return found
