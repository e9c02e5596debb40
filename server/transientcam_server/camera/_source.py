"""The camera that the service serves: its sensor, and what it starts with."""

import contextlib
import logging
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import transientcam_moments as tm
from transientcam_driver import (
    CalibrationError,
    Camera,
    CameraError,
    CameraName,
    Sensor,
    Sequence,
    open_camera,
)
from transientcam_driver.calibration import DEVICE_FIELDS
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera._absent import NO_CAMERA, AbsentCamera
from transientcam_server.camera._calibration_store import CalibrationStore, load_given
from transientcam_server.errors import Problem
from transientcam_server.imaging import NOMINAL_ID, Calibration, load_calibration
from transientcam_server.recording import ReplayCamera
from transientcam_server.relay import RelayCamera
from transientcam_server.settings import SensorSettings, SequenceSettings, Settings

_log = logging.getLogger("transientcam_server.camera.source")
DELAY_S: Final = 3.0
UNUSED_S: Final = 300.0
"""Of a camera that shines at somebody."""


def stated_sensor(camera: Camera, settings: SensorSettings) -> tm.noise.Sensor | None:
    """Return the sensor of a camera; None where neither it nor the settings state any of it."""
    if isinstance(camera, RelayCamera):
        return camera.origin.sensor
    stated = camera.simulation is not None or settings.model_fields_set or _own_sensor(camera)
    return sensor_of(camera, settings) if stated else None


def sensor_of(camera: Camera, settings: SensorSettings) -> tm.noise.Sensor:
    """Return the sensor of a camera: a simulated one has its own, a real one the settings'.

    Where these state none it is the one that the camera reports. A relayed one has what its origin
    states. The dark level is the camera's where it has one.
    """
    if isinstance(camera, RelayCamera) and camera.origin.sensor is not None:
        return camera.origin.sensor
    model = _own_sensor(camera) or settings
    if camera.simulation is None and settings.model_fields_set:
        model = settings
    dark_dn = camera.capabilities.dark_dn
    return tm.noise.Sensor(
        gain_e_per_dn=model.gain_e_per_dn,
        full_well_e=model.full_well_e,
        read_noise_e=model.read_noise_e,
        dark_dn=model.dark_dn if dark_dn is None else dark_dn,
        bits=camera.capabilities.bits,
    )


def _own_sensor(camera: Camera) -> Sensor | None:
    if camera.simulation is not None:
        return camera.simulation.sensor
    return None if camera.factory is None else camera.factory.sensor


@dataclass(frozen=True, slots=True)
class LightRules:
    """When a camera's light may begin, and when its capture ends by itself.

    A camera shines at somebody unless it is simulated or replayed. The emulation of a real device
    captures from the start, since its scene is simulated; else it counts as the device: it is
    there to try what happens with that. ``unit`` is what it is kept by that the light is off: the
    device, what is simulated, None of a recording.
    """

    unit: str | None
    capture_at_start: bool
    delay_s: float
    unused_s: float
    unserved_s: float

    @classmethod
    def of(cls, camera: Camera, settings: Settings) -> Self:
        """Return those of the settings, else those that suit the camera."""
        name, about, light = CameraName.parse(settings.camera), camera.capabilities, settings.light
        shines = name.kind not in ("sim", "recording", NO_CAMERA)
        capture, delay_s, unused_s = settings.capture_at_start, light.delay_s, light.unused_s
        unused_s = unused_s if unused_s is not None else UNUSED_S if shines else 0.0
        simulated = None if name.kind in ("recording", NO_CAMERA) else settings.camera
        simulates = camera.simulation is not None
        return cls(
            unit=f"{about.model} {about.serial}" if shines else simulated,
            capture_at_start=not shines or simulates if capture is None else capture,
            delay_s=delay_s if delay_s is not None else DELAY_S if shines else 0.0,
            unused_s=unused_s or math.inf,
            unserved_s=settings.limits.unserved_s if shines else math.inf,
        )


def start_with(camera: Camera, settings: SequenceSettings) -> None:
    """Set what the camera captures from the start, or what is nearest of that it can do.

    A recording that is replayed stays as it was captured, a relayed camera as its origin has it.
    """
    if isinstance(camera, AbsentCamera | ReplayCamera | RelayCamera):
        return
    wanted = Sequence(**settings.model_dump())
    nearest = camera.capabilities.nearest(wanted)
    if nearest != wanted:
        asked = wanted.to_document()
        does = nearest.to_document()
        words = ", ".join(f"{name} {does[name]}" for name in asked if does[name] != asked[name])
        level = logging.WARNING if settings.model_fields_set else logging.INFO
        _log.log(
            level, "the camera cannot do all of the sequence that was set; it starts with %s", words
        )
    camera.configure(nearest)


@dataclass(frozen=True, slots=True)
class SimulationSnapshot:
    """What another simulated camera is opened by, before the same scene, as old as the first.

    ``spec``: what the first one was opened with.
    ``age_s``: device time of the first one.
    ``scene``, ``definition``, ``effects``, ``diffuser``: what it simulates at present.
    """

    spec: str
    age_s: float
    scene: str
    definition: str | None
    effects: dict[str, str]
    diffuser: bool

    def open(self) -> Camera:
        """Open it, in virtual time.

        Raises SpecError, SceneError, CameraError as `transientcam_driver.open_camera`.
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


def calibration_of(camera: Camera, path: Path | None, kept: CalibrationStore) -> Calibration | None:
    """Load the calibration at a path, or that of the origin, or that which was active last.

    Raises CalibrationError where the one that is given is of another camera.
    """
    if path is not None and isinstance(camera, RelayCamera) and not camera.has_images:
        raise CalibrationError(
            f"moments are calibrated at {camera.url}: leave out the setting calibration, or relay "
            "product=raw"
        )
    if path is None and isinstance(camera, RelayCamera):
        if camera.origin.calibration is not None:
            kept.keep(camera.origin.calibration.capture)
        return camera.origin.calibration
    if path is None:
        return _last_active(camera, kept)
    loaded = load_given(path)
    misfit = loaded.capture.misfit(camera.applied, camera.capabilities)
    if misfit is not None and misfit.field in DEVICE_FIELDS:
        raise misfit
    if misfit is not None:
        _log.warning("%s; using nominal gains", misfit)
    return loaded


def _last_active(camera: Camera, kept: CalibrationStore) -> Calibration | None:
    """Load what was active last, if it is still there and of this camera."""
    active_id = kept.active_id
    if active_id == NOMINAL_ID:
        return None
    try:
        stored = kept.get(active_id)
        misfit = stored.subject.misfit(camera.applied, camera.capabilities)
        if misfit is not None and misfit.field in DEVICE_FIELDS:
            raise misfit
        return load_calibration(stored.path)
    except (Problem, CalibrationError) as error:
        _log.warning("%s was active last, but cannot be used: %s", active_id, error)
        return None
