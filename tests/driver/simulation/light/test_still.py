"""The area of a pixel: silhouettes, shadows, edges of colour, and which pixels need more rays."""

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver.simulation.build import find_scene
from transientcam_driver.simulation.effects.glimpses import Noise
from transientcam_driver.simulation.light.followed import FollowedRays
from transientcam_driver.simulation.light.paths import Lit, light_rays
from transientcam_driver.simulation.light.still import StillLight
from transientcam_driver.simulation.scene.geometry import Rectangle
from transientcam_driver.simulation.scene.scene import Light, Scene, Surface, Viewpoint

WIDTH, HEIGHT = 60, 44
NOISE = Noise(1e5, 0.0, 900.0, 1)


def v(*values: float) -> NDArray[np.float64]:
    return np.array(values, dtype=np.float64)


def board(x: float, y: float, width: float, albedo: float) -> Surface:
    shape = Rectangle.facing(v(x, y, 0), v(0, -1, 0.02), size=(width, 1.1))
    return Surface("board", "diffuse", shape, albedo)


def scene(*surfaces: Surface) -> Scene:
    return Scene(
        name="test",
        description="",
        file=None,
        light=Light(1.0, v(0.3, 0, 0.1), v(0, 2, 0), 0.0),
        camera=Viewpoint(v(0, 0, 0), v(0, 1, 0), 40.0),
        surfaces=surfaces,
    )


WALL = Surface("wall", "diffuse", Rectangle.facing(v(0, 2, 0), v(0, -1, 0), size=(4, 4)), 0.5)
SCENES = {
    "silhouette before nothing": scene(board(0.1, 2.0, 0.6, 0.8)),
    "silhouette and shadow on a wall": scene(WALL, board(0.1, 1.5, 0.4, 0.5)),
    "two colours side by side": scene(board(-0.53, 2.0, 1.1, 0.9), board(0.57, 2.0, 1.1, 0.2)),
}


@pytest.mark.parametrize("name", list(SCENES))
def test_pixels_that_an_edge_crosses_are_the_mean_over_their_area(name: str) -> None:
    of = SCENES[name]
    still = StillLight(of, width=WIDTH, height=HEIGHT, noise=NOISE, highest_hz=69e6)
    every = light_rays(of, still.rays_in(np.arange(WIDTH * HEIGHT)))

    assert 0 < still.mixed.size < 0.35 * WIDTH * HEIGHT
    for frequency_hz in (0.0, 69e6):
        expected = every.moments(frequency_hz, None).reshape(-1, HEIGHT, WIDTH).mean(axis=0)
        deviation = NOISE.deviation(np.abs(expected), 0.0)
        error = np.abs(still.phasors(frequency_hz)[1] - expected) / deviation
        assert error.max() < 0.5
        centres = still.lit.moments(frequency_hz, None).reshape(HEIGHT, WIDTH)
        assert (np.abs(centres - expected) / deviation).max() > 5


def test_edges_along_a_pixel_are_resolved_as_finely_as_it_has_rays() -> None:
    still = StillLight(scene(WALL), width=WIDTH, height=HEIGHT)

    rays = still.rays_in(np.array([HEIGHT // 2 * WIDTH + WIDTH // 2]))

    count = len(rays)
    wide = 2 * np.tan(np.radians(20)) / WIDTH  # of a pixel, on a plane 1 m away
    for axis in (0, 2):
        places = np.sort(rays[:, axis] / rays[:, 1]) / wide
        gaps = np.diff(places)
        assert gaps.max() < 2.7 / count  # a lattice has three gaps, of the golden ratio's powers
        assert places[-1] - places[0] > 1 - 3 / count


def test_a_wall_needs_one_ray_a_pixel() -> None:
    wall = find_scene("wall")
    still = StillLight(wall, width=WIDTH, height=HEIGHT, noise=NOISE, highest_hz=138e6)

    assert still.mixed.size == 0


def test_returns_hold_the_light_of_all_surfaces_in_a_pixel() -> None:
    of = SCENES["silhouette and shadow on a wall"]
    still = StillLight(of, width=WIDTH, height=HEIGHT, noise=NOISE, highest_hz=69e6)

    delay_s, weight = still.responses().returns()

    zeroth = still.phasors(0.0)[0].sum(axis=0)
    assert weight.sum(axis=0) == pytest.approx(zeroth.real, rel=1e-5)
    both = (weight > 0).sum(axis=0) == 2
    assert both.any()
    assert (np.diff(delay_s, axis=0)[0][both] > 2e-9).all()


def test_rays_followed_for_other_pixels_before_change_nothing() -> None:
    of = SCENES["silhouette and shadow on a wall"]
    shared = FollowedRays(of, width=WIDTH, height=HEIGHT)
    still = StillLight(of, width=WIDTH, height=HEIGHT, noise=NOISE, highest_hz=69e6)
    third = still.mixed[::3]

    for pixel in (third, still.mixed[1::2], still.mixed, third):
        shared_light = shared.within(pixel)

        alone = light_rays(of, still.rays_in(pixel))
        for name in Lit.__slots__:
            np.testing.assert_array_equal(getattr(shared_light, name), getattr(alone, name))
