"""A camera or a lamp that moves, against still scenes with these where they are at that time."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver.sequence import Sequence
from transientcam_simulation.effects import Noise
from transientcam_simulation.emulated import find_scene, world_of
from transientcam_simulation.emulated._build import scenery_of
from transientcam_simulation.imaging import World
from transientcam_simulation.light import LightRequirements, View
from transientcam_simulation.light._paths import camera_of, light_rays
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import camera_rays, rays_through
from transientcam_simulation.scene import BUILT_IN, Scene, parse_scene

WIDTH, HEIGHT = 82, 60
SIZE = {"width": WIDTH, "height": HEIGHT}
AT_S = 1.3  # 0.65 of the period below
HEAD = """
[[motion]]
name = "head"
path_m = [[0, 0, 0], [0.2, 0.1, 0.1]]
rotation_deg = [[0, 0, 0], [3, 4, 8]]
period_s = 2
"""
ROOM = """
[light]
electrons_per_s = 1e7
position_m = [0.05, 0, 0.02]
aim_at_m = [0, 3, 0]
beam_exponent = 2
[camera]
[transport]
diffuse_bounces = 0
[[surface]]
kind = "diffuse"
centre_m = [0, 3, 0]
normal = [0, -1, 0]
size_m = [12, 12]
albedo = 0.5
"""


def riding(text: str, *, on: tuple[str, ...] = ("camera", "light"), motion: str = HEAD) -> Scene:
    """Return a scene whose camera, lamp or both move."""
    for table in on:
        text = text.replace(f"[{table}]", f'[{table}]\nmotion = "head"')
    return parse_scene(text + motion)


def built_in(name: str) -> str:
    text = (BUILT_IN / f"{name}.toml").read_text()
    return text.replace(f'name = "{name}"', 'name = "mine"')


def standing(scene: Scene, time_s: float) -> Scene:
    """Return a scene in which nothing moves, as it is at a time."""
    still = scene.at(time_s)
    assert not still.moves
    return still


def view_of(scene: Scene, time_s: float, *effects: str, noise: Noise | None = None) -> View:
    wanted = LightRequirements(frozenset(effects), highest_hz=69e6)
    wanted = wanted if noise is None else replace(wanted, noise=noise)
    return scenery_of(scene, **SIZE).view(wanted).at(time_s)


@pytest.mark.parametrize("name", ["wall", "cornell", "mirrors", "translucent"])
def test_what_a_moving_camera_sees_is_the_still_scene_with_the_camera_there(name: str) -> None:
    scene, effects = riding(built_in(name)), ("mirror-paths", "scattering")

    seen, wanted = (view_of(of, AT_S, *effects) for of in (scene, standing(scene, AT_S)))

    for frequency_hz in (0.0, 69e6):
        moments, expected = (each.moments(frequency_hz, None) for each in (seen, wanted))
        off = np.abs(moments - expected) / np.abs(expected).max()
        assert np.median(off) < 1e-6  # in single precision
        # a ray that just grazes an edge may fall on either side of it
        assert np.mean(off > 1e-4) < 3e-3
    assert np.mean(np.abs(seen.reflectance() - wanted.reflectance()) > 1e-6) < 3e-3


@pytest.mark.parametrize("on", [("light",), ("camera",)])
def test_lamp_and_camera_may_move_each_by_itself(on: tuple[str, ...]) -> None:
    scene = riding(ROOM, on=on)
    rest, there = scene.at(0.0), standing(scene, AT_S)

    seen, wanted = (view_of(of, AT_S).moments(69e6, None) for of in (scene, there))

    assert np.abs(seen - wanted).max() < 3e-6 * np.abs(wanted).max()  # in single precision
    lamp_m = np.linalg.norm(there.light.position_m - rest.light.position_m)
    eye_m = np.linalg.norm(camera_of(there).position_m - camera_of(rest).position_m)
    assert bool(lamp_m > 0.1) == ("light" in on)
    assert bool(eye_m > 0.1) == ("camera" in on)


def test_a_lamp_that_rides_on_the_camera_keeps_its_place_before_it() -> None:
    scene = riding(ROOM)
    lenses = [
        camera_of(there).as_lens(there.light.position_m, **SIZE)
        for there in (scene.at(0.0), scene.at(AT_S))
    ]

    assert lenses[1].light_x_m == pytest.approx(lenses[0].light_x_m)
    assert lenses[1].light_y_m == pytest.approx(lenses[0].light_y_m)
    assert lenses[1].light_z_m == pytest.approx(lenses[0].light_z_m, abs=1e-12)


def test_edges_before_a_moving_camera_are_those_that_many_rays_find() -> None:
    scene = riding(built_in("cornell"))
    noise = Noise(4.5e4, 0.0, 900.0, 1)

    sharp = view_of(scene, AT_S).moments(69e6, None)
    mixed = view_of(scene, AT_S, "mixed-pixels", noise=noise).moments(69e6, None)

    now, total = scene.at(AT_S), np.zeros(WIDTH * HEIGHT, dtype=np.complex128)
    rows, columns = np.divmod(np.arange(WIDTH * HEIGHT), WIDTH)
    places = (2 * np.arange(12) + 1) / 24 - 0.5
    for x in places:
        for y in places:
            rays = rays_through(camera_of(now), columns + x, rows + y, **SIZE)
            total += light_rays(now, rays).moments(69e6, None) / len(places) ** 2
    expected = total.reshape(HEIGHT, WIDTH)
    without, left = (np.abs(each - expected) / np.abs(expected).max() for each in (sharp, mixed))
    edges = without > 0.02
    assert edges.sum() > 200
    assert np.sqrt(np.mean(left[edges] ** 2)) < 0.15 * np.sqrt(np.mean(without[edges] ** 2))
    assert np.mean(left > 0.03) < 0.01


def test_truth_follows_the_camera_in_closed_form() -> None:
    """Towards a wall by 1 m while it turns by 30 degrees."""
    motion = HEAD.replace("[0.2, 0.1, 0.1]", "[0, 2, 0]").replace("[3, 4, 8]", "[0, 0, 60]")
    text = ROOM.replace("[0.05, 0, 0.02]", "[0, 0, 0]")
    scene = riding(text, motion=motion)
    sequence = Sequence(harmonics=1)
    world = world_of(scene, width=61, height=41, readout_s=4e-3)
    world.configure(sequence, sequence.labels)

    truth = world.truth(device_time_s=1.0)

    half = math.tan(math.radians(45 / 2))
    x = half * (2 * (np.arange(61) + 0.5) / 61 - 1)
    # turned to the left: what is right of its axis is nearer
    angle = math.radians(30) - np.arctan(x)
    assert truth.range_m[20] == pytest.approx(2.0 / np.cos(angle), rel=1e-9)
    assert truth.direct_share == pytest.approx(np.ones((41, 61)), rel=1e-6)


def test_light_between_surfaces_is_that_of_the_still_scene() -> None:
    text = built_in("corner").replace("[transport]", "[transport]\ndiffuse_bounces = 2")
    scene = riding(text if "[transport]" in text else text + "[transport]\ndiffuse_bounces = 2\n")
    now = standing(scene, AT_S)
    lit = light_rays(now, camera_rays(camera_of(now), **SIZE))
    more = Interreflection(now, lit, width=WIDTH, height=HEIGHT)

    both, direct = (view_of(scene, AT_S, *of) for of in (("interreflection",), ()))

    for frequency_hz in (0.0, 69e6):
        found = both.moments(frequency_hz, None) - direct.moments(frequency_hz, None)
        expected = more.moments(frequency_hz)
        assert np.abs(expected).max() > 0.02 * np.abs(direct.moments(0.0, None)).max()
        off = np.abs(found - expected) / np.abs(expected).max()
        assert np.sqrt(np.mean(off**2)) < 0.02


def test_a_turning_camera_blurs_its_images_as_the_mean_over_many_instants() -> None:
    post = '[[surface]]\nkind = "diffuse"\ncentre_m = [0, 1.5, 0]\nnormal = [0, -1, 0]\n'
    motion = HEAD.replace("[0.2, 0.1, 0.1]", "[0, 0, 0]").replace("[3, 4, 8]", "[0, 0, 40]")
    scene = riding(ROOM + post + "size_m = [0.4, 0.6]\nalbedo = 0.9\n", motion=motion)
    sequence = Sequence(exposure_s=0.1)
    label = sequence.labels[2]

    def world(blur: str) -> World:
        effects = {"blur": blur, "motion": "on", "mixed-pixels": "on"}
        of = world_of(replace(scene, effects=effects), width=41, height=30, readout_s=4e-3)
        of.configure(sequence, sequence.labels)
        return of

    sharp, instants = world("off"), 64
    offsets_s = ((np.arange(instants) + 0.5) / instants - 0.5) * sequence.exposure_s
    images = [sharp.mean_image_e(label, number=2, device_time_s=0.9 + by_s) for by_s in offsets_s]
    wanted = np.mean(np.array(images, dtype=np.float64), axis=0)

    middle, blurred = (
        world(each).mean_image_e(label, number=2, device_time_s=0.9) for each in ("off", "on")
    )

    left, blurs = (np.abs(each - wanted).max() for each in (blurred, middle))
    assert blurs > 0.03 * wanted.max()
    assert left < 0.25 * blurs


def test_a_view_that_turns_calls_for_motion_and_blur_by_its_pixels() -> None:
    motion = HEAD.replace("[0.2, 0.1, 0.1]", "[0, 0, 0]").replace("[3, 4, 8]", "[0, 0, 90]")
    scene = riding(built_in("cornell"), motion=motion)
    facts = scenery_of(scene, **SIZE).facts
    assert facts is not None

    # 45 degrees a second over the pixels of 40 degrees
    assert facts.pixels_per_s == pytest.approx(45 / 40 * WIDTH)
    calls = world_of(scene, **SIZE, readout_s=4e-3).calls(Sequence(harmonics=2))
    assert calls["motion"].called
    still = world_of(find_scene("cornell"), **SIZE, readout_s=4e-3).calls(Sequence(harmonics=2))
    assert not still["motion"].called


def test_what_a_mirror_shows_moves_with_the_camera_too() -> None:
    scene = riding(built_in("hall"))
    assert any(each.kind == "mirror" for each in scene.surfaces)

    seen, wanted = (
        view_of(of, AT_S, "mirror-paths").moments(23e6, None)
        for of in (scene, standing(scene, AT_S))
    )

    off: NDArray[np.float64] = np.abs(seen - wanted) / np.abs(wanted).max()
    assert np.mean(off > 1e-5) < 3e-3
