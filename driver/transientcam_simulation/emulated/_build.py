"""From a scene to a simulated camera on a simulated bus."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from transientcam_driver.clock import Clock
from transientcam_driver.errors import EffectError, SceneError
from transientcam_simulation.base import DeviceProfile, Lens, SparseResponses
from transientcam_simulation.effects import (
    CHOICES,
    EFFECTS,
    NOISE,
    measured_harmonics,
    read_offsets_rad,
)
from transientcam_simulation.emulated._handle import PrepareScene, SimulationHandle
from transientcam_simulation.emulated._open_usb import EmulatedDevice, Firmware, prototype
from transientcam_simulation.imaging import SwitchableWorld, World
from transientcam_simulation.light import (
    GivenScenery,
    Scenery,
    load_compiled,
    load_responses,
    shared_scenery,
)
from transientcam_simulation.scene import (
    BUILT_IN,
    Background,
    Diffuser,
    Scene,
    TimeZero,
    list_scenes,
    load_scene,
)

MEASURED = "measured"
CALIBRATION = "calibration"
"""The scene that is seen through a diffuser, whatever is behind it."""
DEFAULT_WIDTH, DEFAULT_HEIGHT = 163, 120
RESOLUTIONS = ((DEFAULT_WIDTH, DEFAULT_HEIGHT), (320, 240), (640, 480))


def find_scene(name: str) -> Scene:
    """Load a built-in scene by its name, or a scene file by its path.

    Raises SceneError where there is no such scene, or its file is not valid.
    """
    if name.endswith(".toml"):
        return load_scene(Path(name))
    built_in = {info.name: info.path for info in list_scenes()}
    if name not in built_in:
        allowed = f"one of {', '.join([*built_in, 'measured:PATH.npz'])}, or a path to a .toml"
        raise SceneError(BUILT_IN, "scene", name, allowed)
    if name == MEASURED:
        allowed = "measured:PATH.npz with a file, or a path to a .toml with [[response]]"
        raise SceneError(built_in[name], "scene", name, allowed)
    return load_scene(built_in[name])


def measured_scene(path: Path, *, background: Background, time_zero: TimeZero) -> Scene:
    """Return the built-in scene ``measured`` with one file of impulse responses."""
    template = load_scene(BUILT_IN / f"{MEASURED}.toml")
    (response,) = template.responses
    response = replace(response, path=path, background=background, time_zero=time_zero)
    return replace(template, responses=(response,))


def without_noise(scene: Scene) -> Scene:
    """Return the same scene with a sensor whose only error is the rounding to 16 bits."""
    quiet = {effect.name: "off" for effect in NOISE}
    return replace(scene, sensor=scene.sensor.ideal(), effects=scene.effects | quiet)


def scenery_of(scene: Scene, *, width: int, height: int) -> Scenery:
    """Prepare the light of a scene, or read its impulse responses."""
    if scene.responses:
        return GivenScenery(load_responses(scene, width=width, height=height))
    if scene.diffuser is not None:
        return GivenScenery(through_diffuser(scene.diffuser, width=width, height=height))
    return shared_scenery(scene, width=width, height=height)


def through_diffuser(diffuser: Diffuser, *, width: int, height: int) -> SparseResponses:
    """Return the same return for all pixels, but for the fall-off towards the corners."""
    x = (2 * np.arange(width) + 1) / width - 1
    y = (2 * np.arange(height) + 1) / height - 1
    off_centre = (x[None, :] ** 2 + y[:, None] ** 2) / 2
    weight = diffuser.brightness * (1 - diffuser.fall_off * off_centre)
    return SparseResponses(np.full_like(weight, diffuser.delay_s)[None], weight[None])


def field_deg_of(scene: Scene) -> float:
    """Return the horizontal field of view, 70 degrees of a scene without a camera of its own."""
    return 70.0 if scene.camera is None else scene.camera.field_of_view_deg


def world_of(
    scene: Scene, *, width: int, height: int, seed: int | None = None, readout_s: float
) -> World:
    """Build the renderer of a scene and its sensor.

    Raises SceneError where a file that the scene names cannot be read, or has other content.
    """
    _read_device_files(scene.device)
    return World(
        scenery_of(scene, width=width, height=height),
        scene.sensor,
        electrons_per_s=scene.light.electrons_per_s,
        effects=scene.effects,
        seed=scene.seed if seed is None else seed,
        device=scene.device,
        ambient_electrons_per_s=scene.ambient_electrons_per_s,
        other_light=scene.other_light,
        readout_s=readout_s,
    )


def _read_device_files(device: DeviceProfile) -> None:
    """Check them now, and not when a sequence is set."""
    if device.waveform is not None and device.waveform.file is not None:
        measured_harmonics(device.waveform.file)
    if device.pattern is not None and device.pattern.file is not None:
        read_offsets_rad(device.pattern.file)


def build(
    scene: Scene, *, width: int, height: int, seed: int | None, clock: Clock
) -> tuple[EmulatedDevice, SimulationHandle]:
    """Build a simulated camera in front of a scene: the device, and the handle on both."""
    capabilities = prototype(
        # the same unit in front of every scene
        serial=f"SIM-{scene.device.name}-{scene.device.seed}"[:32],
        width=width,
        height=height,
        bits=scene.sensor.bits,
    )
    world, prepare = world_before(
        scene, width=width, height=height, seed=seed, readout_s=capabilities.streaming_readout_s
    )
    device = EmulatedDevice(
        capabilities, lambda now_s: Firmware(capabilities, world, power_on_s=now_s), clock=clock
    )
    return device, SimulationHandle(
        scene,
        world,
        device,
        prepare=prepare,
        set_interlock=lambda closed: device.set_interlock(closed=closed),
    )


def world_before(
    scene: Scene,
    *,
    width: int,
    height: int,
    seed: int | None,
    readout_s: float,
    lens: Lens | None = None,
) -> tuple[SwitchableWorld, PrepareScene]:
    """Build the world in front of a unit of a camera, and what prepares another one for it.

    Sensor, imperfections and what is off of its noise stay those of the scene given. A device with
    a ``lens`` of its own shows all scenes through it, with the field of view of the one given; the
    light stays where each has it.
    Raises SceneError where a file that the scene names cannot be read, or has other content;
    CompilerMissing where it moves, and there is no compiler.
    """

    def world_of_scene(scene: Scene) -> World:
        if scene.moves:
            load_compiled()  # rather than when the first image is due
        return world_of(scene, width=width, height=height, seed=seed, readout_s=readout_s)

    quiet = {each.name: "off" for each in NOISE if scene.effects.get(each.name) == "off"}

    def seen(found: Scene, effects: Mapping[str, str]) -> Scene:
        choices = found.effects | quiet | checked_effects(effects)
        found = replace(found, sensor=scene.sensor, device=scene.device, effects=choices)
        return through_lens(found)

    def through_lens(found: Scene) -> Scene:
        if lens is None or found.camera is None:
            return found
        camera = replace(found.camera, field_of_view_deg=field_deg_of(scene), lens=lens)
        return replace(found, camera=camera)

    def named(name: str) -> Scene:
        return scene if name == scene.name else find_scene(name)

    def prepare(
        wanted: Scene | str, effects: Mapping[str, str], diffuser: bool
    ) -> tuple[Scene, World]:
        found = seen(named(wanted) if isinstance(wanted, str) else wanted, effects)
        behind = seen(find_scene(CALIBRATION), effects) if diffuser else found
        return found, world_of_scene(behind)

    return SwitchableWorld(world_of_scene(through_lens(scene))), prepare


def checked_effects(effects: Mapping[str, str]) -> dict[str, str]:
    """Return choices of effects by name, after checking that they exist.

    Raises EffectError naming the first that is not.
    """
    optional = [effect.name for effect in EFFECTS if effect.optional]
    for name, choice in effects.items():
        if name not in optional:
            raise EffectError("effects", name, f"one of {', '.join(optional)}")
        if choice not in CHOICES:
            raise EffectError(f"effects.{name}", choice, f"one of {', '.join(CHOICES)}")
    return dict(effects)
