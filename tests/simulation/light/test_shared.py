"""Cameras in front of the same scene share what was found of its light, and nothing else."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from transientcam_driver import Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_simulation.emulated import find_scene
from transientcam_simulation.light import LightRequirements, shared_scenery

SIZE = {"width": 40, "height": 30}


def test_scenes_that_differ_in_nothing_that_light_depends_on_are_one() -> None:
    scene = find_scene("mirrors")
    one = shared_scenery(scene, **SIZE)
    assert shared_scenery(replace(scene, seed=9, effects={"shot-noise": "off"}), **SIZE) is one
    assert shared_scenery(find_scene("mirrors"), **SIZE) is one


@pytest.mark.parametrize("size", [{"width": 41, "height": 30}, {"width": 640, "height": 480}])
def test_another_sensor_sees_another_view(size: dict[str, int]) -> None:
    scene = find_scene("mirrors")
    assert shared_scenery(scene, **size) is not shared_scenery(scene, **SIZE)


def test_a_surface_that_lies_elsewhere_is_another_scene() -> None:
    scene = find_scene("mirrors")
    fewer = replace(scene, surfaces=scene.surfaces[1:])
    assert shared_scenery(fewer, **SIZE) is not shared_scenery(scene, **SIZE)


def test_large_sensors_share_nothing() -> None:
    scene = find_scene("mirrors")
    large = {"width": 640, "height": 480}
    assert shared_scenery(scene, **large) is not shared_scenery(scene, **large)


def test_what_is_not_shared_is_freed_at_once_without_the_garbage_collector() -> None:
    large = {"width": 320, "height": 240}
    scenery = shared_scenery(find_scene("wall"), **large)
    scenery.view(LightRequirements(highest_hz=92e6))
    scenery.facts.changes("mixed-pixels", (23e6, 92e6))
    freed = weakref.ref(scenery), weakref.ref(scenery.facts)
    gc.disable()
    try:
        del scenery
        assert [each() for each in freed] == [None, None]
    finally:
        gc.enable()


def test_images_do_not_depend_on_what_other_cameras_did_before() -> None:
    def images(*before: Sequence) -> list[np.ndarray]:
        with open_camera("sim:wall?seed=3", clock=VirtualClock()) as camera:
            for sequence in before:
                camera.configure(sequence)
            camera.configure(Sequence(harmonics=2))
            camera.start()
            return list(camera.read_frame().images)

    first = images()
    assert np.array_equal(first, images(Sequence(harmonics=5), Sequence(exposure_s=1e-4)))
    assert np.array_equal(first, images())
