"""Lamps that flicker and another camera's light, against integrals over exposures."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import Sequence, SubPhases
from transientcam_driver.camera import Sensor
from transientcam_simulation.base import (
    IDEAL,
    STEADY,
    DarkCurrent,
    DeviceProfile,
    OtherLight,
    SparseResponses,
)
from transientcam_simulation.effects import EFFECTS
from transientcam_simulation.imaging import World
from transientcam_simulation.light import GivenScenery
from transientcam_simulation.scene import load_scene

SHAPE = (3, 4)
OWN_E, OTHER_E = 10_000.0, 8000.0
EXPOSURE_S, READOUT_S = 1.7e-3, 4.1e-3
PERIOD_S = EXPOSURE_S + READOUT_S
DELAY_S = 11e-9
F_HZ = 23e6
PLAIN = Sequence(F_HZ, 1, "on-off", exposure_s=EXPOSURE_S, sub_phases=SubPhases("none"))
ESTIMATED = replace(PLAIN, zeroth="estimated")
QUIET = {effect.name: "off" for effect in EFFECTS if effect.optional}
BUILT = ("ambient", "flicker", "other-camera")


def world(
    other_light: OtherLight,
    sequence: Sequence = PLAIN,
    device: DeviceProfile = IDEAL,
    *on: str,
    other_e: float = OTHER_E,
) -> World:
    """One return before other light, read without noise in single electrons."""
    weight = np.full((1, *SHAPE), 2 * OWN_E)
    of = World(
        GivenScenery(SparseResponses(np.full(weight.shape, DELAY_S), weight)),
        replace(Sensor().ideal(), gain_e_per_dn=1.0, dark_dn=100.0),
        electrons_per_s=1 / EXPOSURE_S,
        effects=QUIET | dict.fromkeys(BUILT, "auto") | dict.fromkeys(on, "on"),
        seed=1,
        device=device,
        ambient_electrons_per_s=other_e / EXPOSURE_S,
        other_light=other_light,
        readout_s=READOUT_S,
    )
    of.configure(sequence, sequence.labels)
    return of


def image_e(of: World, sequence: Sequence, index: int, begin_s: float) -> float:
    taken = of.image(sequence.labels[index], number=index, device_time_s=begin_s)
    assert (taken == taken[0, 0]).all()
    return float(taken[0, 0]) - 100.0


def moment_e(of: World, sequence: Sequence, begin_s: float) -> complex:
    """The first moment over all takes of a frame that begins at this time."""
    of_label = (
        np.exp(1j * label.phase_rad) * image_e(of, sequence, n, begin_s + n * PERIOD_S)
        for n, label in enumerate(sequence.labels)
        if label.frequency_hz
    )
    return complex(sum(of_label)) / sequence.takes


def middles_s(begin_s: float, count: int = 20_000) -> NDArray[np.float64]:
    return begin_s + EXPOSURE_S * (np.arange(count) + 0.5) / count


@pytest.mark.parametrize("begin_s", [0.0, 0.0013, 0.0071, 12.3456])
def test_an_image_has_the_light_of_lamps_while_it_is_exposed(begin_s: float) -> None:
    of = world(OtherLight(flicker=(0.6, 100.0)))
    lamps = np.mean(1 + 0.6 * np.cos(2 * np.pi * 100 * middles_s(begin_s)))

    assert image_e(of, PLAIN, 1, begin_s) == pytest.approx(OTHER_E * lamps, abs=0.6)
    assert image_e(of, PLAIN, 0, begin_s) == pytest.approx(OWN_E + OTHER_E * lamps, abs=0.6)


def test_neither_the_cameras_own_light_nor_dark_current_flickers() -> None:
    device = replace(IDEAL, dark_current=DarkCurrent(3000 / EXPOSURE_S), jitter=(0.0, 0.1))
    of = world(OtherLight(flicker=(1.0, 10.0)), PLAIN, device, "dark-current", "jitter")
    begin_s = 0.05 - EXPOSURE_S / 2  # the lamps are dark

    off = image_e(of, PLAIN, 1, begin_s)
    on = [
        of.image(PLAIN.labels[0], number=n, device_time_s=begin_s)[0, 0] - 100.0 for n in range(300)
    ]

    assert off == pytest.approx(3000, abs=OTHER_E * 0.002)
    assert np.mean(on) == pytest.approx(3000 + OWN_E, abs=5 * 0.1 * OWN_E / math.sqrt(300))
    assert np.std(on) == pytest.approx(0.1 * OWN_E, rel=5 / math.sqrt(600))


@pytest.mark.parametrize("takes", [1, 3])
def test_flicker_moves_moments_by_what_its_rule_says(takes: int) -> None:
    sequence = replace(ESTIMATED, takes=takes)
    of = world(OtherLight(flicker=(0.3, 100.0)), sequence)
    call = of.calls(sequence)["flicker"]
    own = 2 * OWN_E * np.exp(2j * np.pi * F_HZ * DELAY_S)
    # the begin goes evenly through a period
    moved = [abs(moment_e(of, sequence, k * 0.01 / 40) - own) for k in range(40)]

    assert call.called
    assert math.sqrt(np.mean(np.square(moved))) == pytest.approx(call.size_dn, rel=0.01)


def test_exposures_of_whole_periods_see_no_flicker() -> None:
    sequence = replace(ESTIMATED, exposure_s=0.01)

    call = world(OtherLight(flicker=(1.0, 100.0)), sequence).calls(sequence)["flicker"]

    assert not call.called
    assert call.size_dn < 1e-6


@pytest.mark.parametrize("scheme", ["none", "arccos", "harmonic-cancellation"])
@pytest.mark.parametrize("beat_hz", [0.0, 60.0, -410.0, 3000.0])
def test_an_image_has_the_beat_with_another_cameras_light(scheme: Any, beat_hz: float) -> None:
    sub_phases = SubPhases("none") if scheme == "none" else SubPhases(scheme, 6)
    sequence = replace(ESTIMATED, sub_phases=sub_phases)
    of = world(OtherLight(other_camera=(0.5, F_HZ + beat_hz)), sequence)
    alone = world(STEADY, sequence)
    edges = np.cumsum(sub_phases.weights)
    for index, label in enumerate(sequence.labels):
        begin_s = 0.0123 + index * PERIOD_S
        time_s = middles_s(begin_s)
        part = np.searchsorted(edges[:-1], (time_s - begin_s) / EXPOSURE_S, side="right")
        turn = label.phase_rad + np.array(sub_phases.phases_rad)[part]
        beat = 0.5 * np.mean(np.cos(2 * np.pi * beat_hz * time_s + turn))

        seen = image_e(of, sequence, index, begin_s) - image_e(alone, sequence, index, begin_s)

        assert seen == pytest.approx(OTHER_E * beat, abs=1.6)


def test_another_cameras_light_moves_moments_by_what_its_rule_says() -> None:
    of = world(OtherLight(other_camera=(0.5, F_HZ + 60.0)), ESTIMATED)
    call = of.calls(ESTIMATED)["other-camera"]
    own = 2 * OWN_E * np.exp(2j * np.pi * F_HZ * DELAY_S)
    moved = [abs(moment_e(of, ESTIMATED, k / 60 / 40) - own) for k in range(40)]

    assert call.called
    assert math.sqrt(np.mean(np.square(moved))) == pytest.approx(call.size_dn, rel=0.01)


def test_another_camera_of_another_frequency_is_light_like_any_other() -> None:
    of = world(OtherLight(other_camera=(0.5, 24e6)), ESTIMATED)
    call = of.calls(ESTIMATED)["other-camera"]
    alone = world(STEADY, ESTIMATED)

    assert not call.called
    assert 0 < call.size_dn < 2
    for index in range(4):
        assert image_e(of, ESTIMATED, index, 0.1) == image_e(alone, ESTIMATED, index, 0.1)


def test_light_that_changes_is_built_however_little_noise_it_brings() -> None:
    sequence = replace(ESTIMATED, takes=4096, take_order="interleaved")
    steady, flickers = (
        world(each, sequence, other_e=40.0).calls(sequence)
        for each in (STEADY, OtherLight(flicker=(1.0, 100.0)))
    )

    assert not steady["ambient"].called
    assert flickers["ambient"].called
    assert not steady["flicker"].called
    assert steady["flicker"].reason == "no other light is so"


def test_a_scene_names_how_its_other_light_changes(tmp_path: Path) -> None:
    file = tmp_path / "lamps.toml"
    file.write_text(
        """
        [light]
        electrons_per_s = 1e6
        [ambient]
        electrons_per_s = 3e5
        flicker = 0.4
        flicker_hz = 120
        camera_electrons_per_s = 1e5
        camera_hz = 23.00006e6
        [diffuser]
        """
    )
    scene = load_scene(file)

    assert scene.ambient_electrons_per_s == pytest.approx(4e5)
    assert scene.other_light.flicker == pytest.approx((0.3, 120.0))
    assert scene.other_light.other_camera == pytest.approx((0.25, 23.00006e6))
