"""Moving light against tracing everything anew."""

from dataclasses import replace

import numpy as np
import pytest

from transientcam_driver.simulation.build import find_scene
from transientcam_driver.simulation.light.moving import MovingLight
from transientcam_driver.simulation.light.paths import camera_rays, trace
from transientcam_driver.simulation.scene.geometry import Rectangle
from transientcam_driver.simulation.scene.scene import Scene

WIDTH, HEIGHT = 82, 60


def moving(scene: Scene) -> MovingLight:
    assert scene.camera is not None
    rays = camera_rays(scene.camera, width=WIDTH, height=HEIGHT)
    return MovingLight(scene, rays, width=WIDTH, height=HEIGHT)


def with_a_moving_board() -> Scene:
    visitor = find_scene("visitor")
    board = Rectangle.facing(np.array([0.0, 1.4, 0.1]), np.array([0.1, -1, 0]), size=(0.4, 0.3))
    body = visitor.surfaces[4]
    return replace(visitor, surfaces=(*visitor.surfaces[:3], replace(body, shape=board)))


@pytest.mark.parametrize("name", ["visitor", "board"])
def test_what_moves_gives_the_same_light_as_tracing_all_of_the_scene(name: str) -> None:
    scene = find_scene("visitor") if name == "visitor" else with_a_moving_board()
    light = moving(scene)
    for time_s in (0.0, 2.5, 5.0, 8.0, 12.0, 16.5):
        now = light.at(time_s)
        whole = trace(scene.at(time_s), width=WIDTH, height=HEIGHT)

        for frequency_hz in (0.0, 69e6):
            there, expected = now.moments(frequency_hz), whole.moments(frequency_hz)
            # a ray that just grazes a silhouette may fall on either side of it
            assert np.mean(np.abs(there - expected) > 1e-5) < 1e-3
        weight = now.returns()[1].sum(axis=0)
        assert np.mean(np.abs(weight - whole.returns()[1].sum(axis=0)) > 1e-5) < 1e-3


def test_nothing_moves_by_more_than_a_pixel_in_one_step() -> None:
    scene = find_scene("visitor")
    light = moving(scene)
    pixel_rad = np.radians(40) / WIDTH
    for surface in scene.surfaces:
        for time_s in np.linspace(0, 23, 60):
            here, there = surface.at(time_s).shape, surface.at(time_s + light.step_s).shape
            way_m = np.linalg.norm(there.box[0] - here.box[0])
            assert way_m < 1.2 * pixel_rad * 1.6 or way_m > 1  # it may jump back to the start


def test_time_is_cut_into_steps() -> None:
    light = moving(find_scene("visitor"))

    assert light.tick_s(10 * light.step_s) == pytest.approx(10 * light.step_s)
    assert light.tick_s(10.9 * light.step_s) == pytest.approx(10 * light.step_s)
