"""A device without hardware, for a `TriggeredCamera`: what it does is what a test says."""

from dataclasses import dataclass, field, replace

import numpy as np

from transientcam_driver import (
    AppliedSequence,
    CameraLost,
    CameraNotFound,
    Capabilities,
    ImageLabel,
    ImagesLost,
    TriggeredCamera,
)
from transientcam_driver.camera import Simulation
from transientcam_driver.clock import VirtualClock
from transientcam_supervisor import OffSwitch

SETTLES_S = 0.1
EXPOSED_S = 0.01
CAPABILITIES = Capabilities(
    model="scripted",
    serial="S-1",
    firmware="1.0",
    protocol_version=1,
    width=4,
    height=3,
    bits=12,
    readout_s=1e-3,
    streaming_readout_s=1e-3,
    settle_s=SETTLES_S,
    tuning_step_hz=1.0,
    min_frequency_hz=1e6,
    max_frequency_hz=100e6,
    low_frequency_hz=0.25e6,
    max_harmonics=8,
    min_exposure_s=10e-6,
    max_exposure_s=2e-3,
    exposure_step_s=1e-6,
    zeroths=("estimated", "low-frequency"),
)


@dataclass
class Cable:
    """What lies between host and device; it stays when the device is opened again."""

    clock: VirtualClock = field(default_factory=VirtualClock)
    serial: str = "S-1"
    plugged: bool = True
    groups_to_lose: int = 0
    delayed: int = 0
    """So often nothing has arrived yet."""
    lit: bool = False
    asked: list[tuple[int, float]] = field(default_factory=list)
    """Harmonic and time of each exposure."""

    def camera(self, simulation: Simulation | None = None) -> TriggeredCamera:
        return TriggeredCamera(
            lambda: ScriptedDevice(self), clock=self.clock, simulation=simulation
        )


class ScriptedDevice:
    """Images hold the index of their label."""

    def __init__(self, cable: Cable) -> None:
        if not cable.plugged:
            raise CameraNotFound(cable.serial)
        self.cable = cable
        self.frequency_hz = 0.0
        self.labels: tuple[ImageLabel, ...] = ()

    off_switch = OffSwitch()

    @property
    def capabilities(self) -> Capabilities:
        return CAPABILITIES if self.cable.serial == "S-1" else _other(self.cable.serial)

    def configure(self, applied: AppliedSequence) -> None:
        self._answer()

    def prepare(self, labels: tuple[ImageLabel, ...]) -> float:
        self._answer()
        changed = labels[0].frequency_hz != self.frequency_hz
        self.frequency_hz = labels[0].frequency_hz
        return SETTLES_S if changed else 0.0

    def trigger(self, labels: tuple[ImageLabel, ...]) -> None:
        self._answer()
        self.labels = labels
        self.cable.lit = True
        self.cable.asked.append((labels[0].harmonic, self.cable.clock.now_s()))

    def receive(self, timeout_s: float) -> np.ndarray | None:
        self._answer()
        if self.cable.delayed:
            self.cable.delayed -= 1
            return None
        self.cable.lit = False
        self.cable.clock.sleep(EXPOSED_S)
        if self.cable.groups_to_lose:
            self.cable.groups_to_lose -= 1
            raise ImagesLost("as the test wants it")
        index = np.array([label.index for label in self.labels], np.uint16)
        return np.broadcast_to(index[:, None, None], (len(index), 3, 4))

    def temperature_c(self) -> float:
        self._answer()
        return 40.0

    def light_off(self) -> None:
        self._answer()
        self.cable.lit = False

    def close(self) -> None:
        self.cable.lit = False

    def _answer(self) -> None:
        if not self.cable.plugged:
            self.cable.lit = False
            raise CameraLost("the cable is out")


def _other(serial: str) -> Capabilities:
    return replace(CAPABILITIES, serial=serial)
