"""What the service serves: a camera on USB, a simulated one, or a recording."""

import contextlib
import logging
from typing import Protocol, Self

import transientcam_driver
import transientcam_moments as tm
from transientcam_driver import (
    AppliedSequence,
    CameraError,
    Capabilities,
    Counters,
    RawFrame,
    Sequence,
    Simulation,
    Status,
)
from transientcam_driver.clock import VirtualClock
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


def twin_of(camera: Camera, spec: str) -> transientcam_driver.Camera:
    """Open another simulated camera before the same scene, as old as the first, in virtual time.

    Parameters
    ----------
    camera
        A simulated one.
    spec
        What it was opened with.

    Raises
    ------
    SpecError, SceneError, CameraError
        As `transientcam_driver.open_camera`.
    """
    own = camera.simulation
    assert own is not None  # noqa: S101 - callers look
    clock = VirtualClock()
    twin = transientcam_driver.open_camera(spec, clock=clock)
    with contextlib.suppress(CameraError):  # an unplugged one is as new as the twin
        clock.sleep(camera.status().device_time_s)
    there = twin.simulation
    assert there is not None  # noqa: S101 - of the same spec
    same = (there.scene, there.effects, there.diffusor) == (own.scene, own.effects, own.diffusor)
    if not same:
        there.change(scene=own.scene, effects=own.effects, diffusor=own.diffusor)
    return twin


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
