"""The camera that the service serves: its sensor, and what it starts with."""

import contextlib
import logging

import transientcam_moments as tm
from transientcam_driver import Camera, CameraError, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.recording.replay import ReplayCamera
from transientcam_server.settings import SensorSettings, SequenceSettings

_log = logging.getLogger(__name__)


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


def twin_of(camera: Camera, spec: str) -> Camera:
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
    twin = open_camera(spec, clock=clock)
    with contextlib.suppress(CameraError):  # an unplugged one is as new as the twin
        clock.sleep(camera.status().device_time_s)
    there = twin.simulation
    assert there is not None  # noqa: S101 - of the same spec
    same = (there.scene, there.effects, there.diffusor) == (own.scene, own.effects, own.diffusor)
    if not same:
        there.change(scene=own.scene, effects=own.effects, diffusor=own.diffusor)
    return twin
