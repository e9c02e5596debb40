"""Meshes against brute force, closed forms, and the same things made of rectangles and spheres."""

import pickle
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from transientcam_simulation.light._paths import light_rays
from transientcam_simulation.light._rays import camera_rays
from transientcam_simulation.scene import (
    Ellipsoid,
    Light,
    Mesh,
    Rectangle,
    Scene,
    Shape,
    Surface,
    Viewpoint,
)
from transientcam_simulation.scene._mesh import Texture

Points = NDArray[np.float64]
ZERO = np.zeros(3)
CENTRE = np.array([0.1, 2.0, -0.2])


def mesh(
    vertices: object, triangles: object, *, normals: Points | None = None, share: object = 1.0
) -> Mesh:
    at, of = np.array(vertices, dtype=float), np.array(triangles, dtype=np.int32)
    return Mesh(
        at[of],
        None if normals is None else normals[of].astype(np.float32),
        np.broadcast_to(np.asarray(share, dtype=np.float32), len(at))[of],
        np.zeros((*of.shape, 2), dtype=np.float32),
        np.full(len(of), -1, dtype=np.int32),
    )


def ball(subdivisions: int, *, smooth: bool = False) -> Mesh:
    found = trimesh.creation.icosphere(subdivisions=subdivisions, radius=0.5)
    normals = np.array(found.vertices) if smooth else None
    return mesh(found.vertices + CENTRE, found.faces, normals=normals)


def unit(vectors: Points) -> Points:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def rays(count: int, *, seed: int = 0) -> Points:
    return unit(CENTRE + np.random.default_rng(seed).normal(scale=0.35, size=(count, 3)))


def scene_of(*shapes: Shape, light_m: tuple[float, float, float] = (0.6, 0.2, 0.7)) -> Scene:
    return Scene(
        "test",
        "",
        None,
        Light(1e6, np.array(light_m), np.array([0.0, 2.0, 0.0]), 0.0),
        camera=Viewpoint(ZERO, np.array([0.0, 1.0, 0.0]), 50.0),
        surfaces=tuple(Surface(f"{k}", "diffuse", each, 0.8) for k, each in enumerate(shapes)),
    )


def nearest_by_brute_force(of: Mesh, start: Points, way: Points) -> NDArray[np.float64]:
    """Ray by ray and triangle by triangle: the plane's point lies left of all three sides."""
    nearest = np.full(len(way), np.inf)
    for a, b, c in of.corners:
        normal = np.cross(b - a, c - a)
        length = (a - start) @ normal / (way @ normal)
        point = start + length[:, None] * way
        inside = length > 0
        for one, other in ((a, b), (b, c), (c, a)):
            inside &= np.cross(other - one, point - one) @ normal >= 0
        nearest[inside] = np.minimum(nearest[inside], length[inside])
    return nearest


def test_a_ray_goes_as_far_as_brute_force_over_all_triangles_says() -> None:
    of, way = ball(2), rays(2000)
    start = np.zeros_like(way)

    fraction, triangle = of.first_met(start, 4 * way)

    expected = nearest_by_brute_force(of, start, way)
    met = np.isfinite(expected)
    assert 200 < met.sum() < 1800
    assert (np.isfinite(fraction) == met).all()
    assert 4 * fraction[met] == pytest.approx(expected[met], abs=1e-12)
    assert ((triangle >= 0) == met).all()
    assert np.isinf(of.hit(start, 1.2 * way)[expected > 1.2]).all()  # segments end before


def test_nothing_shades_itself_from_where_its_points_are_seen() -> None:
    of, way = ball(3), rays(5000)
    fraction, triangle = of.first_met(np.zeros_like(way), way * 9)
    met = triangle >= 0
    point = (9 * fraction[:, None] * way)[met]

    assert np.isinf(of.hit(point, np.zeros_like(point))).all()
    into = point + 2.5 * (CENTRE - point)
    assert (of.hit(point, into) < 1).all()  # through the far side


