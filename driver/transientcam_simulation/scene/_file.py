"""Read scene files: TOML tables into a scene. Reading computes nothing."""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import Sensor
from transientcam_driver.errors import SceneError
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_driver.texts import read_text
from transientcam_simulation.base import Lens, OtherLight, Scatter
from transientcam_simulation.effects import CHOICES, EFFECTS
from transientcam_simulation.scene._device import MOST_E, MOST_S, read_device
from transientcam_simulation.scene._geometry import Ellipsoid, Rectangle, rotation
from transientcam_simulation.scene._limits import require_modest
from transientcam_simulation.scene._mesh import Mesh
from transientcam_simulation.scene._mesh_file import load_mesh
from transientcam_simulation.scene._motion import NOWHERE, STANDS, Motion, Repeat
from transientcam_simulation.scene._scene import (
    Background,
    Diffuser,
    Glass,
    Kind,
    Light,
    ResponseFile,
    Scene,
    Shape,
    Surface,
    TimeZero,
    Transport,
    Viewpoint,
)
from transientcam_simulation.scene._table import MOST_M, Table

BUILT_IN = Path(__file__).parents[1] / "scenes"
MOST_BOUNCES = 8
LEAST_E = 1e-9
"""Electrons a second, as `MOST_E`."""
_FORMER_DIFFUSER = "diffusor"
"""How the table [diffuser] was spelt."""
_SHAPES = ("rectangle", "sphere", "ellipsoid", "mesh")


@dataclass(frozen=True, slots=True)
class SceneInfo:
    """A built-in scene."""

    name: str
    description: str
    path: Path


def list_scenes() -> tuple[SceneInfo, ...]:
    """List the scenes that come with the driver."""
    infos = []
    for path in sorted(BUILT_IN.glob("*.toml"), key=lambda path: path.stem):
        table = _open(path)
        infos.append(SceneInfo(path.stem, table.text("description", ""), path))
    return tuple(infos)


def load_scene(path: Path) -> Scene:
    """Read a scene file.

    Raises SceneError naming the file, the key, its value and what is allowed.
    """
    return _scene(_open(path), name=path.stem, file=path)


def parse_scene(text: str) -> Scene:
    """Read the text of a scene file that comes from elsewhere; it may name no other file.

    Raises SceneError as `load_scene`; and if it would take much memory or time to prepare.
    """
    try:
        content = tomllib.loads(text)
        scene = _scene(Table("the scene", "", content), name="own scene", file=None)
    except (ValueError, RecursionError) as error:  # TOMLDecodeError; a number of too many digits
        raise SceneError("the scene", "the text", str(error), "valid TOML") from error
    built_in = [each.name for each in list_scenes()]
    if scene.name in built_in:
        allowed = f"another name than those of built-in scenes: {', '.join(built_in)}"
        raise SceneError("the scene", "name", scene.name, allowed)
    require_modest(scene)
    return scene


def _scene(top: Table, *, name: str, file: Path | None) -> Scene:
    folder = None if file is None else file.parent
    name, description = top.text("name", name), top.text("description", "")
    responses = tuple(_response(table, folder) for table in top.tables("response"))
    motions = _motions(top.tables("motion"))
    surfaces = tuple(_surface(table, motions, folder) for table in top.tables("surface"))
    diffuser = _diffuser(top)
    if sum(map(bool, (responses, surfaces, diffuser))) != 1:
        allowed = "given, or [[response]] or [diffuser] instead, but only one of them"
        raise top.error("surface", len(surfaces), allowed)
    ambient_per_s, other_light = _ambient(top.table("ambient"))
    scene = Scene(
        name=name,
        description=description,
        file=file,
        light=_light(top.table("light"), motions, somewhere=bool(surfaces)),
        sensor=_sensor(top.table("sensor")),
        device=read_device(top.table("device"), folder),
        camera=_viewpoint(top.table("camera"), motions) if surfaces else None,
        surfaces=tuple(part for surface in surfaces for part in (surface, *_dust(surface))),
        transport=_transport(top.table("transport")),
        responses=responses,
        diffuser=diffuser,
        ambient_electrons_per_s=ambient_per_s,
        other_light=other_light,
        effects=_effects(top.table("effects")),
        seed=top.integer("seed", 1, least=0, most=2**63 - 1),
    )
    for index, each in enumerate(scene.surfaces):
        if each.glass and scene.moves:
            raise top.error(f"surface[{index}].kind", "glass", "none if something moves")
        if isinstance(each.shape, Mesh) and scene.carriers:
            raise top.error(f"surface[{index}].shape", "mesh", "none if camera or light moves")
    anew = (STANDS,) if scene.carriers else ()
    movable = (replace(k, motions=k.motions + anew) if k.scatters else k for k in scene.surfaces)
    return top.done(replace(scene, surfaces=tuple(movable)))


