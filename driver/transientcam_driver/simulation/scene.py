"""Scene files: what is in front of the simulated camera, as TOML.

The schema is described in docs/scenes.md. Reading a scene computes nothing.
"""

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.errors import SceneError
from transientcam_driver.simulation.effects import EFFECTS
from transientcam_driver.simulation.geometry import Points, Rectangle
from transientcam_driver.simulation.sensor import Sensor
from transientcam_driver.simulation.toml_table import Table

BUILT_IN = Path(__file__).parent / "scenes"
Background = Literal["none", "median"]
TimeZero = Literal["start", "peak"]
_CHOICES = ("auto", "on", "off")
MOST_BOUNCES = 8


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """Where the camera stands and looks; ``field_of_view_deg`` is horizontal."""

    position_m: Points
    look_at_m: Points
    field_of_view_deg: float


@dataclass(frozen=True, slots=True)
class Light:
    """A small light source.

    Its intensity falls off with the ``beam_exponent``-th power of the cosine to the direction it
    is aimed in. ``electrons_per_s`` is what a white surface that faces it on its axis at 1 m
    gives a pixel.
    """

    electrons_per_s: float
    position_m: Points
    aim_at_m: Points
    beam_exponent: float


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A rectangle that is diffuse, a mirror, or a stencil.

    ``reflectivity`` is the albedo of a diffuse surface. ``opaque`` is the mask of a stencil,
    rows from top to bottom as seen from its front; the other kinds have none.
    """

    name: str
    kind: Literal["diffuse", "mirror", "stencil"]
    rectangle: Rectangle
    reflectivity: float
    opaque: NDArray[np.bool_] | None = None


@dataclass(frozen=True, slots=True)
class ResponseFile:
    """Impulse responses from a file (see ``measured.py``)."""

    path: Path
    weight: float = 1.0
    delay_s: float = 0.0
    normalise: bool = True
    background: Background = "none"
    time_zero: TimeZero = "start"
    time_zero_s: float | None = None
    time_zero_file: Path | None = None
    bin_s: float | None = None


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything in front of the camera, and the camera's sensor."""

    name: str
    description: str
    file: Path | None
    light: Light
    sensor: Sensor = field(default_factory=Sensor)
    camera: Viewpoint | None = None
    surfaces: tuple[Surface, ...] = ()
    mirror_bounces: int = 0
    responses: tuple[ResponseFile, ...] = ()
    effects: dict[str, str] = field(default_factory=dict)
    seed: int = 1


@dataclass(frozen=True, slots=True)
class SceneInfo:
    """A built-in scene."""

    name: str
    description: str
    path: Path


def list_scenes() -> tuple[SceneInfo, ...]:
    """List the scenes that come with the driver."""
    infos = []
    for path in sorted(BUILT_IN.glob("*.toml")):
        table = _open(path)
        infos.append(SceneInfo(path.stem, table.text("description", ""), path))
    return tuple(infos)


def load_scene(path: Path) -> Scene:
    """Read a scene file.

    Raises
    ------
    SceneError
        Naming the file, the key, its value and what is allowed.
    """
    top = _open(path)
    name, description = top.text("name", path.stem), top.text("description", "")
    responses = tuple(_response(table, path.parent) for table in top.tables("response"))
    surfaces = tuple(_surface(table) for table in top.tables("surface"))
    if bool(responses) == bool(surfaces):
        raise top.error("surface", len(surfaces), "given, or [[response]] instead, but not both")
    scene = Scene(
        name=name,
        description=description,
        file=path,
        light=_light(top.table("light"), measured=bool(responses)),
        sensor=_sensor(top.table("sensor")),
        camera=None if responses else _viewpoint(top.table("camera")),
        surfaces=surfaces,
        mirror_bounces=_transport(top.table("transport")),
        responses=responses,
        effects=_effects(top.table("effects")),
        seed=top.integer("seed", 1, least=0, most=2**63 - 1),
    )
    top.done()
    return scene


def _open(path: Path) -> Table:
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SceneError(path, "the file", error.strerror, "readable") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SceneError(path, "the file", str(error), "valid TOML") from error
    return Table(path, "", content)


