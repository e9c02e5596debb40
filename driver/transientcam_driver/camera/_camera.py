"""What a camera is to the programs that use it, whichever device and driver is behind it."""

from enum import StrEnum
from typing import Protocol, Self

from transientcam_driver.camera._capabilities import AppliedSequence, Capabilities
from transientcam_driver.camera._factory import FactoryCalibration
from transientcam_driver.camera._frame import Counters, RawFrame
from transientcam_driver.camera._simulation import Simulation
from transientcam_driver.camera._status import Status
from transientcam_driver.sequence import Sequence
from transientcam_supervisor import OffSwitch


class CameraState(StrEnum):
    """Where a camera stands."""

    DISCONNECTED = "disconnected"
    CONNECTING = "connecting"
    IDLE = "idle"
    STREAMING = "streaming"
    FAULTED = "faulted"


class Camera(Protocol):
    """An AMCW lidar, owned by this process: configure it, start it, take its frames.

    Methods may be called from any thread, ``read_frame`` from one at a time. The light is on only
    while frames are read; it goes off with ``stop``, ``safe_off`` and ``close``, and after every
    failure. `transientcam_driver.contract` holds an implementation to all of this.
    """

    @property
    def counters(self) -> Counters:
        """Images and frames received, and what was lost."""
        ...

    @property
    def simulation(self) -> Simulation | None:
        """The handle of a simulated camera, None of any other."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """Limits and size of the device."""
        ...

    @property
    def factory(self) -> FactoryCalibration | None:
        """What the device reports of its pixels and its lens; None where it reports nothing."""
        ...

    @property
    def off_switch(self) -> OffSwitch | None:
        """How another process switches the light off; None where no light is at this machine.

        It may be another one after `reconnect`.
        """
        ...

    @property
    def state(self) -> CameraState:
        """Where the camera stands."""
        ...

    @property
    def applied(self) -> AppliedSequence:
        """The sequence as the camera really runs it."""
        ...

    def validate(self, sequence: Sequence) -> AppliedSequence:
        """Return what `configure` would set; the epoch is 0.

        Raises
        ------
        SequenceError
            Naming the field, its value and the limit of this camera.
        """
        ...

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Set a sequence; while streaming, the next frame is the new sequence's.

        Each configuration has a greater epoch than those before, also after a reconnect.

        Raises
        ------
        SequenceError
            The sequence is not possible; nothing was changed.
        CameraLost
            The camera is gone.
        """
        ...

    def start(self) -> None:
        """Switch the light on and capture frames back to back."""

    def stop(self) -> None:
        """Switch the light off; a ``read_frame`` that is waiting raises NotStreaming."""

    def safe_off(self) -> None:
        """Switch the light off, in any state."""

    def status(self) -> Status:
        """Read the status of the device.

        Raises
        ------
        CameraLost
            It does not answer.
        """
        ...

    def device_time_s(self) -> float:
        """Time on the clock that frames carry."""
        ...

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Wait for the next complete frame.

        Raises
        ------
        FrameTimeout
            None was complete in time; the camera goes on capturing.
        NotStreaming
            The camera was not started, or was stopped meanwhile.
        CameraLost
            It was unplugged or does not answer; see ``reconnect``.
        CameraError
            Another failure: the light is off.
        """
        ...

    def reconnect(self) -> None:
        """After CameraLost: find the same device again, restore the sequence, resume streaming.

        Does nothing unless the camera is disconnected.

        Raises
        ------
        CameraError
            It is still absent, or cannot be opened; try again later.
        """

    def close(self) -> None:
        """Switch the light off and give the device back; may be called twice."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...


def has_light(camera: Camera) -> bool:
    """Whether there is a real light at this machine."""
    return camera.simulation is None and camera.off_switch is not None


def light_warning(camera: Camera) -> str | None:
    """Return what is to be known of a light that the camera does not switch off by itself.

    None where it does, and where there is no light at this machine.
    """
    switch = camera.off_switch
    if switch is None or not has_light(camera):
        return None
    if camera.capabilities.heartbeat_s or switch.ends_s:
        return None
    if switch.steps:
        return (
            "The camera has no watchdog. A supervisor switches its light off when this service "
            "dies or hangs; when this machine does, the light stays on until the camera has no "
            "power."
        )
    return (
        "The camera has no watchdog, and no other process can switch its light off: when this "
        "service dies or hangs, the light stays on until the camera has no power."
    )
