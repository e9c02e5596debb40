"""What cameras share whose state, clock and sequence are kept on this machine."""

import threading
from abc import ABC, abstractmethod
from typing import Self

from transientcam_driver.camera._camera import CameraState
from transientcam_driver.camera._capabilities import AppliedSequence, Capabilities
from transientcam_driver.camera._factory import FactoryCalibration
from transientcam_driver.camera._frame import Counters
from transientcam_driver.camera._simulation import Simulation
from transientcam_driver.camera._status import Status
from transientcam_driver.clock import Clock
from transientcam_driver.errors import CameraClosed, CameraLost
from transientcam_driver.sequence import Sequence
from transientcam_supervisor import OffSwitch


class HostCamera(ABC):
    """The half of a `Camera` that needs no request to the device.

    A camera of it sets ``_capabilities`` and ``_applied``, and moves ``_state`` on from
    "connecting".

    ``clock``: of the times that frames carry; its zero is when the camera was opened.
    ``simulation``: the handle on a simulated camera; None for a real one.
    """

    factory: FactoryCalibration | None = None
    _capabilities: Capabilities
    _applied: AppliedSequence

    def __init__(self, clock: Clock, simulation: Simulation | None) -> None:
        self.simulation = simulation
        self.counters = Counters()
        self._clock = clock
        self._since_s = clock.now_s()
        self._control = threading.RLock()  # requests, the state and what is captured
        self._reading = threading.Lock()  # held by the reader
        self._state = CameraState.CONNECTING
        self._closed = False
        self._resume = False
        self._loss = "it is disconnected"  # why, where that is known

    @property
    def capabilities(self) -> Capabilities:
        """What the camera can do."""
        return self._capabilities

    @property
    def off_switch(self) -> OffSwitch | None:
        """How another process switches the light off: none can, unless a camera says how."""
        return OffSwitch()

    @property
    def state(self) -> CameraState:
        """Where the camera stands."""
        return self._state

    @property
    def applied(self) -> AppliedSequence:
        """What is really set."""
        return self._applied

    def device_time_s(self) -> float:
        """Time since the camera was opened, by this machine's clock."""
        return self._clock.now_s() - self._since_s

    def validate(self, sequence: Sequence) -> AppliedSequence:
        """Return what would be set, without a request to the device; the epoch is 0."""
        return self._capabilities.apply(sequence)

    def _status(self, *, light_on: bool, temperature_c: float | None) -> Status:
        return Status.of_host(
            streaming=self._state is CameraState.STREAMING,
            light_on=light_on,
            epoch=self._applied.epoch,
            next_image=self.counters.images + self.counters.lost,
            device_time_s=self.device_time_s(),
            temperature_c=temperature_c,
        )

    @abstractmethod
    def stop(self) -> None:
        """Switch the light off; a ``read_frame`` that is waiting raises NotStreaming."""

    def safe_off(self) -> None:
        """As ``stop``."""
        self.stop()

    @abstractmethod
    def close(self) -> None:
        """Switch the light off and give the device back; may be called twice."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _require_open(self) -> None:
        if self._closed:
            raise CameraClosed

    def _require_connected(self) -> None:
        self._require_open()
        if self._state is CameraState.DISCONNECTED:
            raise CameraLost(self._loss)