def _open(path: Path) -> Table:
    try:
        content = tomllib.loads(read_text(path))
    except OSError as error:
        raise SceneError(path, "the file", error.strerror, "readable") from error
    except ValueError as error:
        raise SceneError(path, "the file", str(error), "valid TOML") from error
    return Table(path, "", content)


def _light(table: Table, motions: dict[str, Motion], *, somewhere: bool) -> Light:
    electrons_per_s = table.number("electrons_per_s", least=LEAST_E, most=MOST_E)
    if not somewhere:
        return table.done(Light(electrons_per_s, np.zeros(3), np.zeros(3), 0.0))
    light = Light(
        electrons_per_s=electrons_per_s,
        position_m=table.vector("position_m"),
        aim_at_m=table.vector("aim_at_m"),
        beam_exponent=table.number("beam_exponent", 0.0, least=0, most=1e4),
        motions=_moves(table, "camera or lamp", motions),
    )
    if np.array_equal(light.aim_at_m, light.position_m):
        raise table.error("aim_at_m", light.aim_at_m.tolist(), "away from position_m")
    return table.done(light)


def _viewpoint(table: Table, motions: dict[str, Motion]) -> Viewpoint:
    view = Viewpoint(
        position_m=table.vector("position_m", (0.0, 0.0, 0.0)),
        look_at_m=table.vector("look_at_m", (0.0, 1.0, 0.0)),
        field_of_view_deg=table.number("field_of_view_deg", 45.0, above=0, most=170),
        lens=_lens(table.table("lens")),
        motions=_moves(table, "camera or lamp", motions),
    )
    if not np.any((view.look_at_m - view.position_m)[:2]):
        allowed = "away from position_m, and not straight above or below it"
        raise table.error("look_at_m", view.look_at_m.tolist(), allowed)
    return table.done(view)


def _lens(table: Table) -> Lens:
    k1, k2, p1, p2, k3 = (
        table.number(name, 0.0, least=-most, most=most)
        for name, most in (("k1", 1.0), ("k2", 1.0), ("p1", 0.1), ("p2", 0.1), ("k3", 1.0))
    )
    x, y = (table.number(name, 0.0, least=-0.5, most=0.5) for name in ("centre_x", "centre_y"))
    return table.done(
        Lens((k1, k2, p1, p2, k3), (x, y), table.number("vignetting", 0.0, least=0, most=16))
    )


def _sensor(table: Table) -> Sensor:
    default = Sensor()
    sensor = Sensor(
        full_well_e=table.number("full_well_e", default.full_well_e, least=1, most=1e12),
        gain_e_per_dn=table.number("gain_e_per_dn", default.gain_e_per_dn, least=1e-6, most=1e9),
        read_noise_e=table.number("read_noise_e", default.read_noise_e, least=0, most=1e9),
        bits=table.integer("bits", default.bits, least=1, most=16),
        dark_dn=table.number("dark_dn", default.dark_dn, least=0),
    )
    if sensor.dark_dn > sensor.highest_dn:
        allowed = f"a number of at most {sensor.highest_dn}, the highest code of the converter"
        raise table.error("dark_dn", sensor.dark_dn, allowed)
    return table.done(sensor)


def _transport(table: Table) -> Transport:
    default, most = Transport(), MOST_BOUNCES
    mirror = table.integer("mirror_bounces", default.mirror_bounces, least=0, most=most)
    given = "diffuse_bounces" in table
    diffuse = table.integer("diffuse_bounces", least=0, most=most) if given else None
    patches = table.integer("patches", default.patches, least=2, most=64)
    return table.done(Transport(mirror, diffuse, patches))


