"""What all parts of the measurement share: scenes, and frames of them."""

import transientcam_moments as tm
from transientcam_driver import Camera, Sequence, list_scenes
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Recipe
from transientcam_server.settings import ReconstructionSettings, SensorSettings

SEED = 1
SETTINGS = ReconstructionSettings()


def known_scenes() -> set[str]:
    """Return the names of the built-in scenes."""
    return {scene.name for scene in list_scenes()}


def captured(
    camera: Camera, sequence: Sequence, frames: int, settings: ReconstructionSettings = SETTINGS
) -> tuple[Recipe, list[tm.Reconstruction]]:
    """Capture and reconstruct frames with a sequence."""
    applied = camera.configure(sequence)
    sensor = sensor_of(camera, SensorSettings())
    recipe = Recipe(applied, settings, 2.0**camera.capabilities.bits - 1.0, sensor=sensor)
    camera.start()
    found = [recipe.reconstruct(camera.read_frame()) for _ in range(frames)]
    camera.stop()
    return recipe, found


def short(sequence: Sequence) -> str:
    """Name a sequence in a few characters."""
    takes = f", {sequence.takes} takes" if sequence.takes > 1 else ""
    frequency = (
        "" if sequence.base_frequency_hz == 23e6 else f", {sequence.base_frequency_hz / 1e6:g} MHz"
    )
    return (
        f"m = {sequence.harmonics}{frequency}, {sequence.exposure_s * 1e3:.3g} ms{takes}, "
        f"{sequence.zeroth}"
    )
