"""What is in front of the simulated camera: surfaces, light, motions, and the files of scenes."""

from transientcam_driver.simulation.scene.file import (
    BUILT_IN,
    SceneInfo,
    list_scenes,
    load_scene,
    parse_scene,
)
from transientcam_driver.simulation.scene.scene import Background, Scene, TimeZero

__all__ = [
    "BUILT_IN",
    "Background",
    "Scene",
    "SceneInfo",
    "TimeZero",
    "list_scenes",
    "load_scene",
    "parse_scene",
]