def _ambient(table: Table) -> tuple[float, OtherLight]:
    """Read all other light, and by which shares of it it changes."""
    of_lamps = table.number("electrons_per_s", 0.0, least=0, most=MOST_E)
    depth = table.number("flicker", 0.0, least=0, most=1)
    flicker_hz = table.number("flicker_hz", 100.0, least=1e-3, most=1e6)
    of_camera = table.number("camera_electrons_per_s", 0.0, least=0, most=MOST_E)
    camera_hz = table.number("camera_hz", None if of_camera else 1.0, least=1, most=1e12)
    both = of_lamps + of_camera
    flicker = (depth * of_lamps / both, flicker_hz) if depth and of_lamps else None
    other_camera = (of_camera / both, camera_hz) if of_camera else None
    return table.done((both, OtherLight(flicker, other_camera)))


def _diffuser(top: Table) -> Diffuser | None:
    if "diffuser" not in top and _FORMER_DIFFUSER not in top:
        return None
    if "diffuser" in top and _FORMER_DIFFUSER in top:
        raise top.error(_FORMER_DIFFUSER, "a table", "absent beside [diffuser]")
    table = top.table("diffuser" if "diffuser" in top else _FORMER_DIFFUSER)
    return table.done(
        Diffuser(
            brightness=table.number("brightness", 1.0, least=1e-9, most=1e9),
            delay_s=table.number("delay_s", 0.0, least=0, most=MOST_S),
            fall_off=table.number("fall_off", 0.0, least=0, most=0.9),
        )
    )


def _effects(table: Table) -> dict[str, str]:
    return table.done(
        {
            effect.name: table.choice(effect.name, CHOICES, "auto")
            for effect in EFFECTS
            if effect.optional
        }
    )


def _motions(tables: list[Table]) -> dict[str, Motion]:
    motions: dict[str, Motion] = {}
    for table in tables:
        name = table.text("name")
        if name in motions:
            raise table.error("name", name, "a name that no other motion has")
        stays = NOWHERE.tolist()
        motion = motions[name] = Motion(
            path_m=table.vectors("path_m", stays if "rotation_deg" in table else None, least=2),
            period_s=table.number("period_s", least=1e-6, most=1e9),
            repeat=table.choice("repeat", get_args(Repeat), "restart"),
            rotation_deg=table.vectors("rotation_deg", stays, least=2),
        )
        speed_m_s = motion.speed_m_s + motion.turn_rad_s  # at 1 m from its centre
        if speed_m_s > SPEED_OF_LIGHT_M_S:
            longer = motion.period_s * speed_m_s / SPEED_OF_LIGHT_M_S
            limit = f"of at least {longer:.3g}, or it is faster than light"
            raise table.error("period_s", motion.period_s, limit)
        table.done(motions)
    return motions


def _surface(table: Table, motions: dict[str, Motion], folder: Path | None) -> Surface:
    kind: Kind = table.choice("kind", get_args(Kind)[:-1])
    name = table.text("name", kind)
    shape, albedo = _shape(table, kind, folder)
    share = "reflectivity" if kind == "mirror" else "albedo"
    moves = "mesh" if isinstance(shape, Mesh) else kind
    gloss, exponent = _gloss(table) if kind in ("diffuse", "translucent") else (0.0, 50.0)
    surface = Surface(
        name,
        kind,
        shape,
        0.0 if kind == "stencil" else table.number(share, albedo, least=0, most=1),
        _mask(table) if kind == "stencil" else None,
        _scatter(table) if kind == "translucent" else None,
        _moves(table, moves, motions),
        gloss,
        exponent,
    )
    if kind == "glass":
        surface = replace(surface, glass=_glass(table, dust=surface.reflectivity))
    if surface.turns and isinstance(shape, Ellipsoid) and len(set(shape.radii)) > 1:
        limit = "equal where motion has rotation_deg: axes of an ellipsoid stay along x, y and z"
        raise table.error("radii_m", shape.radii.tolist(), limit)
    if surface.reflectivity + gloss > 1 and surface.scatters:
        limit = f"at most {1 - surface.reflectivity:g}, what albedo leaves of the light"
        raise table.error("gloss", gloss, limit)
    return table.done(surface)


