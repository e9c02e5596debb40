"""Light that moving surfaces give each other, against its full solution for every image."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver.sequence import Sequence
from transientcam_simulation.base import Moments
from transientcam_simulation.effects import Noise
from transientcam_simulation.emulated import world_of
from transientcam_simulation.imaging import World
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._facts import MOVING_S, PAIR_S, STILL_S, TURNED_S, SceneFacts
from transientcam_simulation.light._further_light import FurtherLight
from transientcam_simulation.light._held_light import HeldLight, StillEnds, held_light
from transientcam_simulation.light._patches import Patches
from transientcam_simulation.light._paths import light_rays
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import camera_rays
from transientcam_simulation.light._still import StillLight
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

WIDTH, HEIGHT = 54, 40
READOUT_S = 3.98e-3
VIDEO = Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005)
LONG = Sequence(harmonics=4, takes=20)
QUIET = dict.fromkeys(("shot-noise", "read-noise", "mixed-pixels"), "off")


def v(*values: float) -> NDArray[np.float64]:
    return np.array(values, dtype=np.float64)


def scene(repeat: str = "loop") -> Scene:
    """A ball goes round before a wall, past a post."""
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    path_m = np.stack([0.35 * np.cos(turn), 0.35 * np.sin(turn), 0.05 * np.cos(turn)], axis=1)
    wall = Rectangle.facing(v(0, 2.2, 0), v(0, -1, 0), size=(4, 3))
    motion = Motion(path_m, 4.0, repeat)  # type: ignore[arg-type]
    return Scene(
        name="round",
        description="",
        file=None,
        light=Light(3e7, v(0.05, 0, 0.02), v(0, 2, 0), 0.0),
        camera=Viewpoint(v(0, 0, 0), v(0, 2, 0), 50.0),
        surfaces=(
            Surface("wall", "diffuse", wall, 0.6),
            Surface("ball", "diffuse", Ellipsoid(v(0, 1.5, 0), v(0.16, 0.16, 0.16)), 0.7,
                    motions=(motion,)),
            Surface("post", "diffuse", Ellipsoid(v(0, 1.5, -0.2), v(0.03, 0.03, 0.6)), 0.3),
        ),
    )  # fmt: skip


def world(interreflection: str, sequence: Sequence) -> World:
    of = replace(scene(), effects=QUIET | {"interreflection": interreflection})
    built = world_of(of, width=WIDTH, height=HEIGHT, readout_s=READOUT_S)
    built.configure(sequence, sequence.labels)
    return built


def solved_in_full(time_s: float) -> tuple[Interreflection, NDArray[np.intp]]:
    """Light over several surfaces as if the scene stood still, and which one (H, W) pixels see."""
    now = scene().at(time_s)
    assert now.camera is not None
    lit = light_rays(now, camera_rays(now.camera, width=WIDTH, height=HEIGHT))
    light = Interreflection(now, lit, width=WIDTH, height=HEIGHT)
    return light, lit.surface.reshape(HEIGHT, WIDTH)


@pytest.mark.parametrize(
    ("sequence", "takes", "harmonics"), [(VIDEO, (0,), (1, 3)), (LONG, (3, 16), (4,))]
)
def test_what_steps_leave_out_is_below_the_noise(
    sequence: Sequence, takes: tuple[int, ...], harmonics: tuple[int, ...]
) -> None:
    lit, dark = (world(choice, sequence) for choice in ("auto", "off"))
    conditions = lit.conditions(sequence)
    factor_e = 0.5 * conditions.scale_e * conditions.sub_phase_gain(1)
    period_s = sequence.exposure_s + READOUT_S
    errors_e: dict[int, NDArray[np.complex128]] = {}
    seen: list[NDArray[np.intp]] = []
    for label in (
        each for each in sequence.labels if each.take in takes and each.harmonic in harmonics
    ):
        time_s = 1.3 + label.index * period_s
        found_e, direct_e = (
            of.mean_image_e(label, number=0, device_time_s=time_s).astype(np.float64)
            for of in (lit, dark)
        )
        light, surface = solved_in_full(time_s)
        seen.append(surface)
        turned = light.moments(label.frequency_hz) * np.exp(-1j * label.phase_rad)
        expected_e = (factor_e * turned + 0.5 * conditions.scale_e * light.moments(0.0)).real
        error_e = (found_e - direct_e - expected_e) * np.exp(1j * label.phase_rad) / len(takes)
        errors_e[label.harmonic] = errors_e.get(label.harmonic, 0) + error_e
    brightness = lit.truth(device_time_s=1.3).brightness
    gain = sequence.exposure_s * 3e7 / lit.sensor.gain_e_per_dn
    deviation_e = conditions.noise.deviation(brightness / gain, 1.0) * conditions.scale_e

    assert set(errors_e) == set(harmonics)
    over = np.max([np.abs(each) for each in errors_e.values()], axis=0) / deviation_e
    # a ray that just grazes a silhouette may fall on either side of it
    ways = [np.roll(each, by, axis) for each in seen for by in (-1, 0, 1) for axis in (0, 1)]
    over = over[np.ptp(ways, axis=0) == 0]
    assert over.size > 0.6 * WIDTH * HEIGHT
    assert np.mean(over > 0.5) < 0.01
    assert np.sqrt(np.mean(over**2)) < 0.2


def held(of: Scene, *, per_side: int = 6) -> Callable[[float], HeldLight]:
    still = StillLight(still_scene(of), width=WIDTH, height=HEIGHT)
    return held_light(FurtherLight(of, per_side=per_side), FurtherLight(of, per_side=24), still)


def test_light_follows_from_the_time_whatever_was_asked_before() -> None:
    first, second = held(scene()), held(scene())
    for time_s in (55.0, 0.2, 7.7, 3.9, 8.1):
        second(time_s).moments(69e6)

    assert first(7.7).moments(69e6).tobytes() == second(7.7).moments(69e6).tobytes()
    assert first(7.7).moments(69e6).tobytes() != first(8.7).moments(69e6).tobytes()


def test_of_coarse_patches_only_what_moves_is_taken() -> None:
    left = Rectangle.facing(v(-0.8, 2, 0), v(1, -1, 0), size=(2, 2))
    right = Rectangle.facing(v(0.8, 2, 0), v(-1, -1, 0), size=(2, 2))
    small = Ellipsoid(v(0, 1.2, -0.6), v(0.02, 0.02, 0.02))
    motion = Motion(np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0]]), 4.0, "back")
    walls = (Surface("left", "diffuse", left, 0.8), Surface("right", "diffuse", right, 0.8))
    ball = Surface("ball", "diffuse", small, 0.7, motions=(motion,))
    of = replace(scene(), surfaces=(*walls, ball))
    still = StillLight(still_scene(of), width=WIDTH, height=HEIGHT)
    alone = replace(of, surfaces=walls)

    found = held(of)(0.3).moments(69e6) - still.moments(69e6)

    fine, coarse = (
        Interreflection(
            alone, still.lit, width=WIDTH, height=HEIGHT, exchange=Exchange.of(alone, per_side)
        ).moments(69e6)
        for per_side in (24, 6)
    )
    highest = np.abs(fine).max()
    assert np.abs(coarse - fine).max() > 0.1 * highest
    assert np.abs(found - fine).max() < 0.01 * highest


def test_at_its_steps_light_is_solved_exactly() -> None:
    light = FurtherLight(scene(), per_side=24)

    found = light.irradiance(5 * light.step_s, 46e6)

    exchange = Exchange.of(scene().at(5 * light.step_s), 24)
    expected = exchange.irradiance(46e6, exchange.bounces(1e-4))
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_where_a_path_starts_again_light_jumps_with_it() -> None:
    light = FurtherLight(scene("restart"), per_side=24)

    for time_s in (4.0 - 1e-6, 4.0 + 1e-6):
        exchange = Exchange.of(scene("restart").at(time_s), 24)
        expected = exchange.irradiance(0.0, exchange.bounces(1e-4))
        assert light.irradiance(time_s, 0.0) == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_a_scene_that_hardly_moves_is_hardly_ever_solved() -> None:
    of = scene()
    slow = Motion(of.surfaces[1].motions[0].path_m, 4e9, "loop")
    moving = replace(of, surfaces=(of.surfaces[0], replace(of.surfaces[1], motions=(slow,))))

    assert FurtherLight(moving, per_side=6).step_s >= 3600


def test_patches_are_as_fine_as_the_noise_calls_for() -> None:
    facts = SceneFacts(scene(), width=WIDTH, height=HEIGHT)

    found = [facts.resolution(Noise(3e4, 0.0, 900.0, takes)) for takes in (1, 100, 1_000_000)]

    sides, reaches = zip(*found, strict=True)
    assert sides[0] < sides[1] <= sides[2] == scene().transport.patches
    assert reaches[2] == min(reaches)


def test_the_cost_that_is_stated_is_that_of_the_work_that_is_done(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pairs = solved = gathered = 0
    between, irradiance, moments = Exchange.between, Exchange.irradiance, StillEnds.moments

    def counted(of: Scene, patches: Patches) -> Exchange:
        nonlocal pairs
        pairs += len(patches) ** 2
        return between(of, patches)

    def turned(self: Exchange, frequency_hz: float, bounces: int) -> NDArray[np.complex128]:
        nonlocal solved
        solved += len(self.patches) ** 2
        return irradiance(self, frequency_hz, bounces)

    def on_still(self: StillEnds, light: NDArray[np.complex64], frequency_hz: float) -> Moments:
        nonlocal gathered
        gathered += len(self.places[0])
        return moments(self, light, frequency_hz)

    built = world("auto", VIDEO)
    call = built.calls(VIDEO)["interreflection"]
    for label in VIDEO.labels:  # what is solved once
        built.mean_image_e(label, number=0, device_time_s=0.0)
    monkeypatch.setattr(Exchange, "between", counted)
    monkeypatch.setattr(Exchange, "irradiance", turned)
    monkeypatch.setattr(StillEnds, "moments", on_still)
    images = 40 * len(VIDEO.labels)
    for k in range(images):
        label = VIDEO.labels[k % len(VIDEO.labels)]
        built.mean_image_e(label, number=k, device_time_s=k * (VIDEO.exposure_s + READOUT_S))

    work_s = pairs * PAIR_S + solved * TURNED_S + gathered * STILL_S
    moving_s = 0.1 * 2 * WIDTH * HEIGHT * MOVING_S  # the ball covers about a tenth of the image
    assert images * call.cost_s / 2 < work_s + images * moving_s < images * call.cost_s * 2


def test_light_between_surfaces_follows_one_that_turns() -> None:
    of = scene()
    door = Rectangle.facing(v(0.3, 1.5, 0), v(0, -1, 0), size=(0.5, 0.8))
    opens = Motion(np.zeros((2, 3)), 2.0, rotation_deg=v(0, 0, 0, 0, 0, -120).reshape(2, 3))
    door_of = replace(of.surfaces[1], name="door", shape=door, motions=(opens,))
    of = replace(of, surfaces=(of.surfaces[0], door_of, of.surfaces[2]))
    light = FurtherLight(of, per_side=6)

    found = light.solution(1.4, 23e6)

    there = of.at(1.4)
    turned = Rectangle.facing(
        door.centre, v(-np.sin(np.radians(84)), -np.cos(np.radians(84)), 0), size=(0.5, 0.8)
    )
    body = replace(there.surfaces[1], shape=turned)
    still = replace(there, surfaces=(there.surfaces[0], body, there.surfaces[2]))
    cuts = {k: (cells.up, cells.along) for k, cells in light.patches.cells.items()}
    between = Exchange.between(still, Patches.cut(still, cuts))
    expected = between.irradiance(23e6, between.bounces(1e-4))
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)
    shut = light.solution(0.0, 23e6)
    assert np.abs(found - shut).max() > 0.1 * np.abs(shut).max()
    # a corner, 0.47 m from the middle, never moves by more than an allowed step of patches
    assert light.step_s < 0.5 * 2.0 / np.radians(120) / 0.47
