"""The plug-in ``sim``: an emulated USB device in front of a scene, behind the real driver."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, get_args

from transientcam_driver.camera import Camera, CameraName, CameraPlugin, FoundCamera
from transientcam_driver.cameras.open_usb import UsbCamera, open_transport
from transientcam_driver.clock import Clock
from transientcam_driver.errors import SpecError
from transientcam_simulation import build, find_scene, measured_scene, without_noise
from transientcam_simulation.base import PROFILES
from transientcam_simulation.effects import CHOICES, EFFECTS
from transientcam_simulation.emulated import (
    DEFAULT_HEIGHT,
    DEFAULT_WIDTH,
    MEASURED,
    RESOLUTIONS,
    SimulatedBus,
)
from transientcam_simulation.scene import Background, Scene, TimeZero, list_scenes

_OF_FILE: Final = f"{MEASURED}:"
_OPTIONS_OF_FILE: Final = ("background", "time_zero")
_EFFECTS: Final = tuple(effect.name for effect in EFFECTS if effect.optional)
SCENE_OPTIONS: Final = {
    "noise": "off: an ideal converter of 16 bits",
    "seed": "of all randomness",
    "device": "prototype or ideal, in place of the scene's",
    "background": "median: subtract it from a measured file",
    "time_zero": "peak: a measured file begins at its peak",
    **dict.fromkeys(_EFFECTS, "on, off or auto"),
}
"""Options of a simulated scene, whichever camera stands in front of it."""


@dataclass(frozen=True, slots=True)
class SimulatedScene:
    """What a name says of a simulated scene."""

    scene: str
    noise: bool = True
    seed: int | None = None
    device: str | None = None
    effects: dict[str, str] = field(default_factory=dict)
    background: Background = "none"
    time_zero: TimeZero = "start"

    @classmethod
    def of(cls, name: CameraName, scene: str) -> "SimulatedScene":
        """Read the options of a name. Raises SpecError naming the part that is not valid."""
        options = name.options
        if not scene.startswith(_OF_FILE) and not options.keys().isdisjoint(_OPTIONS_OF_FILE):
            reason = f"{', '.join(_OPTIONS_OF_FILE)} belong to sim:measured:PATH.npz"
            raise SpecError(name.spec, reason)
        background: Any = name.choice("background", get_args(Background))
        time_zero: Any = name.choice("time_zero", get_args(TimeZero))
        return cls(
            scene=scene,
            noise=name.choice("noise", ("on", "off")) == "on",
            seed=name.integer("seed", 0) if "seed" in options else None,
            device=name.choice("device", PROFILES) if "device" in options else None,
            effects={each: name.choice(each, CHOICES) for each in _EFFECTS if each in options},
            background=background,
            time_zero=time_zero,
        )

    def load(self) -> Scene:
        """Load the scene, with the changes that the name has.

        Raises SceneError where the scene is not valid.
        """
        scene = self._found()
        if self.device is not None:
            scene = replace(scene, device=PROFILES[self.device])
        if not self.noise:
            scene = without_noise(scene)
        return replace(scene, effects=scene.effects | self.effects)

    def _found(self) -> Scene:
        if not self.scene.startswith(_OF_FILE):
            return find_scene(self.scene)
        path = Path(self.scene.removeprefix(_OF_FILE))
        return measured_scene(path, background=self.background, time_zero=self.time_zero)


def scene_of(name: CameraName) -> SimulatedScene:
    """Return the scene that a name of this plug-in is for.

    Raises SpecError naming the part that is not valid.
    """
    PLUGIN.require_options(name)
    if not name.address:
        raise SpecError(name.spec, "it names no scene (`transientcam scenes` lists them)")
    return SimulatedScene.of(name, name.address)


def resolution(name: CameraName) -> tuple[int, int]:
    """Return the width and height of the sensor that a name is for.

    Raises SpecError naming the part that is not valid.
    """
    if "width" not in name.options and "height" not in name.options:
        return DEFAULT_WIDTH, DEFAULT_HEIGHT
    if "width" not in name.options or "height" not in name.options:
        raise SpecError(name.spec, "width and height come together")
    width, height = name.integer("width", 0), name.integer("height", 0)
    if (width, height) not in RESOLUTIONS:
        known = ", ".join(f"{width} x {height}" for width, height in RESOLUTIONS)
        raise SpecError(name.spec, f"resolution {width} x {height}: known are {known}")
    return width, height


def _open(name: CameraName, clock: Clock) -> Camera:
    wanted = scene_of(name)
    width, height = resolution(name)
    device, simulation = build(
        wanted.load(), width=width, height=height, seed=wanted.seed, clock=clock
    )
    connect = partial(open_transport, backend=SimulatedBus([device]))
    return UsbCamera(connect, clock=clock, simulation=simulation)


def _find() -> Iterator[FoundCamera]:
    for info in list_scenes():
        yield FoundCamera(f"sim:{info.name}", product=info.description, simulated=True)


def _check(name: CameraName) -> None:
    resolution(name)
    scene_of(name).load()


PLUGIN = CameraPlugin(
    summary="a simulated camera in front of a scene (docs/measured/simulation.md)",
    usage="sim:SCENE, sim:FILE.toml or sim:measured:FILE.npz",
    open=_open,
    find=_find,
    check=_check,
    options={"width": "of the sensor", "height": "of the sensor", **SCENE_OPTIONS},
)
