"""Random scenes: walls, corners lit whole or in part, rooms, mirrors, wax, objects, moving things.

What intervals of plans are calibrated on. Every figure of a scene is drawn, from walls at 0.8 m to
9 m and from a tenth to nine tenths of the light reflected; none is made after a built-in scene or
one of those that plans are tested on.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

_Random = np.random.Generator
_Table = dict[str, Any]


def write(directory: Path, count: int, *, seed: int) -> list[str]:
    """Write so many scenes of each kind in turn, and return their paths."""
    paths = []
    for number in range(count):
        random = np.random.default_rng((seed, number))
        kind = list(KINDS)[number % len(KINDS)]
        path = directory / f"{kind}-{number}.toml"
        path.write_text(_toml(KINDS[kind](random), random, narrow=kind in NARROW))
        paths.append(str(path))
    return paths


def _between(random: _Random, low: float, high: float) -> float:
    """Draw a number, its logarithm evenly."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _surface(
    random: _Random, centre: tuple[float, ...], normal: tuple[float, ...], **more: Any
) -> _Table:
    found: _Table = {
        "kind": "diffuse",
        "centre_m": list(centre),
        "normal": list(normal),
        "size_m": [4.0, 3.0],
        **more,
    }
    if found["kind"] != "mirror":
        found.setdefault("albedo", _between(random, 0.1, 0.9))
    return found


def _facing(random: _Random, spread: float = 0.4) -> tuple[float, float, float]:
    return float(random.uniform(-spread, spread)), -1.0, float(random.uniform(-spread, spread) / 2)


def _wall(random: _Random) -> list[_Table]:
    far = _between(random, 0.8, 9.0)
    return [_surface(random, (0.0, far, 0.0), _facing(random), size_m=[3 * far, 3 * far])]


def _corner(random: _Random) -> list[_Table]:
    far = _between(random, 0.8, 3.5)
    long = 0.9 * far
    walls = []
    for side in (-1.0, 1.0):
        # from the edge of the corner, towards the camera and to one side
        turn = math.radians(random.uniform(30, 75))
        x, y = side * math.sin(turn), -math.cos(turn)
        centre, normal = (x * long / 2, far + y * long / 2, 0.0), (side * y, -side * x, 0.0)
        walls.append(_surface(random, centre, normal, size_m=[long, far]))
    return walls


def _room(random: _Random) -> list[_Table]:
    far, wide, high = _between(random, 1.0, 4.0), random.uniform(0.3, 0.9), random.uniform(0.3, 0.6)
    width, height, deep = wide * far, high * far, 0.7 * far
    middle = far - deep / 2
    return [
        _surface(random, (0.0, far, 0.0), (0.0, -1.0, 0.0), size_m=[width, height]),
        _surface(random, (-width / 2, middle, 0.0), (1.0, 0.0, 0.0), size_m=[deep, height]),
        _surface(random, (width / 2, middle, 0.0), (-1.0, 0.0, 0.0), size_m=[deep, height]),
        _surface(random, (0.0, middle, -height / 2), (0.0, 0.0, 1.0), size_m=[width, deep]),
    ]


def _wax(random: _Random) -> list[_Table]:
    near = _between(random, 0.6, 2.5)
    slab = _surface(
        random,
        (float(random.uniform(-0.1, 0.1)), near, 0.0),
        _facing(random),
        kind="translucent",
        size_m=[near * random.uniform(0.2, 0.8), near * random.uniform(0.2, 0.8)],
        scatter_width_s=_between(random, 0.02e-9, 0.15e-9),
        scatter_decay_s=_between(random, 0.1e-9, 1.2e-9),
    )
    behind = near * random.uniform(1.3, 2.0)
    return [slab, _surface(random, (0.0, behind, 0.0), _facing(random, 0.2))]


def _glossy(random: _Random) -> list[_Table]:
    far = _between(random, 1.2, 4.0)
    below = -far * random.uniform(0.2, 0.4)
    floor = _surface(
        random,
        (0.0, 0.6 * far, below),
        (0.0, 0.0, 1.0),
        kind="mirror",
        size_m=[2 * far, far],
        reflectivity=float(random.uniform(0.1, 0.8)),
    )
    return [_surface(random, (0.0, far, 0.0), _facing(random, 0.2), size_m=[2 * far, far]), floor]


def _object(random: _Random) -> list[_Table]:
    far = _between(random, 0.8, 4.0)
    size = far * random.uniform(0.15, 0.6)
    found = [_surface(random, (0.0, far, 0.0), _facing(random), size_m=[size, size])]
    if random.random() < 0.5:
        behind = far * random.uniform(1.1, 2.0)
        found.append(_surface(random, (0.0, behind, 0.0), _facing(random), size_m=[9.0, 9.0]))
    return found


def _moving(random: _Random) -> list[_Table]:
    far = _between(random, 1.0, 3.0)
    ball = {
        "kind": "diffuse",
        "shape": "sphere",
        "centre_m": [0.0, 0.7 * far, 0.0],
        "radius_m": far * random.uniform(0.05, 0.2),
        "albedo": _between(random, 0.2, 0.9),
        "motion": "roll",
    }
    return [_surface(random, (0.0, far, 0.0), _facing(random, 0.2)), ball]


KINDS: Final[dict[str, Callable[[_Random], list[_Table]]]] = {
    "wall": _wall,
    "corner": _corner,
    "room": _room,
    "wax": _wax,
    "glossy": _glossy,
    "object": _object,
    "moving": _moving,
    "lit-in-part": _corner,
}
NARROW: Final = {"lit-in-part"}
"""Kinds whose light is a narrow beam on one side: the rest is lit by what it lights."""


def _toml(surfaces: list[_Table], random: _Random, *, narrow: bool) -> str:
    """State a scene: its surfaces, a light beside the camera, at times other light."""
    far = float(surfaces[0]["centre_m"][1])
    electrons_per_s = _between(random, 4e6, 4e7) * far**2
    aside = random.choice((-0.4, 0.4)) if narrow else random.uniform(-0.3, 0.3)
    beam = _between(random, 30.0, 200.0) if narrow else random.choice([0.0, 0.0, 8.0])
    lines = [
        f"seed = {random.integers(1000)}",
        "[camera]\nposition_m = [0.0, 0.0, 0.0]",
        f"look_at_m = [0.0, {far}, 0.0]",
        f"field_of_view_deg = {random.uniform(25, 50)}",
        "[light]",
        f"position_m = {[float(each) for each in random.uniform(-0.2, 0.2, 3) * (1, 0, 1)]}",
        f"aim_at_m = {[float(aside * far), 0.8 * far, 0.0]}",
        f"beam_exponent = {float(beam)}",
        f"electrons_per_s = {electrons_per_s}",
    ]
    if random.random() < 0.3:
        ambient = electrons_per_s / far**2 * _between(random, 0.05, 1.0)
        lines += ["[ambient]", f"electrons_per_s = {ambient}"]
    if any("motion" in surface for surface in surfaces):
        reach = [[float(x) for x in random.uniform(-0.3, 0.3, 3)] for _ in range(2)]
        period_s = _between(random, 20.0, 400.0)
        lines += [f'[[motion]]\nname = "roll"\nperiod_s = {period_s}', 'repeat = "back"']
        lines.append(f"path_m = {reach}")
    for surface in surfaces:
        lines.append("[[surface]]")
        lines += [f"{key} = {_value(value)}" for key, value in surface.items()]
    return "\n".join(lines) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    return str([float(each) for each in value] if isinstance(value, list) else float(value))