def _shape(table: Table, kind: Kind, folder: Path | None) -> tuple[Shape, float | None]:
    """Read a shape, and the albedo that its surface has by default."""
    allowed = _SHAPES if kind in ("diffuse", "translucent") else _SHAPES[:1]
    shape = table.choice("shape", allowed, "rectangle")
    if shape == "mesh":
        return _mesh(table, folder)
    centre_m = table.vector("centre_m")
    if shape == "sphere":
        return Ellipsoid(centre_m, np.full(3, table.length("radius_m"))), None
    if shape == "ellipsoid":
        return Ellipsoid(centre_m, np.array(table.lengths("radii_m", 3))), None
    normal = table.vector("normal")
    if not np.any(normal):
        raise table.error("normal", normal.tolist(), "other than zero")
    width_m, height_m = table.lengths("size_m", 2)
    plane = Rectangle.facing(centre_m, normal, size=(width_m, height_m))
    return plane, 0.0 if kind == "glass" else None


def _mesh(table: Table, folder: Path | None) -> tuple[Mesh, float | None]:
    mesh, coloured = load_mesh(table.beside("file", folder), smooth=table.switch("smooth", True))
    scale = table.number("scale", 1.0, least=1e-9, most=1e9)
    position_m = table.vector("position_m", (0.0, 0.0, 0.0))
    turn = rotation(table.vector("rotation_deg", (0.0, 0.0, 0.0)))
    mesh = mesh.placed(scale * turn, position_m)
    farthest_m = float(np.abs(mesh.extent()).max())
    if farthest_m > MOST_M:
        limit = f"smaller: a coordinate of {farthest_m:.3g} m is more than {MOST_M:g}"
        raise table.error("scale", scale, limit)
    return mesh, 1.0 if coloured else None


def _gloss(table: Table) -> tuple[float, float]:
    return (
        table.number("gloss", 0.0, least=0, most=1),
        table.number("gloss_exponent", 50.0, least=1, most=10_000),
    )


def _glass(table: Table, *, dust: float) -> Glass:
    return Glass(
        table.number("refractive_index", 1.5, least=1, most=4),
        table.number("thickness_m", 0.004, least=0, most=1),
        table.number("reflectivity", least=0, most=1) if "reflectivity" in table else None,
        dust,
    )


def _dust(pane: Surface) -> Iterator[Surface]:
    """Make what scatters on the front and back of a pane."""
    if pane.glass and pane.glass.dust:
        for side in (pane.mirror, pane.mirror.turned()):
            yield Surface("dust", "dust", side, pane.glass.dust)


def _scatter(table: Table) -> Scatter:
    return Scatter(
        width_s=table.number("scatter_width_s", 0.0, least=0, most=1e-6),
        decay_s=table.number("scatter_decay_s", least=1e-15, most=1e-6),
    )


def _moves(table: Table, kind: str, motions: dict[str, Motion]) -> tuple[Motion, ...]:
    names = table.words("motion") if "motion" in table else []
    if names and kind in ("mirror", "stencil", "glass", "mesh"):
        raise table.error("motion", names, f"absent; a {kind} stays in its place")
    for name in names:
        if name not in motions:
            known = ", ".join(motions) or "none in this file"
            raise table.error("motion", name, f"the name of a [[motion]]: {known}")
    return tuple(motions[name] for name in names)


def _mask(table: Table) -> NDArray[np.bool_]:
    text = table.text("mask")
    rows = [line.strip() for line in text.strip().splitlines()]
    if not rows or len({len(row) for row in rows}) != 1 or set("".join(rows)) - {"#", "."}:
        allowed = "rows of equal length made of '#' (opaque) and '.' (open)"
        raise table.error("mask", text, allowed)
    return np.array([[cell == "#" for cell in row] for row in rows])


def _response(table: Table, folder: Path | None) -> ResponseFile:
    time_zero_s = (
        table.number("time_zero_s", least=-MOST_S, most=MOST_S) if "time_zero_s" in table else None
    )
    has_zero_file = "time_zero_file" in table
    zero_file = table.beside("time_zero_file", folder) if has_zero_file else None
    if time_zero_s is not None and zero_file is not None:
        raise table.error("time_zero_s", time_zero_s, "absent beside time_zero_file")
    return table.done(
        ResponseFile(
            path=table.beside("file", folder),
            weight=table.number("weight", 1.0, least=1e-9, most=1e9),
            delay_s=table.number("delay_s", 0.0, least=-MOST_S, most=MOST_S),
            normalise=table.switch("normalise", True),
            background=table.choice("background", get_args(Background), "none"),
            time_zero=table.choice("time_zero", get_args(TimeZero), "start"),
            time_zero_s=time_zero_s,
            time_zero_file=zero_file,
            bin_s=table.number("bin_s", least=1e-15, most=MOST_S) if "bin_s" in table else None,
        )
    )