def test_a_cube_of_triangles_is_seen_and_casts_shadows_as_six_rectangles_do() -> None:
    corners = [[x, y, z] for x, y, z in product((-0.3, 0.3), repeat=3)]
    faces = trimesh.convex.convex_hull(np.array(corners))
    cube = mesh(np.array(faces.vertices) + CENTRE, faces.faces)
    wall = Rectangle.facing(np.array([0.0, 3.0, 0.0]), np.array([0.0, -1.0, 0.0]), size=(4.0, 4.0))
    sides = [
        Rectangle.facing(CENTRE + 0.3 * normal, normal, size=(0.6, 0.6))
        for normal in (*np.eye(3), *-np.eye(3))
    ]
    one, other = scene_of(wall, cube), scene_of(wall, *sides)
    assert one.camera is not None
    directions = camera_rays(one.camera, width=90, height=67)

    by_mesh, by_sides = light_rays(one, directions), light_rays(other, directions)

    assert np.array_equal(by_mesh.surface, np.minimum(by_sides.surface, 1))
    assert (by_mesh.surface == 1).sum() > 100
    shadow = (by_sides.surface == 0) & (by_sides.weight[0] == 0)
    assert shadow.sum() > 100
    differ = ~np.isclose(by_mesh.weight[0], by_sides.weight[0], rtol=1e-9)
    assert differ.mean() < 5e-4  # rays that pass an edge within rounding
    assert by_mesh.delay_s[0] == pytest.approx(by_sides.delay_s[0], rel=1e-9)


def test_a_smooth_sphere_of_triangles_is_as_bright_as_a_sphere() -> None:
    exact = scene_of(Ellipsoid(CENTRE, np.full(3, 0.5)))
    assert exact.camera is not None
    directions = camera_rays(exact.camera, width=81, height=61)

    expected = light_rays(exact, directions)
    smooth = light_rays(scene_of(ball(5, smooth=True)), directions)
    flat = light_rays(scene_of(ball(5)), directions)

    both = (expected.surface == 0) & (smooth.surface == 0)
    assert both.sum() > 300
    bright = expected.weight[0] > 0.5 * expected.weight[0].max()
    off = [
        np.abs(each.weight[0] / np.maximum(expected.weight[0], 1e-9) - 1)[both & bright].max()
        for each in (smooth, flat)
    ]
    assert off[0] < 0.01 < 0.015 < off[1], off
    assert np.abs(smooth.distance_m - expected.distance_m)[both].max() < 5e-3


def test_a_sheet_scatters_on_both_sides_and_the_other_one_is_dark() -> None:
    sheet = mesh([[-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]], [[0, 1, 2], [2, 3, 0]])
    turned = replace(sheet, corners=sheet.corners[:, ::-1])
    directions = unit(np.array([[0.1, 2.0, 0.1]]))

    before = [light_rays(scene_of(each), directions).weight for each in (sheet, turned)]
    behind = light_rays(scene_of(sheet, light_m=(0.6, 4.0, 0.7)), directions).weight

    assert before[0] == pytest.approx(before[1])
    assert before[0] > 0
    assert behind == 0


def test_reflectance_is_interpolated_between_vertices() -> None:
    of = mesh([[0, 1, 0], [1, 1, 0], [0, 1, 1]], [[0, 1, 2]], share=[0.2, 0.6, 1.0])
    point = np.array([[0.25, 1.0, 0.5]])  # 1/4, 1/4, 1/2

    normal, share = of.seen(point, unit(point), np.zeros(1, dtype=np.intp))

    assert share == pytest.approx([0.25 * 0.2 + 0.25 * 0.6 + 0.5 * 1.0])
    assert normal[0] == pytest.approx([0, -1, 0])


def test_a_texture_is_interpolated_between_the_middles_of_its_texels_and_repeats() -> None:
    texture = Texture(np.array([[0.0, 1.0], [0.5, 0.25]], dtype=np.float32))
    u = np.array([0.25, 0.75, 0.25, 0.75, 0.5, 0.0, 1.25])
    v = np.array([0.75, 0.75, 0.25, 0.25, 0.5, 0.75, -0.25])

    share = texture.at(u, v)

    assert share == pytest.approx([0.0, 1.0, 0.5, 0.25, 1.75 / 4, 0.5, 0.0])


def test_a_mesh_is_packed_without_what_embree_made_of_it() -> None:
    of = ball(1)
    start, end = np.zeros((1, 3)), np.array([[0.2, 4.0, -0.4]])
    before = len(pickle.dumps(of))
    expected = of.hit(start, end)

    packed = pickle.dumps(of)

    assert len(packed) == before
    assert pickle.loads(packed).hit(start, end) == expected
