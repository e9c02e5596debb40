"""Sizes of light that is not followed, against a path tracer that shares no code with it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.simulation.path_tracer import Tracer
from transientcam_driver import Sequence
from transientcam_simulation.emulated import world_of
from transientcam_simulation.light._missing import SampledWays
from transientcam_simulation.light._rays import rays_through
from transientcam_simulation.scene import Mesh, Scene, parse_scene
from transientcam_simulation.scene._motion import Motion

SIZE = 163, 120
PIXEL = np.arange(300, 163 * 120, 2700)
FREQUENCIES_HZ = (23e6, 69e6)
KINDS = ("mirrors-between", "gloss-of-surroundings", "further-bounces")


def room(floor: str, *, transport: str = "") -> Scene:
    """A wall that leans over a floor, and would see itself in it."""
    return parse_scene(f"""
        name = "a test's"
        [camera]
        look_at_m = [0.0, 2.0, -0.3]
        field_of_view_deg = 40.0
        [light]
        position_m = [0.05, 0.0, 0.1]
        aim_at_m = [0.0, 2.0, 0.0]
        electrons_per_s = 6e7
        [transport]
        patches = 16
        {transport}
        [[surface]]
        kind = "diffuse"
        centre_m = [0.0, 2.2, 0.0]
        normal = [0.0, -1.0, -0.6]
        size_m = [4.0, 1.6]
        albedo = 0.7
        [[surface]]
        centre_m = [0.0, 1.6, -0.7]
        normal = [0.0, 0.0, 1.0]
        size_m = [4.0, 1.2]
        {floor}""")


MIRROR = 'kind = "mirror"\nreflectivity = 0.5'
GLOSSY = 'kind = "diffuse"\nalbedo = 0.0\ngloss = 0.4\ngloss_exponent = 200'
MATT = 'kind = "diffuse"\nalbedo = 0.5'
PANE = 'kind = "glass"\nalbedo = 0.3\nreflectivity = 0.6'


def sampled(scene: Scene, *, moves: bool = False) -> SampledWays:
    assert scene.camera is not None
    rows, columns = np.divmod(PIXEL, SIZE[0])
    rays = rays_through(scene.camera, columns, rows, width=SIZE[0], height=SIZE[1])
    return SampledWays.of(scene, rays, paths=2048, moves=moves)


def traced(scene: Scene, bounces: int) -> NDArray[np.complex128]:
    scene = replace(scene, transport=replace(scene.transport, diffuse_bounces=bounces))
    tracer = Tracer(scene, SIZE)
    return np.asarray(tracer.moments(PIXEL, np.array(FREQUENCIES_HZ), paths=2048).mean(axis=0))


@pytest.mark.parametrize(
    ("scene", "kind"),
    [
        (room(MIRROR), "mirrors-between"),
        (room(GLOSSY), "gloss-of-surroundings"),
        (room(MATT, transport="diffuse_bounces = 0"), "further-bounces"),
    ],
)
def test_light_on_ways_that_are_not_followed_has_the_size_that_a_path_tracer_finds(
    scene: Scene, kind: str
) -> None:
    """In scenes whose light over several surfaces all goes one kind of way."""
    ways = sampled(scene, moves=kind != "further-bounces")

    further = np.abs(traced(scene, 3) - traced(scene, 0)).max(axis=0)
    size = ways.change(kind, FREQUENCIES_HZ)
    assert further.max() > 1e-3
    assert np.linalg.norm(size) == pytest.approx(np.linalg.norm(further), rel=0.1)
    assert np.abs(size - further).max() < 0.15 * further.max()
    assert not any(ways.change(each, (0.0,)).any() for each in KINDS if each != kind)
    assert not ways.followed.any()


def test_light_between_a_mesh_and_a_wall_has_the_size_that_a_path_tracer_finds_of_two_walls() -> (
    None
):
    walls = room(MATT)
    plane = walls.surfaces[0].shape
    triangles = plane.extent()[[[0, 1, 2], [2, 3, 0]]]
    flat = np.ones((2, 3), dtype=np.float32), np.zeros((2, 3, 2), dtype=np.float32)
    mesh = Mesh(triangles, None, *flat, np.full(2, -1, dtype=np.int32))
    surfaces = replace(walls.surfaces[0], shape=mesh), walls.surfaces[1]

    ways = sampled(replace(walls, surfaces=surfaces))

    further = np.abs(traced(walls, 3) - traced(walls, 0)).max(axis=0)
    size = ways.change("between-meshes", FREQUENCIES_HZ)
    assert further.max() > 1e-3
    assert np.linalg.norm(size) == pytest.approx(np.linalg.norm(further), rel=0.1)
    assert not any(ways.change(each, (0.0,)).any() for each in KINDS)
    assert not ways.followed.any()
    assert not sampled(walls).change("between-meshes", FREQUENCIES_HZ).any()


@pytest.mark.parametrize("floor", [MATT, MIRROR, PANE])
def test_light_that_radiosity_follows_is_not_missing(floor: str) -> None:
    scene = room(floor)
    ways = sampled(scene)

    further = np.abs(traced(scene, 3) - traced(scene, 0)).max(axis=0)
    assert ways.followed == pytest.approx(further, rel=0.15, abs=0.1 * further.max())
    assert not any(ways.change(each, (0.0,)).any() for each in KINDS)


def test_patches_are_too_coarse_where_light_changes_within_one() -> None:
    fine = room(MATT)
    coarse = replace(fine, transport=replace(fine.transport, patches=3))

    errors = [sampled(each).change("coarse-patches", FREQUENCIES_HZ) for each in (fine, coarse)]
    assert errors[1].sum() > 3 * errors[0].sum()


def test_what_is_missing_is_called_for_by_its_size_over_the_noise() -> None:
    """A dull floor reflects next to nothing, and what stands still is followed."""

    def missing(scene: Scene, *, moves: bool = True) -> dict[str, float]:
        about = replace(scene.surfaces[0], motions=(Motion(np.eye(3) / 1e3, 9.0),))
        moving = replace(scene, surfaces=(about, *scene.surfaces[1:])) if moves else scene
        world = world_of(moving, width=41, height=30, readout_s=4e-3)
        explained = world.explain("", Sequence(takes=16))
        return {each.effect: each.relative for each in explained.not_made if each.called_for}

    dull = room(GLOSSY.replace("0.4", "0.0001"))
    assert missing(room(GLOSSY))["gloss-of-surroundings"] > 0.1
    assert "gloss-of-surroundings" not in missing(dull)
    assert "gloss-of-surroundings" not in missing(room(GLOSSY), moves=False)
    assert "mirrors-between" not in missing(room(MIRROR), moves=False)
