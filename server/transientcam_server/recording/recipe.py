"""How recorded frames are computed: with the gains that were recorded beside them."""

from transientcam_server.imaging.lens import known_intrinsics
from transientcam_server.imaging.recipe import Recipe, SettingsVersion
from transientcam_server.recording.layout import Header
from transientcam_server.settings import LensSettings


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
    )
