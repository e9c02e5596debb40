"""Scenes to measure the simulation by: the built-in ones, and harder ones that are not."""

from pathlib import Path

from transientcam_simulation import list_scenes
from transientcam_simulation.emulated import find_scene
from transientcam_simulation.scene import Scene

HERE = Path(__file__).parent / "scenes"
BUILT_IN = tuple(info.name for info in list_scenes() if info.name != "measured")


def scene_named(name: str) -> Scene:
    """Return a built-in scene, or one of this folder, or of a file."""
    file = HERE / f"{name}.toml"
    return find_scene(str(file) if file.exists() else name)


def unseen() -> tuple[str, ...]:
    """Names of the scenes of this folder."""
    return tuple(sorted(file.stem for file in HERE.glob("*.toml")))
