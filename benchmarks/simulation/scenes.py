"""Scenes to measure the simulation by: the built-in ones, and harder ones that are not."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from transientcam_driver import Sequence
from transientcam_simulation import list_scenes
from transientcam_simulation.emulated import find_scene, world_of
from transientcam_simulation.imaging import World
from transientcam_simulation.scene import Scene

SIZE: Final = 163, 120
READOUT_S: Final = 3.98e-3
START_S: Final = 9.0  # a visitor is there
HERE = Path(__file__).parent / "scenes"
BUILT_IN = tuple(info.name for info in list_scenes() if info.name != "measured")


def scene_named(name: str) -> Scene:
    """Return a built-in scene, or one of this folder, or of a file."""
    file = HERE / f"{name}.toml"
    return find_scene(str(file) if file.exists() else name)


def unseen() -> tuple[str, ...]:
    """Names of the scenes of this folder."""
    return tuple(sorted(file.stem for file in HERE.glob("*.toml")))


def world_before(
    scene: Scene, effects: Mapping[str, str], sequence: Sequence, size: tuple[int, int] = SIZE
) -> World:
    """Return what a camera at a sequence has before it, with other choices of some effects."""
    width, height = size
    changed = replace(scene, effects={**scene.effects, **effects})
    world = world_of(changed, width=width, height=height, readout_s=READOUT_S)
    world.configure(sequence, sequence.labels)
    return world
