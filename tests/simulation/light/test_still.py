"""The area of a pixel: silhouettes, shadows, edges of colour, and which pixels need more rays."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import Sequence
from transientcam_simulation.effects import Noise
from transientcam_simulation.emulated import find_scene, world_of
from transientcam_simulation.light import _still as module
from transientcam_simulation.light._followed import FollowedRays
from transientcam_simulation.light._paths import Lit, light_rays
from transientcam_simulation.light._rays import RAYS, RAYS_AT_EDGES, rays_within
from transientcam_simulation.light._still import StillLight
from transientcam_simulation.scene import (
    Ellipsoid,
    Light,
    Motion,
    Rectangle,
    Scene,
    Surface,
    Viewpoint,
)
from transientcam_simulation.scene._scene import Transport

WIDTH, HEIGHT = 60, 44
NOISE = Noise(1e5, 0.0, 900.0, 1)


def v(*values: float) -> NDArray[np.float64]:
    return np.array(values, dtype=np.float64)


def board(x: float, y: float, width: float, albedo: float) -> Surface:
    shape = Rectangle.facing(v(x, y, 0), v(0, -1, 0.02), size=(width, 1.1))
    return Surface("board", "diffuse", shape, albedo)


def rays_in(of: Scene, pixel: NDArray[np.intp], *count: int) -> NDArray[np.float64]:
    assert of.camera is not None
    return rays_within(of.camera, pixel, *count, width=WIDTH, height=HEIGHT)


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
    every = light_rays(of, rays_in(of, np.arange(WIDTH * HEIGHT), 512))

    assert 0 < still.mixed.size < 0.35 * WIDTH * HEIGHT
    for frequency_hz in (0.0, 69e6):
        expected = every.moments(frequency_hz, None).reshape(-1, HEIGHT, WIDTH).mean(axis=0)
        deviation = NOISE.deviation(np.abs(expected), 0.0)
        error = np.abs(still.phasors(frequency_hz)[1] - expected) / deviation
        assert error.max() < 0.6
        centres = still.lit.moments(frequency_hz, None).reshape(HEIGHT, WIDTH)
        assert (np.abs(centres - expected) / deviation).max() > 5


def test_only_edges_that_a_ray_counts_at_take_more_rays() -> None:
    of = SCENES["two colours side by side"]

    def rays_a_pixel(noise: Noise) -> list[int]:
        still = StillLight(of, width=WIDTH, height=HEIGHT, noise=noise, highest_hz=69e6)
        assert sum(each.pixel.size for each in still.fine) == still.mixed.size
        return [len(each.rays.surface) // each.pixel.size for each in still.fine]

    assert rays_a_pixel(Noise(1e5, 0.0, 9e6, 1)) == [RAYS]
    assert rays_a_pixel(NOISE) == [RAYS, RAYS_AT_EDGES[0]]


def test_large_images_take_fewer_rays_in_each_pixel(monkeypatch: pytest.MonkeyPatch) -> None:
    def rays_in_all() -> list[int]:
        of = SCENES["two colours side by side"]
        quiet = Noise(1e9, 0.0, 0.0, 20)
        still = StillLight(of, width=WIDTH, height=HEIGHT, noise=quiet, highest_hz=69e6)
        return [len(each.rays.surface) for each in still.fine]

    *_, every = rays_in_all()
    monkeypatch.setattr(module, "MOST_RAYS", every // 3)
    *_, fewer = rays_in_all()

    assert fewer == every // 4


def test_edges_along_a_pixel_are_resolved_as_finely_as_it_has_rays() -> None:
    rays = rays_in(scene(WALL), np.array([HEIGHT // 2 * WIDTH + WIDTH // 2]))

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
        shared_light = shared.within(pixel).rays

        alone = light_rays(of, rays_in(of, pixel))
        for name in Lit.__slots__:
            np.testing.assert_array_equal(getattr(shared_light, name), getattr(alone, name))


def rod(x: float, z: float, size: tuple[float, float], y: float = 1.0) -> Surface:
    """A plate that is thinner than a pixel, of 12 mm at 1 m."""
    return Surface("rod", "diffuse", Rectangle.facing(v(x, y, z), v(0, -1, 0.02), size=size), 0.9)


SPINDLE = Surface("spindle", "diffuse", Ellipsoid(v(0.1, 1, 0.0), v(0.002, 0.002, 0.2)), 0.9)
MIRROR = Surface(
    "mirror", "mirror", Rectangle.facing(v(0.3, 1.6, 0), v(-0.6, -1, 0), size=(0.5, 0.9)), 0.9
)
THIN = {
    "level, before a wall": scene(WALL, rod(0.0, 0.031, (0.4, 0.003))),
    "upright, before nothing": scene(rod(0.007, 0.0, (0.003, 0.3))),
    "tapered": scene(WALL, SPINDLE),
    "its shadow alone": scene(WALL, rod(0.27, 0.1, (0.003, 0.3), y=0.4)),
    "in a mirror": scene(WALL, MIRROR, rod(-0.25, 0.0, (0.003, 0.3), y=1.2)),
    "a plate from its side": scene(
        WALL,
        Surface(
            "plate",
            "diffuse",
            Rectangle.facing(v(0.05, 1.0, 0), v(-1, 0.06, 0), size=(0.1, 0.3)),
            1.0,
        ),
    ),
}


@pytest.mark.parametrize("name", list(THIN))
def test_what_is_thinner_than_a_pixel_takes_its_share_of_those_it_crosses(name: str) -> None:
    of = THIN[name]
    still = StillLight(of, width=WIDTH, height=HEIGHT, noise=NOISE, highest_hz=69e6)
    every = light_rays(of, rays_in(of, np.arange(WIDTH * HEIGHT), 1024))
    expected = every.moments(0.0, None).real.reshape(-1, WIDTH * HEIGHT).mean(axis=0)
    bare = light_rays(replace(of, surfaces=of.surfaces[:-1]), still.rays)
    crossed = np.abs(bare.moments(0.0, None).real - expected)

    found = still.phasors(0.0)[1].ravel()
    assert crossed.sum() > 0
    assert np.abs(found - expected).sum() < 0.07 * crossed.sum()
    centres = still.lit.moments(0.0, None).real
    assert np.abs(centres - expected).sum() > 0.2 * crossed.sum()


def test_what_is_thin_but_far_behind_takes_no_more_rays() -> None:
    hidden = scene(WALL, rod(0.0, 0.031, (0.4, 0.003), y=3.0))
    still = StillLight(hidden, width=WIDTH, height=HEIGHT, noise=NOISE, highest_hz=69e6)
    assert still.mixed.size == 0


def test_explanations_name_what_moves_and_is_thinner_than_a_pixel() -> None:
    motion = Motion(np.array([[0.0, 0, 0], [0.1, 0, 0.05]]), 8.0, "back")
    thin = replace(rod(0.0, 0.1, (0.4, 0.003)), motions=(motion,))
    wide = replace(board(0.1, 1.5, 0.4, 0.5), motions=(motion,))
    sequence = Sequence(harmonics=1, zeroth="estimated", exposure_s=5e-4)

    def reason(*surfaces: Surface) -> str:
        of = replace(scene(*surfaces), transport=Transport(diffuse_bounces=0))
        world = world_of(of, width=WIDTH, height=HEIGHT, readout_s=4e-3)
        effects = {each.effect: each for each in world.explain("test", sequence).effects}
        return effects["mixed-pixels"].reason

    assert reason(WALL, wide, thin).endswith("too thin for a share, as it moves: rod")
    assert "thin" not in reason(WALL, wide)
