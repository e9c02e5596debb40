"""Light between surfaces over mirrors: in a closed room, and against a path tracer."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.simulation.path_tracer import Tracer
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._paths import light_rays
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import rays_through
from transientcam_simulation.scene import Scene, parse_scene

SIZE = 163, 120
PIXEL = np.arange(300, 163 * 120, 1500)
FREQUENCIES_HZ = np.array([0.0, 23e6, 138e6])

HEAD = """
    name = "a test's"
    [camera]
    look_at_m = [0.0, 2.0, 0.0]
    field_of_view_deg = 40.0
    [light]
    position_m = [0.05, 0.0, 0.1]
    aim_at_m = [0.0, 2.0, 0.0]
    electrons_per_s = 6e7
"""
MATT, MIRROR = 'kind = "diffuse"\nalbedo = 0.5', 'kind = "mirror"\nreflectivity = 0.9'


def room(*mirrors: tuple[int, int, int]) -> Scene:
    """A closed cube with sides of 2 m, some of whose walls are mirrors."""
    ways = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
    walls = "".join(
        f"""
        [[surface]]
        centre_m = {[float(each) for each in way]}
        normal = {[-float(each) for each in way]}
        size_m = [2.0, 2.0]
        {MIRROR if way in mirrors else MATT}"""
        for way in ways
    )
    return parse_scene(f"{HEAD}[transport]\npatches = 8\n{walls}")


def straight_and_over(exchange: Exchange) -> list[NDArray[np.float64]]:
    """What patches see of others straight, and over mirrors."""
    over, count = exchange.over_mirrors, len(exchange.patches)
    return [exchange.factors.sum(axis=1), np.bincount(over.to, over.factors, count)]


def test_in_a_closed_room_patches_see_others_in_every_direction() -> None:
    """What a mirror hides of the room behind it, it shows, once dimmed; two in an edge twice."""
    one = Exchange.of(room((0, 1, 0)), 8, mirrors=True)
    straight, shown = straight_and_over(one)
    assert straight + shown / 0.9 == pytest.approx(1, abs=0.02)
    assert shown.max() > 0.3

    two = Exchange.of(room((0, 1, 0), (1, 0, 0)), 8, mirrors=True)
    straight, shown = straight_and_over(two)
    assert (straight + shown / 0.9 <= 1.02).all()
    assert (straight + shown / 0.9**2 >= 0.98).all()


def test_light_over_a_mirror_takes_the_whole_way() -> None:
    exchange = Exchange.of(room((0, 1, 0)), 8, mirrors=True)

    over, patches = exchange.over_mirrors, exchange.patches
    image = patches.centre * [1, -1, 1] + [0, 2, 0]
    expected = np.linalg.norm(image[over.by] - patches.centre[over.to], axis=1)
    assert over.distance_m == pytest.approx(expected, rel=1e-6)


def test_walls_see_each_other_and_themselves_in_mirrors() -> None:
    """Two that face each other aslant, on a mirror and before another, past a board."""
    scene = parse_scene(
        f"""{HEAD}
        [transport]
        patches = 12
        mirror_bounces = 2
        [[surface]]
        kind = "diffuse"
        centre_m = [-0.7, 2.0, 0.1]
        normal = [0.7, -0.7, -0.2]
        size_m = [1.9, 1.2]
        albedo = 0.8
        [[surface]]
        kind = "diffuse"
        centre_m = [0.7, 2.0, 0.1]
        normal = [-0.7, -0.7, -0.2]
        size_m = [1.9, 1.2]
        albedo = 0.6
        [[surface]]
        kind = "mirror"
        centre_m = [0.0, 1.5, -0.6]
        normal = [0.0, 0.0, 1.0]
        size_m = [3.0, 2.4]
        reflectivity = 0.8
        [[surface]]
        kind = "mirror"
        centre_m = [-1.0, 1.0, 0.0]
        normal = [1.0, 0.3, 0.0]
        size_m = [0.8, 1.2]
        reflectivity = 0.9
        [[surface]]
        kind = "diffuse"
        centre_m = [0.0, 1.3, -0.5]
        normal = [0.0, 0.0, -1.0]
        size_m = [0.5, 0.4]
        albedo = 0.4"""
    )
    assert scene.camera is not None
    rows, columns = np.divmod(PIXEL, SIZE[0])
    lit = light_rays(
        scene, rays_through(scene.camera, columns, rows, width=SIZE[0], height=SIZE[1])
    )
    straight, found = (
        Interreflection(
            scene, lit, width=len(PIXEL), height=1, exchange=Exchange.of(scene, 12, mirrors=mirrors)
        )
        for mirrors in (False, True)
    )
    moments = np.array([found.moments(f).ravel() for f in FREQUENCIES_HZ])

    once = replace(scene, transport=replace(scene.transport, diffuse_bounces=0))
    every, direct = (
        Tracer(each, SIZE).moments(PIXEL, FREQUENCIES_HZ, paths=256) for each in (scene, once)
    )
    further = every - direct
    error = np.sqrt(np.var(further, axis=0, ddof=1) / len(further))
    apart, light = np.abs(moments - further.mean(axis=0)), np.abs(further[:, 0]).max()
    assert error.max() < 0.03 * light
    # but for pixels at an edge, of which the tracer sees all and a ray one side, or a crease
    assert np.quantile(apart, 0.7, axis=1).max() < 0.03 * light
    assert np.abs(straight.moments(0.0)).mean() < 0.9 * np.abs(moments[0]).mean()


def test_the_history_of_a_patch_holds_what_comes_over_mirrors() -> None:
    """Its sum over time is the irradiance over the same bounces."""
    scene = room((0, 1, 0))
    scene = replace(scene, transport=replace(scene.transport, diffuse_bounces=2))
    exchange = Exchange.of(scene, 4, mirrors=True)

    _, history = exchange.history
    np.testing.assert_allclose(history.sum(axis=1), exchange.irradiance(0.0, 2).real, rtol=1e-4)
