"""What the service serves: a camera on USB, a simulated one, or a recording."""

import logging
from typing import Protocol, Self

import transientcam_driver
import transientcam_moments as tm
from transientcam_driver import (
    AppliedSequence,
    Capabilities,
    Counters,
    RawFrame,
    Sequence,
    Simulation,
    Status,
)
from transientcam_server.recording.replay import PREFIX, ReplayCamera, parse_replay
from transientcam_server.settings import SensorSettings, SequenceSettings

_log = logging.getLogger(__name__)


class Camera(Protocol):
    """What the service requires of a camera; `transientcam_driver.Camera` documents the methods."""

    counters: Counters

    @property
    def simulation(self) -> Simulation | None:
        """The handle of a simulated camera, None of any other."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """Limits and size of the device."""
        ...

    @property
    def applied(self) -> AppliedSequence:
        """The sequence as the camera really runs it."""
        ...

    def validate(self, sequence: Sequence) -> AppliedSequence:
        """Return what `configure` would set."""
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
        """Stop and switch the light off, in any state."""
        ...

    def status(self) -> Status:
        """Read the status of the device."""
        ...

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Wait for the next frame."""
        ...

    def reconnect(self) -> None:
        """Open a lost camera again."""
        ...

    def close(self) -> None:
        """Release the camera."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...


def sensor_of(camera: Camera, settings: SensorSettings) -> tm.noise.Sensor:
    """Return the sensor of a camera: a simulated one has its own, a real one the settings'."""
    model = settings if camera.simulation is None else camera.simulation.sensor
    return tm.noise.Sensor(
        gain_e_per_dn=model.gain_e_per_dn,
        full_well_e=model.full_well_e,
        read_noise_e=model.read_noise_e,
        dark_dn=model.dark_dn,
        bits=camera.capabilities.bits,
    )


def start_with(camera: Camera, settings: SequenceSettings) -> None:
    """Set what the camera captures from the start, or what is nearest of that it can do.

    A recording that is replayed stays as it was captured.
    """
    if isinstance(camera, ReplayCamera):
        return
    wanted = Sequence(**settings.model_dump())
    nearest = camera.capabilities.nearest(wanted)
    if nearest != wanted:
        _log.warning("the camera cannot do %s; it starts with %s", wanted, nearest)
    camera.configure(nearest)


def open_camera(spec: str) -> Camera:
    """Open a camera by name, also ``recording:PATH[?speed=original|fast|2.0&loop=on]``.

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
