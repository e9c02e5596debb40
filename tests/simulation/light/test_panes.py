"""Light at panes of glass, against closed forms and a path tracer that shares no code."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.simulation.judge import judge, told
from transientcam_driver import Sequence
from transientcam_simulation.base import Scatter
from transientcam_simulation.emulated import find_scene, world_of
from transientcam_simulation.imaging import World
from transientcam_simulation.light import _paths as paths
from transientcam_simulation.light._followed import FollowedRays
from transientcam_simulation.light._paths import Lit, light_rays
from transientcam_simulation.light._rays import rays_through
from transientcam_simulation.light._still import StillLight
from transientcam_simulation.light._variants import without_glass
from transientcam_simulation.scene import Scene, parse_scene

C = 299_792_458.0
F_HZ = 92e6
AHEAD = np.array([[0.0, 1.0, 0.0]])


def plate(kind: str, centre: str, normal: str, size: str, more: str) -> str:
    return (
        f'[[surface]]\nkind = "{kind}"\ncentre_m = {centre}\nnormal = {normal}\n'
        f"size_m = {size}\n{more}\n"
    )


WALL = plate("diffuse", "[0, 2, 0]", "[0, -1, 0]", "[4, 4]", "albedo = 0.5")
PANE = "[0, 1, 0]", "[0, -1, 0]", "[1, 1]"


def scene(*surfaces: str, lamp: str = "[0, 0, 0]", transport: str = "") -> Scene:
    return parse_scene(f"""
        name = "a test's"
        [light]
        electrons_per_s = 4e7
        position_m = {lamp}
        aim_at_m = [0, 9, 0]
        [transport]
        {transport}
        {"".join(surfaces)}""")


def returns(lit: Lit) -> list[tuple[float, float]]:
    """Ways in m and weights of the light of one ray, the nearest first."""
    there = lit.weight[:, 0] > 0
    found = zip(C * lit.delay_s[there, 0], lit.weight[there, 0], strict=True)
    return sorted((float(way_m), float(weight)) for way_m, weight in found)


def require(found: list[tuple[float, float]], *expected: tuple[float, float]) -> None:
    assert len(found) == len(expected), found
    assert np.array(found) == pytest.approx(np.array(expected), rel=1e-9)


@pytest.mark.parametrize("side", [1, -1])
def test_a_dusty_pane_before_a_wall_gives_two_returns(side: int) -> None:
    """From both sides: light passes the glass twice, each time (n - 1) d later."""
    pane = plate("glass", PANE[0], f"[0, {side}, 0]", PANE[2], "albedo = 0.1\nthickness_m = 0.01")

    lit = light_rays(scene(WALL, pane), AHEAD)

    require(returns(lit), (2, 0.1), (4 + 2 * 0.005, (0.9 * 12 / 13) ** 2 * 0.5 / 4))
    assert lit.surface.tolist() == [0]  # the wall sends more of what falls on it
    assert lit.shown == pytest.approx([0.1 + 0.9 * 12 / 13 * 0.5])


def test_a_half_mirror_shows_what_stands_beside_at_its_distance() -> None:
    pane = plate("glass", PANE[0], "[-1, -1, 0]", PANE[2], "reflectivity = 0.3\nthickness_m = 0.01")
    board = plate("diffuse", "[-1.5, 1, 0]", "[1, 0, 0]", "[0.5, 0.5]", "albedo = 0.8")

    lit = light_rays(scene(WALL, pane, board), AHEAD)

    inside = math.sqrt(1 - 0.5 / 1.5**2)
    later_m = 0.01 * (1.5 * inside - math.sqrt(0.5))
    straight_m = math.hypot(1.5, 1)
    require(
        returns(lit),
        (4 + 2 * later_m, 0.7**2 * 0.5 / 4),
        (2.5 + straight_m, 0.3 * 0.8 * 1.5 / straight_m**3),
        (5, 0.3**2 * 0.8 / 2.5**2),
    )


def test_a_pane_in_the_lamps_way_alone_takes_from_it_and_delays_it() -> None:
    pane = plate("glass", "[1, 1, 0]", "[0.3, -1, 0.1]", "[0.5, 0.5]", "albedo = 0.2")

    (found,) = returns(light_rays(scene(WALL, pane, lamp="[2, 0, 0]"), AHEAD))
    (bare,) = returns(light_rays(scene(WALL, lamp="[2, 0, 0]"), AHEAD))

    ((plane, glass),) = scene(pane).panes
    cosine = abs(np.array([-1, 1, 0]) @ plane.normal) / math.sqrt(2)
    (_mirrored, passed, later_m) = np.array(glass.shares(np.array([cosine])))[:, 0]
    assert found[1] / bare[1] == pytest.approx(passed)
    assert found[0] - bare[0] == pytest.approx(later_m)


def test_what_is_behind_a_pane_is_lit_over_mirrors_through_it() -> None:
    """It stands before the wall, for the mirror as for the camera, and mirrors nothing there."""
    mirror = plate("mirror", "[1.5, 1, 0]", "[-1, 0, 0]", "[3, 1]", "reflectivity = 0.9")
    more = "reflectivity = 0.25\nthickness_m = 0"
    pane = plate("glass", "[0, 1.2, 0]", "[0, -1, 0]", "[4, 4]", more)

    found = returns(light_rays(scene(WALL, mirror, pane), AHEAD))

    far_m = math.hypot(3, 2)
    require(found, (4, 0.75**2 * 0.5 / 4), (2 + far_m, 0.75**2 * 0.9 * 0.5 * 2 / far_m**3))


def test_light_that_enters_what_is_behind_a_pane_spreads_there_alone() -> None:
    wax = WALL.replace("diffuse", "translucent") + "scatter_decay_s = 1e-9\n"
    of = scene(wax, plate("glass", *PANE, "albedo = 0.1\nthickness_m = 0"))

    lit = light_rays(of, AHEAD)
    moment = lit.moments(F_HZ, lit.scatter(of))[0]
    responses = StillLight(of, width=3, height=3).responses()

    omega = 2 * np.pi * F_HZ
    dust = 0.1 * np.exp(1j * omega * 2 / C)
    wall = (0.9 * 12 / 13) ** 2 / 8 * np.exp(1j * omega * 4 / C) / (1 - 1j * omega * 1e-9)
    assert moment == pytest.approx(dust + wall)
    assert responses.moments(F_HZ)[1, 1] == pytest.approx(dust + wall, rel=1e-5)
    spread = lit.scatter(of)
    assert isinstance(spread, Scatter)
    assert sorted(spread.decay_s[:, 0].tolist()) == [0.0, 0.0, 0.0, 0.0, 1e-9, 1e-9]


def test_a_ray_ends_at_its_brightest_places() -> None:
    """Of a stack of dusty panes, more than fit; the wall behind is brightest."""
    panes = [
        plate("glass", f"[0, {0.1 * k + 0.5}, 0]", "[0, -1, 0]", "[1, 1]", "albedo = 0.02")
        for k in range(4)
    ]
    lit = light_rays(scene(WALL, *panes, transport="diffuse_bounces = 0"), AHEAD)

    reflectances = [lit.reflectance[0], *(each.reflectance[0] for each in lit.more)]
    assert reflectances == sorted(reflectances, reverse=True)
    assert len(reflectances) == 8
    assert lit.surface.tolist() == [0]
    assert reflectances[0] == pytest.approx(0.5 * (0.98 * 12 / 13) ** 4)


def test_rays_are_followed_the_same_in_any_blocks_and_pixel_by_pixel(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    of = find_scene("pane")
    assert of.camera is not None
    place = np.random.default_rng(1).uniform(0, [[33], [25]], (2, 500))
    directions = rays_through(of.camera, *place, width=33, height=25)
    whole = light_rays(of, directions)
    pixel = np.arange(80, 300)
    at_once = FollowedRays(of, width=33, height=25).within(pixel)

    monkeypatch.setattr(paths, "_BLOCK", 70)
    in_blocks = light_rays(of, directions)
    apart = FollowedRays(of, width=33, height=25)
    apart.within(pixel[::3])
    in_turn = apart.within(pixel)

    assert len(whole.more) == 2
    assert all((each.reflectance > 0).any() for each in (whole, *whole.more))
    for one, other in ((whole, in_blocks), (at_once.rays, in_turn.rays)):
        pairs = zip((one, *one.more), (other, *other.more), strict=True)
        for a, b in pairs:
            for name in (each for each in Lit.__slots__ if each != "more"):
                assert np.array_equal(getattr(a, name), getattr(b, name)), name


def world(of: Scene, **effects: str) -> World:
    changed = replace(of, effects={**of.effects, **effects})
    made = world_of(changed, width=41, height=30, readout_s=4e-3)
    sequence = Sequence(harmonics=3)
    made.configure(sequence, sequence.labels)
    return made


def images(of: World) -> NDArray[np.generic]:
    labels = Sequence(harmonics=3).labels
    return np.stack([of.image(each, number=each.index, device_time_s=1.0) for each in labels])


def test_off_is_the_scene_without_its_panes() -> None:
    of = find_scene("pane")
    bare = without_glass(of)
    assert [each.name for each in bare.surfaces] == ["wall", "poster"]

    off, without, on = world(of, glass="off"), world(bare), world(of)

    assert np.array_equal(images(off), images(without))
    assert not np.array_equal(images(on), images(without))


def test_a_pane_is_called_for_where_it_is_seen() -> None:
    sequence = Sequence(harmonics=3)
    calls = world(find_scene("pane")).calls(sequence)
    none = world(find_scene("corner")).calls(sequence)
    air = plate("glass", *PANE, "refractive_index = 1")
    nothing = world(scene(WALL, air)).calls(sequence)

    assert calls["glass"].called
    assert calls["mirror-paths"].called
    assert not none["glass"].called
    assert none["glass"].reason == "no pane stands in the scene"
    assert not nothing["glass"].called


def test_the_range_of_a_pixel_is_that_of_what_most_light_comes_from() -> None:
    clean, dusty = (
        world(scene(WALL, plate("glass", *PANE, f"albedo = {share}")), glass="on").truth()
        for share in (0.01, 0.9)
    )
    assert clean.surface is not None
    assert dusty.surface is not None
    at = 15, 20
    assert clean.surface.range_m[at] == pytest.approx(2, abs=0.01)
    assert dusty.surface.range_m[at] == pytest.approx(1, abs=0.01)
    assert clean.surface.direct_share[at] == pytest.approx(
        (0.99 * 12 / 13) ** 2 / 8 / ((0.99 * 12 / 13) ** 2 / 8 + 0.01), rel=0.02
    )


def test_the_built_in_pane_is_what_a_path_tracer_finds() -> None:
    of = find_scene("pane")
    verdict = judge(of, "video", told(of, ("video",), pixels=48, paths=1024))

    assert verdict.beyond_half == 0
    assert verdict.error < 0.1
    assert verdict.rms < 0.15


@pytest.mark.parametrize("transport", ["diffuse_bounces = 0", "diffuse_bounces = 1\npatches = 16"])
def test_panes_over_and_behind_each_other_are_what_a_path_tracer_finds(transport: str) -> None:
    """Two panes aslant and a mirror, all of which see each other, a board, a wall, and shadows."""
    more = "albedo = 0.05\nthickness_m = 0.02"
    of = scene(
        WALL,
        plate("diffuse", "[-0.9, 0.6, 0]", "[1, 0.5, 0]", "[0.8, 0.8]", "albedo = 0.8"),
        plate("mirror", "[0.9, 1, 0]", "[-1, -0.4, 0]", "[0.9, 1]", "reflectivity = 0.8"),
        plate("glass", "[-0.1, 1.2, 0]", "[-0.5, -1, 0]", "[0.7, 0.9]", more),
        plate("glass", "[0.1, 1.5, 0]", "[0.2, 1, 0]", "[0.9, 0.9]", "reflectivity = 0.4"),
        lamp="[0.3, 0, 0.1]",
        transport=transport,
    )
    verdict = judge(of, "video", told(of, ("video",), pixels=24, paths=1024, size=(57, 43)))

    assert verdict.beyond_half == 0
    assert verdict.error < 0.2
    assert verdict.rms < 0.3
