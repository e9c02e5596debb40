"""The camera that the service serves: its sensor, and what it starts with."""

import logging

import transientcam_moments as tm
from transientcam_driver import Camera, Sequence
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
