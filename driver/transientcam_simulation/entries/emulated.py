"""What the names of emulated cameras share: ``NAME:emulated?scene=...``."""

from typing import Final

from transientcam_driver.camera import CameraName
from transientcam_driver.errors import SpecError
from transientcam_simulation.entries.sim import SCENE_OPTIONS, SimulatedScene

EMULATED: Final = "emulated"
DEFAULT_SCENE: Final = "hall"
OF_EMULATION: Final = {"scene": f"of the emulation, {DEFAULT_SCENE} without it", **SCENE_OPTIONS}


def simulated_scene(name: CameraName, default: str = DEFAULT_SCENE) -> SimulatedScene:
    """Return the scene in front of an emulated camera, ``default`` where its name has none.

    Raises SpecError naming the part that is not valid.
    """
    return SimulatedScene.of(name, name.options.get("scene", default))


def require_no_emulation(name: CameraName) -> None:
    """Refuse what only an emulated camera has. Raises SpecError naming the option."""
    for option in name.options:
        if option in OF_EMULATION:
            raise SpecError(name.spec, f"{option} belongs to {name.kind}:{EMULATED}")
