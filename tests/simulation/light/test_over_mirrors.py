"""Light between surfaces over mirrors, against a path tracer that shares no code with it."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulation.path_tracer import Tracer
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._paths import light_rays
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import rays_through
from transientcam_simulation.scene import Scene, parse_scene

SIZE = 163, 120
PIXEL = np.arange(300, 163 * 120, 1500)
FREQUENCIES_HZ = np.array([0.0, 23e6, 138e6])


def niche(*, mirrors: int, shade: bool = False) -> Scene:
    """Two walls that face each other aslant, on a mirror, and before another one on the left."""
    floor = """
        [[surface]]
        kind = "mirror"
        centre_m = [0.0, 1.5, -0.6]
        normal = [0.0, 0.0, 1.0]
        size_m = [3.0, 2.4]
        reflectivity = 0.8"""
    left = """
        [[surface]]
        kind = "mirror"
        centre_m = [-1.0, 1.0, 0.0]
        normal = [1.0, 0.3, 0.0]
        size_m = [0.8, 1.2]
        reflectivity = 0.9"""
    board = """
        [[surface]]
        kind = "diffuse"
        centre_m = [0.0, 1.3, -0.5]
        normal = [0.0, 0.0, -1.0]
        size_m = [0.5, 0.4]
        albedo = 0.4"""
    return parse_scene(f"""
        name = "a test's"
        [camera]
        look_at_m = [0.0, 2.0, 0.0]
        field_of_view_deg = 40.0
        [light]
        position_m = [0.05, 0.0, 0.1]
        aim_at_m = [0.0, 2.0, 0.0]
        electrons_per_s = 6e7
        [transport]
        patches = 12
        mirror_bounces = {mirrors}
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
        {floor}{left}{board if shade else ""}""")


@pytest.mark.parametrize(
    "scene", [niche(mirrors=1), niche(mirrors=2), niche(mirrors=1, shade=True)]
)
def test_walls_see_each_other_and_themselves_in_mirrors(scene: Scene) -> None:
    assert scene.camera is not None
    rows, columns = np.divmod(PIXEL, SIZE[0])
    rays = rays_through(scene.camera, columns, rows, width=SIZE[0], height=SIZE[1])
    found = Interreflection(scene, light_rays(scene, rays), width=len(PIXEL), height=1)
    moments = np.array([found.moments(f).ravel() for f in FREQUENCIES_HZ])

    once = replace(scene, transport=replace(scene.transport, diffuse_bounces=0))
    every, straight = (
        Tracer(each, SIZE).moments(PIXEL, FREQUENCIES_HZ, paths=512) for each in (scene, once)
    )
    further = every - straight
    error = np.sqrt(np.var(further, axis=0, ddof=1) / len(further))
    apart, light = np.abs(moments - further.mean(axis=0)), np.abs(further[:, 0]).max()
    assert error.max() < 0.015 * light
    # but for pixels at an edge, of which the tracer sees all and a ray one side, or a crease
    assert np.quantile(apart, 0.7, axis=1).max() < 0.025 * light
    without = Interreflection(
        replace(scene, transport=replace(scene.transport, mirror_bounces=0)),
        light_rays(scene, rays),
        width=len(PIXEL),
        height=1,
    )
    assert np.abs(without.moments(0.0)).mean() < 0.9 * np.abs(moments[0]).mean()


def test_the_history_of_a_patch_holds_what_comes_over_mirrors() -> None:
    """Its sum over time is the irradiance over the same bounces."""
    scene = niche(mirrors=1)
    scene = replace(scene, transport=replace(scene.transport, diffuse_bounces=2))
    exchange = Exchange.of(scene, 6)

    _, history = exchange.history
    np.testing.assert_allclose(history.sum(axis=1), exchange.irradiance(0.0, 2).real, rtol=1e-4)
