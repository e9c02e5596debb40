"""Patches that are smaller where light changes, against equal ones and a path tracer."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulation.path_tracer import Tracer
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._graded import graded
from transientcam_simulation.light._paths import light_rays
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import rays_through
from transientcam_simulation.scene import Rectangle, Scene, parse_scene

SIZE = 163, 120


def stair(*, patches: int) -> Scene:
    """A long step: patches as wide as it is high are too coarse for its crease."""
    return parse_scene(f"""
        name = "a test's"
        [camera]
        look_at_m = [0.0, 2.0, -0.2]
        field_of_view_deg = 20.0
        [light]
        position_m = [0.05, 0.0, 0.1]
        aim_at_m = [0.0, 2.0, -0.2]
        electrons_per_s = 6e7
        [transport]
        patches = {patches}
        [[surface]]
        kind = "diffuse"
        centre_m = [0.0, 2.0, -0.2]
        normal = [0.0, -1.0, 0.0]
        size_m = [2.4, 0.2]
        albedo = 0.7
        [[surface]]
        kind = "diffuse"
        centre_m = [0.0, 1.85, -0.3]
        normal = [0.0, 0.0, 1.0]
        size_m = [2.4, 0.3]
        albedo = 0.7""")


def test_light_in_a_crease_is_that_of_a_path_tracer() -> None:
    """Near the crease, where so many equal patches are far off."""
    scene = stair(patches=12)
    assert scene.camera is not None
    rows = np.arange(65, 94, 2)  # down the riser and over the tread, in the middle
    pixel = rows * SIZE[0] + 80
    rays = rays_through(scene.camera, np.full(len(rows), 80), rows, width=SIZE[0], height=SIZE[1])
    lit = light_rays(scene, rays)
    assert set(lit.surface) == {0, 1}

    once = replace(scene, transport=replace(scene.transport, diffuse_bounces=0))
    every, direct = (
        Tracer(each, SIZE).moments(pixel, np.array([0.0]), paths=512).mean(axis=0)[0].real
        for each in (scene, once)
    )
    expected = every - direct
    equal, fine = (
        Interreflection(scene, lit, width=len(rows), height=1, exchange=each).moments(0.0)[0].real
        for each in (Exchange.of(scene, 12), graded(scene, 12))
    )
    of_equal, of_fine = (np.abs(each - expected).max() / expected.max() for each in (equal, fine))
    assert of_fine < 0.08
    assert of_equal > 2 * of_fine


@pytest.mark.parametrize("patches", [6, 24])
def test_there_are_at_most_eight_times_as_many_patches_as_the_scene_says(patches: int) -> None:
    scene = stair(patches=patches)

    count = len(graded(scene, patches).patches)
    assert count <= 8 * len(Exchange.of(scene, patches).patches)


def test_where_light_changes_evenly_patches_stay_as_they_are() -> None:
    """Far apart, so that no light to speak of is given."""
    scene = stair(patches=12)
    tread = scene.surfaces[1]
    assert isinstance(tread.shape, Rectangle)
    far = replace(tread, shape=tread.shape.moved(np.array([0.0, 0.0, -40.0])))
    scene = replace(scene, surfaces=(scene.surfaces[0], far))

    assert len(graded(scene, 12).patches) == 2 * 12 * 3
