"""Random scenes at rest, as files of the simulator: rooms, objects, mirrors, wax, daylight.

They are what the intervals of plans are calibrated on (`benchmarks.accuracy.calibrating`); no scene
that plans are held to is among them.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

WALLS: Final = 0.5
"""Share of the worlds with side walls, which light each other."""
MIRRORS: Final = 0.25
SCATTERING: Final = 0.35
"""Share of the objects that light enters; walls of wax are rare."""
DAYLIGHT: Final = 0.25
SHADED: Final = 0.15
"""Share with a plate before the lamp, so that part of the picture is lit by the rest alone."""


@dataclass(frozen=True)
class World:
    """A random scene.

    Attributes
    ----------
    seed
        The same seed gives the same scene.
    away_m
        About how far it is.
    text
        As a scene file.
    """

    seed: int
    away_m: float
    text: str


def world(seed: int) -> World:
    """Draw a scene."""
    random = np.random.default_rng(seed)
    away_m = _spread(random, 0.7, 6.0)
    parts = [_stage(random, seed, away_m), _wall(random, away_m)]
    if random.random() < WALLS:
        parts += _sides(random, away_m)
    parts += [_object(random, away_m) for _ in range(random.integers(0, 4))]
    if random.random() < MIRRORS:
        parts.append(_mirror(random, away_m))
    if random.random() < SHADED:
        parts.append(_plate(random))
    return World(seed, away_m, "\n".join(parts))


def _spread(random: np.random.Generator, low: float, high: float) -> float:
    """Draw a number between two, evenly in its logarithm."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _stage(random: np.random.Generator, seed: int, away_m: float) -> str:
    light = _spread(random, 1e6, 3e7) * away_m**2
    ambient = _spread(random, 0.02, 0.5) * light / away_m**2
    beam = random.choice([0.0, 0.0, random.uniform(1, 10)])
    aim_m = (random.uniform(-0.2, 0.2) * away_m, away_m, 0.0)
    lines = [
        f'name = "world-{seed}"',
        f"seed = {seed}",
        "[camera]",
        f"look_at_m = {_vector((0.0, away_m, 0.0))}",
        f"field_of_view_deg = {random.uniform(25, 60):.4g}",
        "[light]",
        f"position_m = {_vector((random.uniform(-0.3, 0.3), 0.0, random.uniform(-0.1, 0.1)))}",
        f"aim_at_m = {_vector(aim_m)}",
        f"beam_exponent = {beam:.4g}",
        f"electrons_per_s = {light:.6g}",
    ]
    if random.random() < DAYLIGHT:
        lines += ["[ambient]", f"electrons_per_s = {ambient:.6g}"]
    return "\n".join(lines)


def _surface(kind: str, **fields: object) -> str:
    lines = [f"{name} = {value}" for name, value in fields.items()]
    return "\n".join(["[[surface]]", f'kind = "{kind}"', *lines])


def _matter(random: np.random.Generator) -> tuple[str, dict[str, object]]:
    """Draw what a surface is made of."""
    fields: dict[str, object] = {"albedo": round(random.uniform(0.1, 0.9), 3)}
    if random.random() < SCATTERING:
        width_s, decay_s = random.uniform(0.0, 0.2e-9), _spread(random, 0.05e-9, 1.5e-9)
        fields |= {"scatter_width_s": f"{width_s:.4g}", "scatter_decay_s": f"{decay_s:.4g}"}
        return "translucent", fields
    return "diffuse", fields


def _wall(random: np.random.Generator, away_m: float) -> str:
    normal = (random.uniform(-0.5, 0.5), -1.0, random.uniform(-0.2, 0.2))
    size = random.uniform(0.6, 3.0, 2) * away_m
    return _surface(
        "diffuse",
        centre_m=_vector((0.0, random.uniform(1.0, 1.4) * away_m, 0.0)),
        normal=_vector(normal),
        size_m=_vector(size),
        **_grey(random),
    )


def _grey(random: np.random.Generator) -> dict[str, object]:
    return {"albedo": round(random.uniform(0.1, 0.9), 3)}


def _sides(random: np.random.Generator, away_m: float) -> list[str]:
    """One to three walls on the left, on the right and below, at various angles."""
    half_m = random.uniform(0.2, 0.45) * away_m
    turn = random.uniform(0.0, 1.2)
    places = [
        ((-half_m, 0.8 * away_m, 0.0), (1.0, -turn, 0.0)),
        ((half_m, 0.8 * away_m, 0.0), (-1.0, -turn, 0.0)),
        ((0.0, 0.8 * away_m, -half_m), (0.0, -0.1 * turn, 1.0)),
    ]
    chosen = random.permutation(3)[: random.integers(1, 4)]
    size_m = (random.uniform(0.6, 1.2) * away_m, random.uniform(0.6, 1.2) * away_m)
    return [
        _surface(
            "diffuse",
            centre_m=_vector(places[k][0]),
            normal=_vector(places[k][1]),
            size_m=_vector(size_m),
            **_grey(random),
        )
        for k in chosen
    ]


def _object(random: np.random.Generator, away_m: float) -> str:
    kind, matter = _matter(random)
    place = (
        random.uniform(-0.25, 0.25) * away_m,
        random.uniform(0.55, 0.9) * away_m,
        random.uniform(-0.2, 0.2) * away_m,
    )
    if random.random() < 0.5:
        shape: dict[str, object] = {
            "shape": '"sphere"',
            "radius_m": f"{random.uniform(0.05, 0.25) * away_m:.4g}",
        }
    else:
        shape = {
            "normal": _vector((random.uniform(-0.6, 0.6), -1.0, random.uniform(-0.3, 0.3))),
            "size_m": _vector(random.uniform(0.1, 0.7, 2) * away_m),
        }
    return _surface(kind, centre_m=_vector(place), **shape, **matter)


def _mirror(random: np.random.Generator, away_m: float) -> str:
    """Below, or on one side."""
    half_m = random.uniform(0.25, 0.5) * away_m
    places = [
        ((0.0, 0.6 * away_m, -half_m), (0.0, 0.0, 1.0)),
        ((half_m, 0.7 * away_m, 0.0), (-1.0, random.uniform(-0.5, 0.0), 0.0)),
        ((-half_m, 0.7 * away_m, 0.0), (1.0, random.uniform(-0.5, 0.0), 0.0)),
    ]
    centre, normal = places[random.integers(3)]
    return _surface(
        "mirror",
        centre_m=_vector(centre),
        normal=_vector(normal),
        size_m=_vector(random.uniform(0.4, 1.2, 2) * away_m),
        reflectivity=round(random.uniform(0.1, 0.9), 3),
    )


def _plate(random: np.random.Generator) -> str:
    return _surface(
        "stencil",
        centre_m=_vector((random.uniform(-0.25, 0.25), 0.12, 0.0)),
        normal="[0.0, -1.0, 0.0]",
        size_m=_vector((random.uniform(0.05, 0.2), 0.2)),
        mask='"#"',
    )


def _vector(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{float(each):.5g}" for each in values) + "]"