def _light(table: Table, *, measured: bool) -> Light:
    electrons_per_s = table.number("electrons_per_s", above=0)
    if measured:
        table.done()
        return Light(electrons_per_s, np.zeros(3), np.zeros(3), 0.0)
    light = Light(
        electrons_per_s=electrons_per_s,
        position_m=table.vector("position_m"),
        aim_at_m=table.vector("aim_at_m"),
        beam_exponent=table.number("beam_exponent", 0.0, least=0),
    )
    if np.array_equal(light.aim_at_m, light.position_m):
        raise table.error("aim_at_m", light.aim_at_m.tolist(), "away from position_m")
    table.done()
    return light


def _viewpoint(table: Table) -> Viewpoint:
    view = Viewpoint(
        position_m=table.vector("position_m", (0.0, 0.0, 0.0)),
        look_at_m=table.vector("look_at_m", (0.0, 1.0, 0.0)),
        field_of_view_deg=table.number("field_of_view_deg", 45.0, above=0, most=170),
    )
    if not np.any((view.look_at_m - view.position_m)[:2]):
        allowed = "away from position_m, and not straight above or below it"
        raise table.error("look_at_m", view.look_at_m.tolist(), allowed)
    table.done()
    return view


def _sensor(table: Table) -> Sensor:
    default = Sensor()
    sensor = Sensor(
        full_well_e=table.number("full_well_e", default.full_well_e, above=0),
        gain_e_per_dn=table.number("gain_e_per_dn", default.gain_e_per_dn, above=0),
        read_noise_e=table.number("read_noise_e", default.read_noise_e, least=0),
        bits=table.integer("bits", default.bits, least=1, most=16),
        dark_dn=table.number("dark_dn", default.dark_dn, least=0),
    )
    if sensor.dark_dn > sensor.highest_dn:
        allowed = f"a number of at most {sensor.highest_dn}, the highest code of the converter"
        raise table.error("dark_dn", sensor.dark_dn, allowed)
    table.done()
    return sensor


def _transport(table: Table) -> int:
    bounces = table.integer("mirror_bounces", 2, least=0, most=MOST_BOUNCES)
    table.done()
    return bounces


def _effects(table: Table) -> dict[str, str]:
    effects = {
        effect.name: table.choice(effect.name, _CHOICES, "auto")
        for effect in EFFECTS
        if effect.optional
    }
    table.done()
    return effects


def _surface(table: Table) -> Surface:
    kind = table.choice("kind", ("diffuse", "mirror", "stencil"))
    name = table.text("name", kind)
    centre_m = table.vector("centre_m")
    normal = table.vector("normal")
    if not np.any(normal):
        raise table.error("normal", normal.tolist(), "other than zero")
    rectangle = Rectangle.facing(centre_m, normal, size=table.size("size_m"))
    if kind == "diffuse":
        surface = Surface(name, "diffuse", rectangle, _share(table, "albedo"))
    elif kind == "mirror":
        surface = Surface(name, "mirror", rectangle, _share(table, "reflectivity"))
    else:
        surface = Surface(name, "stencil", rectangle, 0.0, _mask(table))
    table.done()
    return surface


def _share(table: Table, key: str) -> float:
    return table.number(key, least=0, most=1)


def _mask(table: Table) -> NDArray[np.bool_]:
    text = table.text("mask")
    rows = [line.strip() for line in text.strip().splitlines()]
    if not rows or len({len(row) for row in rows}) != 1 or set("".join(rows)) - {"#", "."}:
        allowed = "rows of equal length made of '#' (opaque) and '.' (open)"
        raise table.error("mask", text, allowed)
    return np.array([[cell == "#" for cell in row] for row in rows])


def _response(table: Table, folder: Path) -> ResponseFile:
    time_zero_s = table.number("time_zero_s") if "time_zero_s" in table else None
    zero_file = folder / table.text("time_zero_file") if "time_zero_file" in table else None
    if time_zero_s is not None and zero_file is not None:
        raise table.error("time_zero_s", time_zero_s, "absent beside time_zero_file")
    response = ResponseFile(
        path=folder / table.text("file"),
        weight=table.number("weight", 1.0, above=0),
        delay_s=table.number("delay_s", 0.0),
        normalise=table.switch("normalise", True),
        background=table.choice("background", get_args(Background), "none"),
        time_zero=table.choice("time_zero", get_args(TimeZero), "start"),
        time_zero_s=time_zero_s,
        time_zero_file=zero_file,
        bin_s=table.number("bin_s", above=0) if "bin_s" in table else None,
    )
    table.done()
    return response
