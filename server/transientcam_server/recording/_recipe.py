"""How recorded frames are computed: with the gains and the sensor of the recording."""

import contextlib
from typing import Final

from pydantic import TypeAdapter

import transientcam_moments as tm
from transientcam_server.imaging import Recipe, SettingsVersion, known_intrinsics
from transientcam_server.recording._layout import Header
from transientcam_server.settings import LensSettings

_SENSOR: Final = TypeAdapter(tm.noise.Sensor)


def recorded_sensor(header: Header) -> tm.noise.Sensor | None:
    """Return the sensor whose noise a recording's images have; None where it says none."""
    with contextlib.suppress(ValueError):
        return _SENSOR.validate_python(header.camera.get("sensor"))
    return None


def recorded_recipe(
    header: Header, reconstruction: SettingsVersion, *, lens: LensSettings | None = None
) -> Recipe:
    """Return the recipe that reconstructs a recording's frames."""
    capabilities = header.capabilities
    return Recipe(
        header.applied,
        reconstruction.settings,
        2.0**capabilities.bits - 1.0,
        header.gains,
        reconstruction.id,
        known_intrinsics(
            lens or LensSettings(),
            width=capabilities.width,
            height=capabilities.height,
            recorded=header.camera.get("intrinsics"),
        ),
        recorded_sensor(header),
    )
