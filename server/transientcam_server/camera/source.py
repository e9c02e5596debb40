"""What the service serves: a camera on USB, a simulated one, or a recording."""

from types import TracebackType
from typing import Protocol, Self

import transientcam_driver
from transientcam_driver import (
    AppliedSequence,
    Capabilities,
    Counters,
    RawFrame,
    Sequence,
    Simulation,
    Status,
)
from transientcam_server.imaging.noise import NoiseModel
from transientcam_server.recording.replay import PREFIX, ReplayCamera, parse_replay
from transientcam_server.settings import SensorSettings


class Camera(Protocol):
    """What the service needs of a camera; `transientcam_driver.Camera` has it and says more."""

    simulation: Simulation | None
    counters: Counters

    @property
    def capabilities(self) -> Capabilities:
        """What it can do."""
        ...

    @property
    def applied(self) -> AppliedSequence:
        """What is really set."""
        ...

    def validate(self, sequence: Sequence) -> AppliedSequence:
        """Say what would be set."""
        ...

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Set a sequence."""
        ...

    def start(self) -> None:
        """Capture frames back to back."""
        ...

    def stop(self) -> None:
        """Capture nothing more."""
        ...

    def safe_off(self) -> None:
        """Switch the light off, whatever else."""
        ...

    def status(self) -> Status:
        """Ask the device how it is."""
        ...

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Wait for the next frame."""
        ...

    def reconnect(self) -> None:
        """Find a lost camera again."""
        ...

    def close(self) -> None:
        """Give it back."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...


def noise_of(camera: Camera, sensor: SensorSettings) -> NoiseModel:
    """Return the noise of a camera: a simulated one has its sensor, a real one the settings'."""
    model = sensor if camera.simulation is None else camera.simulation.sensor
    return NoiseModel(model, bits=camera.capabilities.bits)


def open_camera(spec: str) -> Camera:
    """Open what ``--camera`` names: also ``recording:PATH[?speed=original|fast|2.0&loop=on]``.

    Raises
    ------
    SpecError, SceneError, CameraError
        As `transientcam_driver.open_camera`.
    NotARecording, OSError
        If the file cannot be replayed.
    """
    if not spec.startswith(PREFIX):
        return transientcam_driver.open_camera(spec)
    replay = parse_replay(spec)
    return ReplayCamera(replay.path, speed=replay.speed, loop=replay.loop)
