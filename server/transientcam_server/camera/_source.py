"""The camera that the service serves: its sensor, and what it starts with."""

import contextlib
import logging
from dataclasses import dataclass

import transientcam_moments as tm
from transientcam_driver import Camera, CameraError, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.recording import ReplayCamera
from transientcam_server.relay import RelayCamera
from transientcam_server.settings import SensorSettings, SequenceSettings

_log = logging.getLogger("transientcam_server.camera.source")


def sensor_of(camera: Camera, settings: SensorSettings) -> tm.noise.Sensor:
    """Return the sensor of a camera: a simulated one has its own, a real one the settings'.

    A relayed one has what its origin states. The dark level is the camera's where it has one.
    """
    if isinstance(camera, RelayCamera):
        return camera.origin.sensor
    model = settings if camera.simulation is None else camera.simulation.sensor
    dark_dn = camera.capabilities.dark_dn
    return tm.noise.Sensor(
        gain_e_per_dn=model.gain_e_per_dn,
        full_well_e=model.full_well_e,
        read_noise_e=model.read_noise_e,
        dark_dn=model.dark_dn if dark_dn is None else dark_dn,
        bits=camera.capabilities.bits,
    )


def start_with(camera: Camera, settings: SequenceSettings) -> None:
    """Set what the camera captures from the start, or what is nearest of that it can do.

    A recording that is replayed stays as it was captured, a relayed camera as its origin has it.
    """
    if isinstance(camera, ReplayCamera | RelayCamera):
        return
    wanted = Sequence(**settings.model_dump())
    nearest = camera.capabilities.nearest(wanted)
    if nearest != wanted:
        _log.warning("the camera cannot do %s; it starts with %s", wanted, nearest)
    camera.configure(nearest)


@dataclass(frozen=True, slots=True)
class SimulationSnapshot:
    """What another simulated camera is opened by, before the same scene, as old as the first.

    Attributes
    ----------
    spec
        What the first one was opened with.
    age_s
        Device time of the first one.
    scene, definition, effects, diffuser
        What it simulates at present.
    """

    spec: str
    age_s: float
    scene: str
    definition: str | None
    effects: dict[str, str]
    diffuser: bool

    def open(self) -> Camera:
        """Open it, in virtual time.

        Raises
        ------
        SpecError, SceneError, CameraError
            As `transientcam_driver.open_camera`.
        """
        clock = VirtualClock()
        camera = open_camera(self.spec, clock=clock)
        clock.sleep(self.age_s)
        there = camera.simulation
        assert there is not None  # noqa: S101 - of the same spec
        if (there.scene, there.definition, there.effects, there.diffuser) != (
            self.scene,
            self.definition,
            self.effects,
            self.diffuser,
        ):
            there.change(
                scene=self.scene,
                definition=self.definition,
                effects=self.effects,
                diffuser=self.diffuser,
            )
        return camera


def snapshot_of(camera: Camera, spec: str) -> SimulationSnapshot:
    """Return the twin of a simulated camera, which was opened with ``spec``."""
    own = camera.simulation
    assert own is not None  # noqa: S101 - callers look
    age_s = 0.0
    with contextlib.suppress(CameraError):  # an unplugged one is as new as the twin
        age_s = camera.status().device_time_s
    return SimulationSnapshot(spec, age_s, own.scene, own.definition, own.effects, own.diffuser)
