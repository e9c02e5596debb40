"""Open a camera by its name: ``usb``, ``usb:SERIAL``, ``sim:SCENE?width=320&height=240``."""

from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, get_args
from urllib.parse import parse_qsl

from transientcam_driver.camera import Camera
from transientcam_driver.clock import Clock, RealClock
from transientcam_driver.errors import SpecError
from transientcam_driver.simulation import build, find_scene, measured_scene, without_noise
from transientcam_driver.simulation.build import (
    DEFAULT_HEIGHT,
    DEFAULT_WIDTH,
    MEASURED,
    RESOLUTIONS,
)
from transientcam_driver.simulation.device import SimulatedBus
from transientcam_driver.simulation.effects import CHOICES, EFFECTS
from transientcam_driver.simulation.imperfections import PROFILES
from transientcam_driver.simulation.scene import Background, Scene, TimeZero
from transientcam_driver.usb import open_transport

DEFAULT_SPEC = "sim:mirrors"
_OF_FILE = f"{MEASURED}:"
_OPTIONS_OF_FILE = ("background", "time_zero")
_OPTIONS = ("width", "height", "noise", "seed", "device", *_OPTIONS_OF_FILE)
_EFFECTS = tuple(effect.name for effect in EFFECTS if effect.optional)


@dataclass(frozen=True, slots=True)
class CameraSpec:
    """A camera's name, parsed.

    ``scene`` is None for a real camera, ``serial`` for a simulated one or any real one.
    """

    serial: str | None = None
    scene: str | None = None
    width: int = DEFAULT_WIDTH
    height: int = DEFAULT_HEIGHT
    noise: bool = True
    seed: int | None = None
    device: str | None = None
    effects: dict[str, str] = field(default_factory=dict)
    background: Background = "none"
    time_zero: TimeZero = "start"


def open_camera(spec: str = DEFAULT_SPEC, *, clock: Clock | None = None) -> Camera:
    """Open a real or a simulated camera; the caller closes it.

    Parameters
    ----------
    spec
        ``usb``, ``usb:SERIAL``, or ``sim:SCENE`` with the name of a built-in scene, a path to a
        scene's .toml, or ``measured:PATH.npz``. A simulated camera takes ``?width=640&height=480``
        (163 x 120, 320 x 240 or 640 x 480), ``noise=off``, ``seed=3`` and ``device=prototype`` (or
        ``ideal``) in place of the scene's, and any effect's name, as in ``ambient=on`` or
        ``mixed-pixels=off``; a measured one also ``background=median`` and
        ``time_zero=peak``.
    clock
        The clock of a simulated camera; real time by default.

    Raises
    ------
    SpecError
        The name is not valid.
    SceneError
        The scene is not valid.
    CameraError
        The camera is absent, busy, or may not be opened.
    """
    parsed = parse_spec(spec)
    if parsed.scene is None:
        return Camera(lambda serial: open_transport(serial or parsed.serial), clock=clock)
    clock = clock or RealClock()
    device, simulation = build(
        scene_of(parsed),
        width=parsed.width,
        height=parsed.height,
        seed=parsed.seed,
        clock=clock,
    )
    connect = partial(open_transport, backend=SimulatedBus([device]))
    return Camera(connect, clock=clock, simulation=simulation)


def parse_spec(spec: str) -> CameraSpec:
    """Parse a camera's name.

    Raises
    ------
    SpecError
        Naming the part that is not valid.
    """
    kind, _, rest = spec.partition(":")
    if kind == "usb":
        return CameraSpec(serial=rest or None)
    if kind != "sim" or not rest:
        raise SpecError(spec, "neither a USB camera nor a simulated one")
    scene, _, query = rest.partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    for name in options:
        if name not in _OPTIONS and name not in _EFFECTS:
            known = ", ".join((*_OPTIONS, *_EFFECTS))
            raise SpecError(spec, f"unknown option {name!r}; known are {known}")
    width, height = _resolution(spec, options)
    if not scene.startswith(_OF_FILE) and not options.keys().isdisjoint(_OPTIONS_OF_FILE):
        raise SpecError(spec, f"{', '.join(_OPTIONS_OF_FILE)} belong to sim:measured:PATH.npz")
    return CameraSpec(
        scene=scene,
        width=width,
        height=height,
        noise=_choice(spec, options, "noise", ("on", "off")) == "on",
        seed=_integer(spec, options, "seed") if "seed" in options else None,
        device=_choice(spec, options, "device", tuple(PROFILES)) if "device" in options else None,
        effects={
            name: _choice(spec, options, name, CHOICES) for name in _EFFECTS if name in options
        },
        background=_choice(spec, options, "background", get_args(Background)),
        time_zero=_choice(spec, options, "time_zero", get_args(TimeZero)),
    )


def scene_of(parsed: CameraSpec) -> Scene:
    """Load the scene of a simulated camera, with the changes its name has.

    Raises
    ------
    SceneError
        The scene is not valid.
    """
    scene = _scene(parsed)
    if parsed.device is not None:
        scene = replace(scene, device=PROFILES[parsed.device])
    if not parsed.noise:
        scene = without_noise(scene)
    return replace(scene, effects=scene.effects | parsed.effects)


def _scene(parsed: CameraSpec) -> Scene:
    assert parsed.scene is not None  # noqa: S101  (the caller has checked)
    if not parsed.scene.startswith(_OF_FILE):
        return find_scene(parsed.scene)
    path = Path(parsed.scene.removeprefix(_OF_FILE))
    return measured_scene(path, background=parsed.background, time_zero=parsed.time_zero)


def _resolution(spec: str, options: dict[str, str]) -> tuple[int, int]:
    if "width" not in options and "height" not in options:
        return DEFAULT_WIDTH, DEFAULT_HEIGHT
    if "width" not in options or "height" not in options:
        raise SpecError(spec, "width and height come together")
    resolution = _integer(spec, options, "width"), _integer(spec, options, "height")
    if resolution not in RESOLUTIONS:
        known = ", ".join(f"{width} x {height}" for width, height in RESOLUTIONS)
        raise SpecError(spec, f"resolution {resolution[0]} x {resolution[1]}: known are {known}")
    return resolution


def _integer(spec: str, options: dict[str, str], name: str) -> int:
    text = options[name]
    if not (text.isascii() and text.isdigit()):
        raise SpecError(spec, f"{name} = {text!r}: must be an integer of at least 0")
    return int(text)


def _choice(spec: str, options: dict[str, str], name: str, allowed: tuple[str, ...]) -> Any:
    value = options.get(name, allowed[0])
    if value not in allowed:
        raise SpecError(spec, f"{name} = {value!r}: must be one of {', '.join(allowed)}")
    return value
