"""Moving light against many rays a pixel, and its continuity over time."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_simulation.emulated import find_scene
from transientcam_simulation.light._layers import MovingResponses
from transientcam_simulation.light._moving import MovingLight
from transientcam_simulation.light._paths import light_rays
from transientcam_simulation.light._rays import camera_rays, rays_through
from transientcam_simulation.light._still import StillLight
from transientcam_simulation.light._time_interpolation import Steps
from transientcam_simulation.light._variants import still_scene
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

WIDTH, HEIGHT = 82, 60
C = 299_792_458.0
V = NDArray[np.float64]


def v(*values: float) -> V:
    return np.array(values, dtype=np.float64)


def moving(scene: Scene, *, soft: bool) -> MovingLight:
    return MovingLight(scene, StillLight(still_scene(scene), width=WIDTH, height=HEIGHT), soft=soft)


def averaged(
    scene: Scene, frequencies_hz: tuple[float, ...], side: int
) -> list[NDArray[np.complex128]]:
    """Mean over many rays in each pixel, traced one by one."""
    assert scene.camera is not None
    rows, columns = np.divmod(np.arange(WIDTH * HEIGHT), WIDTH)
    total = np.zeros((len(frequencies_hz), WIDTH * HEIGHT), dtype=np.complex128)
    offsets = (2 * np.arange(side) + 1) / (2 * side) - 0.5
    for x in offsets:
        for y in offsets:
            rays = rays_through(scene.camera, columns + x, rows + y, width=WIDTH, height=HEIGHT)
            lit = light_rays(scene, rays)
            scatter = lit.scatter(scene)
            total += [lit.moments(frequency_hz, scatter) for frequency_hz in frequencies_hz]
    return list((total / side**2).reshape(-1, HEIGHT, WIDTH))


def with_a_moving(shape: Rectangle | Ellipsoid, path_m: V, *, period_s: float = 10.0) -> Scene:
    """Something before a wall, lit from beside the camera: it throws a shadow."""
    motion = Motion(path_m, period_s)
    wall = Rectangle.facing(v(0, 2, 0), v(0, -1, 0), size=(4, 3))
    return Scene(
        name="test",
        description="",
        file=None,
        light=Light(1.0, v(0.4, 0, 0.1), v(0, 2, 0), 0.0),
        camera=Viewpoint(v(0, 0, 0), v(0, 1, 0), 40.0),
        surfaces=(
            Surface("wall", "diffuse", wall, 0.5),
            Surface("body", "diffuse", shape, 0.8, motions=(motion,)),
        ),
        transport=Transport(diffuse_bounces=0),
    )


BALL = Ellipsoid(v(0.05, 1.3, 0.02), v(0.2, 0.22, 0.25))
BOARD = Rectangle.facing(v(0.02, 1.4, 0.03), v(0.2, -1, 0.1), size=(0.41, 0.32))
ASIDE = v(0, 0, 0, 0.5, 0.1, 0.1).reshape(2, 3)


def test_what_moves_gives_the_same_light_as_tracing_all_of_the_scene() -> None:
    scene = find_scene("visitor")
    light = moving(scene, soft=False)
    assert scene.camera is not None
    rays = camera_rays(scene.camera, width=WIDTH, height=HEIGHT)
    for time_s in (0.0, 5.0, 8.0, 16.5):
        now = light.at(time_s)
        whole = light_rays(scene.at(time_s), rays)

        for frequency_hz in (0.0, 69e6):
            there = now.moments(frequency_hz).ravel()
            expected = whole.moments(frequency_hz, None)
            # a ray that just grazes a silhouette may fall on either side of it
            assert np.mean(np.abs(there - expected) > 1e-3 * np.abs(expected).max()) < 3e-3
        weight = now.returns()[1].sum(axis=0).ravel()
        wrong = np.abs(weight - whole.weight.sum(axis=0)) > 1e-3 * weight.max()
        assert np.mean(wrong) < 3e-3


@pytest.mark.parametrize("shape", [BALL, BOARD])
def test_silhouettes_and_shadows_cover_the_share_of_a_pixel_that_many_rays_find(
    shape: Rectangle | Ellipsoid,
) -> None:
    scene = with_a_moving(shape, ASIDE)
    soft, hard = (moving(scene, soft=soft).at(3.1) for soft in (True, False))

    frequencies_hz = (0.0, 69e6)
    many = averaged(scene.at(3.1), frequencies_hz, 8)
    for frequency_hz, expected in zip(frequencies_hz, many, strict=True):
        contrast = float(np.abs(expected).max())
        error = np.abs(soft.moments(frequency_hz) - expected) / contrast
        without = np.abs(hard.moments(frequency_hz) - expected) / contrast
        edges = without > 0.02
        assert edges.sum() > 50
        assert np.sqrt(np.mean(error[edges] ** 2)) < 0.15 * np.sqrt(np.mean(without[edges] ** 2))
        assert np.mean(error > 0.03) < 0.01


def test_what_a_mirror_shows_covers_the_share_of_a_pixel_that_many_rays_find() -> None:
    scene = with_a_moving(BALL, ASIDE)
    # the ball lies before the camera and a little aside; the mirror shows it from behind
    mirror = Rectangle.facing(v(0.45, 1.6, 0), v(-1, -0.9, 0), size=(0.6, 0.9))
    scene = replace(scene, surfaces=(*scene.surfaces, Surface("mirror", "mirror", mirror, 0.9)))
    (expected,) = averaged(scene.at(3.1), (69e6,), 5)
    assert scene.camera is not None
    ends = light_rays(scene.at(3.1), camera_rays(scene.camera, width=WIDTH, height=HEIGHT))
    shown = (ends.surface == 1) & (ends.distance_m > 1.6)

    error = (
        np.abs(moving(scene, soft=True).at(3.1).moments(69e6) - expected) / np.abs(expected).max()
    )

    assert shown.sum() > 100
    assert np.mean(error.ravel()[shown] > 0.03) < 0.05


def test_range_is_continuous_while_something_comes_nearer() -> None:
    """At 1 cm/s, half a millimetre in 0.05 s; never a jump."""
    plate = Rectangle.facing(v(0, 1.5, 0), v(0, -1, 0), size=(3, 3))
    scene = with_a_moving(plate, v(0, 0, 0, 0, -0.4, 0).reshape(2, 3), period_s=40.0)
    light = moving(scene, soft=True)
    steps = Steps(scene, light.at, pixel_rad=light.still.pixel_rad)
    place = (HEIGHT // 2, WIDTH // 2)

    for of in (light, steps):
        times_s = 2 + 0.05 * np.arange(30)
        phase = [np.angle(of.at(float(t)).moments(23e6)[place]) for t in times_s]
        way_m = np.diff(np.unwrap(phase)) * C / (4 * np.pi * 23e6)

        # camera and lamp look from beside each other: a little less than the way itself
        assert way_m == pytest.approx(np.full(29, way_m.mean()), rel=0.05)
        assert -5e-4 < way_m.mean() < -4.8e-4


def test_a_silhouette_crosses_a_pixel_without_jumps() -> None:
    scene = with_a_moving(BOARD, ASIDE, period_s=2.0)
    light = moving(scene, soft=True)
    steps = Steps(scene, light.at, pixel_rad=light.still.pixel_rad)
    period_s = steps.step_s / 8
    frames = np.array([steps.at(1.0 + k * period_s).moments(0.0).real for k in range(25)])

    change = np.abs(np.diff(frames, axis=0)) / frames.max()
    # an eighth of a pixel at a time: that much of the contrast, and a little more at corners
    assert change.max() < 0.16


def test_light_between_two_steps_is_close_to_the_light_at_that_time() -> None:
    scene = with_a_moving(BALL, ASIDE, period_s=2.0)
    light = moving(scene, soft=True)
    steps = Steps(scene, light.at, pixel_rad=light.still.pixel_rad)

    for part in (0.2, 0.5, 0.7):
        time_s = (40 + part) * steps.step_s
        exact = light.at(time_s).moments(69e6)
        error = np.abs(steps.at(time_s).moments(69e6) - exact) / np.abs(exact).max()
        assert error.max() < 0.05
        assert np.mean(error > 0.01) < 0.009  # of steps by a whole pixel: 0.011 to 0.014


def test_steps_are_long_while_everything_is_slow() -> None:
    path_m = v(0, 0, 0, 0.5, 0, 0, 0.55, 0, 0).reshape(3, 3)  # ten times as slow in the end
    scene = with_a_moving(BALL, path_m, period_s=2.0)
    light = moving(scene, soft=True)
    made: list[float] = []

    def at(time_s: float) -> MovingResponses:
        made.append(time_s)
        return light.at(time_s)

    steps = Steps(scene, at, pixel_rad=light.still.pixel_rad)
    counts = []
    for start_s in (0.3, 1.3):
        made.clear()
        for time_s in np.linspace(start_s, start_s + 24 * steps.step_s, 97):
            steps.at(float(time_s))
        counts.append(len(made))

    assert counts[0] == pytest.approx(25, abs=1)
    assert counts[1] <= 6


def test_fast_motion_is_computed_for_each_image() -> None:
    scene = with_a_moving(BALL, ASIDE, period_s=2.0)
    light = moving(scene, soft=True)
    every_s = Steps(scene, light.at, pixel_rad=light.still.pixel_rad).step_s * 0.7
    steps = Steps(scene, light.at, pixel_rad=light.still.pixel_rad, every_s=every_s)

    assert isinstance(steps.at(0.7), MovingResponses)


def test_a_path_that_starts_again_is_not_interpolated() -> None:
    scene = with_a_moving(BALL, ASIDE, period_s=2.0)
    light = moving(scene, soft=True)
    steps = Steps(scene, light.at, pixel_rad=light.still.pixel_rad)

    before, after = 2.0 - 1e-6, 2.0 + 1e-6

    for time_s in (before, after):
        exact = light.at(time_s).moments(0.0)
        assert steps.at(time_s).moments(0.0) == pytest.approx(exact, abs=1e-6)


def test_what_stands_before_something_that_moves_hides_it() -> None:
    scene = with_a_moving(BALL, ASIDE)
    screen = Rectangle.facing(v(0, 0.8, 0), v(0, -1, 0), size=(2, 2))
    hidden = replace(scene, surfaces=(*scene.surfaces, Surface("screen", "diffuse", screen, 0.3)))

    now = moving(hidden, soft=True).at(1.0)

    assert now.moments(0.0) == pytest.approx(averaged(hidden.at(1.0), (0.0,), 1)[0], rel=1e-5)


def test_what_something_that_moves_hides_wholly_is_not_there() -> None:
    scene = with_a_moving(BOARD, ASIDE)
    behind = Ellipsoid(v(0.03, 1.6, 0.03), v(0.05, 0.05, 0.05))
    hidden = replace(scene.surfaces[1], name="hidden", shape=behind)
    both = replace(scene, surfaces=(*scene.surfaces, hidden))

    returns = moving(both, soft=True).at(1.0).returns()

    expected = moving(scene, soft=True).at(1.0).returns()
    middle = (..., HEIGHT // 2, WIDTH // 2 + 6)
    assert returns[1][middle].sum() == pytest.approx(expected[1][middle].sum(), rel=1e-6)


def turning(shape: Rectangle | Ellipsoid, rotation_deg: V) -> Scene:
    scene = with_a_moving(shape, ASIDE)
    motion = replace(scene.surfaces[1].motions[0], rotation_deg=rotation_deg)
    return replace(
        scene, surfaces=(scene.surfaces[0], replace(scene.surfaces[1], motions=(motion,)))
    )


def test_a_board_that_turns_is_a_still_one_with_that_normal_at_that_time() -> None:
    scene = turning(
        replace(BOARD, normal=v(0, -1, 0), right=v(1, 0, 0), up=v(0, 0, 1)),
        v(0, 0, 0, 0, 0, 60).reshape(2, 3),
    )
    angle = np.radians(60 * 0.31)
    there = Rectangle.facing(
        BOARD.centre + 0.31 * ASIDE[1], v(np.sin(angle), -np.cos(angle), 0), size=(0.41, 0.32)
    )
    body = replace(scene.surfaces[1], shape=there, motions=())
    still = replace(scene, surfaces=(scene.surfaces[0], body))

    found = moving(scene, soft=False).at(3.1)
    for frequency_hz in (0.0, 69e6):
        (wanted,) = averaged(still, (frequency_hz,), 1)
        error = np.abs(found.moments(frequency_hz) - wanted) / np.abs(wanted).max()
        # a ray that just grazes an edge may fall on either side of it
        assert np.median(error) < 1e-6
        assert np.mean(error > 1e-5) < 3e-3


def test_what_turns_rolls_with_its_edges() -> None:
    scene = turning(BOARD, v(0, 0, 0, 0, 90, 0).reshape(2, 3))
    (expected,) = averaged(scene.at(7.0), (0.0,), 8)

    error = np.abs(moving(scene, soft=True).at(7.0).moments(0.0) - expected) / expected.real.max()

    assert np.mean(error > 0.03) < 0.01
    unturned = moving(with_a_moving(BOARD, ASIDE), soft=True).at(7.0).moments(0.0)
    assert np.mean(np.abs(unturned - expected) / expected.real.max() > 0.03) > 0.03


def test_steps_are_so_short_that_corners_of_what_turns_move_by_half_a_pixel() -> None:
    scene = turning(BOARD, v(0, 0, 0, 0, 0, 720).reshape(2, 3))
    light = moving(scene, soft=True)
    steps = Steps(scene, light.at, pixel_rad=light.still.pixel_rad)

    now, later = (scene.surfaces[1].at(t).shape.extent() for t in (3.0, 3.0 + steps.step_s))
    moved_rad = np.linalg.norm(later - now, axis=-1) / np.linalg.norm(now, axis=-1)

    assert 0.2 < moved_rad.max() / light.still.pixel_rad < 0.55
    exact = light.at(3.0 + 0.4 * steps.step_s).moments(69e6)
    between = steps.at(3.0 + 0.4 * steps.step_s).moments(69e6)
    assert np.mean(np.abs(between - exact) > 0.01 * np.abs(exact).max()) < 0.01


def test_a_sphere_that_turns_gives_the_light_of_one_that_does_not() -> None:
    ball = Ellipsoid(BALL.centre, v(0.2, 0.2, 0.2))
    spun, still = turning(ball, v(0, 0, 0, 0, 0, 90).reshape(2, 3)), with_a_moving(ball, ASIDE)

    one, other = (moving(of, soft=True).at(3.1).moments(69e6) for of in (spun, still))

    assert np.array_equal(one, other)
