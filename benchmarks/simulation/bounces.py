"""Radiosity against a path tracer of its own: light over several surfaces of a scene.

Paths start at the point a pixel sees, go on in directions drawn by the cosine, and take the direct
light of each surface they meet, up to as many bounces as the simulation chose.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.common.tables import Column, Table
from benchmarks.simulation.scenes import scene_named
from transientcam_driver import Sequence
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.emulated import world_of
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._paths import (
    first_scattering,
    image_lights,
    light_on,
    light_rays,
    normals_at,
)
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import camera_rays
from transientcam_simulation.scene import Scene

WIDTH, HEIGHT = 163, 120
CORNERS = (("corner", "anywhere"), ("corner", "crease"), ("corner-left", "anywhere"))
PATHS = 20_000
PIXELS = 24
FREQUENCIES_HZ = (0.0, 23e6, 69e6, 138e6)
VIDEO = Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005)


@dataclass(frozen=True, slots=True)
class Bounces:
    """Radiosity less paths, at each frequency, in units of the noise of a moment."""

    scene: str
    where: str
    bounces: int
    rms: tuple[float, ...]
    largest: tuple[float, ...]
    error_of_paths: float


def measure(name: str, where: str) -> Bounces:
    """Compare some pixels anywhere, or of the middle columns, where a corner has its crease."""
    scene = scene_named(name)
    assert scene.camera is not None
    world = world_of(scene, width=WIDTH, height=HEIGHT, readout_s=4e-3)
    conditions = world.conditions(VIDEO)
    lit = light_rays(scene, camera_rays(scene.camera, width=WIDTH, height=HEIGHT))
    tolerance = conditions.negligible
    further = Interreflection(scene, lit, width=WIDTH, height=HEIGHT, tolerance=tolerance)
    bounces = Exchange.of(scene, scene.transport.patches).bounces(tolerance)
    random = np.random.default_rng(1)
    rows = random.integers(4, HEIGHT - 4, PIXELS)
    columns = random.integers(4, WIDTH - 4, PIXELS)
    columns[columns == WIDTH // 2] += 1  # in a corner that one looks at the crease itself
    if where == "crease":
        columns = WIDTH // 2 + random.integers(1, 4, PIXELS) * random.choice((-1, 1), PIXELS)
    apart = np.zeros((len(FREQUENCIES_HZ), PIXELS))
    errors = []
    radiosity = [further.moments(frequency_hz).ravel() for frequency_hz in FREQUENCIES_HZ]
    for k, pixel in enumerate(rows * WIDTH + columns):
        deviation = conditions.noise.deviation(lit.weight[:, pixel].sum(), 0.0)
        paths = _traced(scene, lit.point[pixel], int(lit.surface[pixel]), bounces, random)
        way = np.exp(
            2j * np.pi * np.array(FREQUENCIES_HZ) / SPEED_OF_LIGHT_M_S * lit.distance_m[pixel]
        )
        found = lit.reflectance[pixel] * way * paths.mean(axis=1)
        errors.append(
            lit.reflectance[pixel] * paths[0].real.std() / np.sqrt(PATHS) / float(deviation)
        )
        for j, moments in enumerate(radiosity):
            apart[j, k] = abs(moments[pixel] - found[j]) / float(deviation)
    return Bounces(
        name,
        where,
        bounces,
        tuple(float(np.sqrt(np.mean(each**2))) for each in apart),
        tuple(float(each.max()) for each in apart),
        float(np.sqrt(np.mean(np.square(errors)))),
    )


def _traced(
    scene: Scene,
    start: NDArray[np.float64],
    surface: int,
    bounces: int,
    random: np.random.Generator,
) -> NDArray[np.complex128]:
    """Irradiance (F, N) of a point by the light of each path over further surfaces."""
    omega = 2 * np.pi * np.array(FREQUENCIES_HZ)[:, None] / SPEED_OF_LIGHT_M_S
    total = np.zeros((len(FREQUENCIES_HZ), PATHS), dtype=np.complex128)
    albedo = np.array([each.reflectivity for each in scene.surfaces])
    path = np.arange(PATHS)
    point, which = np.repeat(start[None], PATHS, axis=0), np.full(PATHS, surface)
    length_m, throughput = np.zeros(PATHS), np.ones(PATHS)
    for _bounce in range(bounces):
        direction = _by_cosine(normals_at(scene, point, which), random)
        ends = first_scattering(scene, point + 1e-9 * direction, direction)
        path, throughput = path[ends.ray], throughput[ends.ray] * albedo[ends.surface]
        length_m = length_m[ends.ray] + ends.distance_m
        point, which = ends.point, ends.surface
        normal = normals_at(scene, point, which)
        for light in image_lights(scene):
            way_m, irradiance = light_on(scene, light, point, normal)
            total[:, path] += throughput * irradiance * np.exp(1j * omega * (length_m + way_m))
    return total


def _by_cosine(normal: NDArray[np.float64], random: np.random.Generator) -> NDArray[np.float64]:
    """Directions by Lambert's law: a point on the unit sphere added to the normal."""
    offset = random.standard_normal(normal.shape)
    offset /= np.linalg.norm(offset, axis=-1, keepdims=True)
    direction = normal + offset
    unit: NDArray[np.float64] = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    return unit


def tables() -> Iterator[Table]:
    """Compare corners, anywhere and beside the crease."""
    frequencies = (f"{f_hz / 1e6:g} MHz" for f_hz in FREQUENCIES_HZ)
    known = ("scene", "pixels", "bounces", *frequencies)
    table = Table("", [*known, Column("paths", ".2f")])
    for each in (measure(*corner) for corner in CORNERS):
        apart = zip(each.rms, each.largest, strict=True)
        cells = (f"{rms:.2f}, {most:.2f}" for rms, most in apart)
        table.rows.append((each.scene, each.where, each.bounces, *cells, each.error_of_paths))
    yield table
