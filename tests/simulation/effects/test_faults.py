"""Faults of a device against closed forms: means, variances, correlations, and conservation."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import Sequence, SubPhases
from transientcam_driver.camera import Sensor
from transientcam_simulation.base import IDEAL, TYPICAL, DeviceProfile, SparseResponses
from transientcam_simulation.effects import EFFECTS
from transientcam_simulation.emulated._two_taps import DifferentialPixels
from transientcam_simulation.imaging import SwitchableWorld, World
from transientcam_simulation.light import GivenScenery

Plane = NDArray[np.float64]
EXPOSURE_S = 1e-3
DELAY_S = 11e-9
F_HZ = 23e6
FULL_E = 40_000.0
OFF = {effect.name: "off" for effect in EFFECTS if effect.optional}
FAULTS = ("ghost", "crosstalk", "jitter", "hot-pixels", "blooming", "noisy-pixels", "non-linearity")
ONCE = Sequence(F_HZ, 1, "on-off", exposure_s=EXPOSURE_S, sub_phases=SubPhases("none"))
PHASES = Sequence(F_HZ, 1, "estimated", exposure_s=EXPOSURE_S, sub_phases=SubPhases("none"))


def world(
    plane: Plane | float,
    device: DeviceProfile = IDEAL,
    *on: str,
    shape: tuple[int, int] = (12, 16),
    ambient_e: float = 0.0,
    sensor: Sensor | None = None,
    exposure_s: float = EXPOSURE_S,
    seed: int = 1,
    sequence: Sequence = ONCE,
) -> World:
    """One return of each pixel, so many electrons in an image without modulation."""
    weight = np.full(np.shape(plane) or shape, plane)
    of = World(
        GivenScenery(SparseResponses(np.full(weight.shape, DELAY_S)[None], 2 * weight[None])),
        sensor or replace(Sensor().ideal(), gain_e_per_dn=1.0, dark_dn=100.0),
        electrons_per_s=1 / EXPOSURE_S,
        effects=OFF | dict.fromkeys(on, "on"),
        seed=seed,
        device=device,
        ambient_electrons_per_s=ambient_e / EXPOSURE_S,
    )
    sequence = replace(sequence, exposure_s=exposure_s)
    of.configure(sequence, sequence.labels)
    return of


def images_e(of: World, count: int = 1, *, index: int = 0, sequence: Sequence = ONCE) -> Plane:
    """Images of one label, (count, H, W) in electrons; 0 is that with the light on."""
    label = sequence.labels[index]
    taken = [of.image(label, number=n, device_time_s=0.01 * n) for n in range(count)]
    return (np.array(taken, float) - of.sensor.dark_dn) * of.sensor.gain_e_per_dn


def moments_e(of: World, frames: int) -> NDArray[np.complex128]:
    labels = PHASES.labels
    made: list[NDArray[np.complex128]] = []
    for frame in range(frames):
        i_0, i_90, i_180, i_270 = (
            of.image(label, number=4 * frame + n, device_time_s=0.0).astype(float)
            for n, label in enumerate(labels)
        )
        made.append((i_0 - i_180) + 1j * (i_90 - i_270))
    return np.array(made, np.complex128) * of.sensor.gain_e_per_dn


# --- rules ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_called_for_by_its_figures_and_not_by_a_trace_of_them(name: str) -> None:
    field = name.replace("-", "_")
    figures = getattr(TYPICAL, field)
    level_e = 40_000.0 if name == "blooming" else 5_000.0
    trace: Any = tuple(1e-4 * each for each in figures) if field in PAIRS else 1e-4 * figures
    devices: list[dict[str, Any]] = [{field: each} for each in (figures, trace, None)]
    calls = [world(level_e, replace(IDEAL, **each)).calls(Sequence())[name] for each in devices]

    assert [bool(call.called) for call in calls] == [True, False, False]
    assert calls[0].size_dn > calls[1].size_dn > calls[2].size_dn == 0
    assert calls[2].reason == "the device has no such fault"


PAIRS = ("jitter", "hot_pixels", "noisy_pixels")


def test_a_fault_that_is_forced_on_takes_typical_figures_of_its_own_alone() -> None:
    hot = replace(IDEAL, hot_pixels=(0.5, 1e6))
    plain, forced = (images_e(world(1000.0, device, "ghost"))[0] for device in (IDEAL, hot))

    assert (plain == forced).all()


def test_explanations_name_the_faults_of_a_device() -> None:
    device = replace(IDEAL, crosstalk=0.05, hot_pixels=(0.01, 1e6))
    of = world(10_000.0, device, "hot-pixels")
    explained = of.explain("plane", ONCE)
    reasons = {each.effect: each.reason for each in explained.effects}

    assert explained.device == "ideal (but for crosstalk, hot pixels)"
    assert reasons["crosstalk"] == "5.00% of a pixel's light goes to its four neighbours"
    assert reasons["hot-pixels"] == "1.00% of the pixels have 1,000,000 electrons a second"


# --- light that goes elsewhere --------------------------------------------------------------------


def test_crosstalk_gives_each_neighbour_a_quarter_of_the_share_and_loses_nothing() -> None:
    points = np.zeros((12, 16))
    points[6, 8] = points[0, 15] = 10_000.0
    seen = images_e(world(points, replace(IDEAL, crosstalk=0.08), "crosstalk"))[0]

    expected = np.zeros((12, 16))
    expected[6, 8] = 9_200
    expected[5, 8] = expected[7, 8] = expected[6, 7] = expected[6, 9] = 200
    # what would leave the image at its corner comes back
    expected[0, 15], expected[1, 15], expected[0, 14] = 9_600, 200, 200
    assert seen == pytest.approx(expected, abs=1)


def test_crosstalk_leaves_noise_of_neighbours_independent() -> None:
    """Electrons wander one by one: their shot noise is not smeared."""
    device = replace(IDEAL, crosstalk=0.5)
    seen = images_e(world(5000.0, device, "crosstalk", "shot-noise", shape=(300, 400)))[0]
    noise = seen - 5000
    right = np.mean(noise[:, 1:] * noise[:, :-1]) / 5000

    assert noise.var() == pytest.approx(5000, rel=5 * math.sqrt(2 / noise.size))
    assert right == pytest.approx(0, abs=5 / math.sqrt(noise.size))


def test_crosstalk_mixes_phases_as_their_phasors_add() -> None:
    delay_s, weight = np.full((1, 4, 5), 5e-9), np.full((1, 4, 5), 20_000.0)
    delay_s[0, 2, 2] = 9e-9
    of = World(
        GivenScenery(SparseResponses(delay_s, weight)),
        Sensor().ideal(),
        electrons_per_s=1 / EXPOSURE_S,
        effects=OFF | {"crosstalk": "on"},
        seed=1,
        device=replace(IDEAL, crosstalk=0.2),
    )
    of.configure(PHASES, PHASES.labels)
    phasor = 20_000 * np.exp(2j * np.pi * F_HZ * np.array([5e-9, 9e-9]))

    seen = moments_e(of, 1)[0]

    assert seen[2, 2] == pytest.approx(0.8 * phasor[1] + 0.2 * phasor[0], abs=3)
    assert seen[2, 3] == pytest.approx(0.95 * phasor[0] + 0.05 * phasor[1], abs=3)


def test_a_ghost_stands_at_the_opposite_place() -> None:
    point = np.zeros((12, 16))
    point[2, 3] = 10_000.0
    seen = images_e(world(point, replace(IDEAL, ghost=0.05), "ghost"))[0]

    expected = np.zeros((12, 16))
    expected[2, 3], expected[9, 12] = 9500, 500
    assert seen == pytest.approx(expected, abs=1)


# --- charge beyond the full well ------------------------------------------------------------------


def test_a_full_pixel_spills_a_share_to_its_neighbours_and_holds_a_full_well() -> None:
    point = np.full((11, 11), 1000.0)
    point[5, 5] = FULL_E + 20_000
    seen = images_e(world(point, replace(IDEAL, blooming=0.4), "blooming"))[0]

    expected = np.full((11, 11), 1000.0)
    expected[5, 5] = FULL_E
    expected[4, 5] = expected[6, 5] = expected[5, 4] = expected[5, 6] = 3000
    assert seen == pytest.approx(expected, abs=1)


def test_blooming_goes_on_from_neighbours_that_fill_up() -> None:
    share, excess_e = 0.8, 40_000.0
    point = np.full((11, 11), 38_000.0)
    point[5, 5] = FULL_E + excess_e
    seen = images_e(world(point, replace(IDEAL, blooming=share), "blooming"))[0]

    stage = point.copy()  # pixel by pixel
    for _ in range(200):
        over = {tuple(at): stage[tuple(at)] - FULL_E for at in np.argwhere(stage > FULL_E)}
        for (y, x), much in over.items():
            stage[y, x] -= much
            for at in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
                stage[at] += share * much / 4
    assert seen == pytest.approx(stage, abs=3)
    assert (seen[3:8, 5] > 38_001).all()  # beyond the next ones


def test_without_a_full_pixel_nothing_blooms() -> None:
    device = replace(IDEAL, blooming=0.4)
    assert (images_e(world(39_000.0, device, "blooming")) == images_e(world(39_000.0))).all()


# --- pixels unlike the others ---------------------------------------------------------------------


def test_hot_pixels_are_the_units_and_fill_with_the_exposure() -> None:
    device, shape = replace(IDEAL, hot_pixels=(0.02, 2e6), seed=3), (300, 400)
    one, double, brighter = (
        images_e(world(plane, device, "hot-pixels", shape=shape, exposure_s=time_s))[0]
        for plane, time_s in ((0, EXPOSURE_S), (0, 2 * EXPOSURE_S), (500, EXPOSURE_S))
    )
    other = images_e(world(0, replace(device, seed=4), "hot-pixels", shape=shape))[0]
    hot = one[one > 0]

    count = 0.02 * one.size
    assert len(hot) == pytest.approx(count, abs=5 * math.sqrt(count) + 2)
    # exponentially distributed: the deviation is the mean
    assert hot.mean() == pytest.approx(2000, rel=5 / math.sqrt(count))
    assert hot.std() == pytest.approx(2000, rel=10 / math.sqrt(count))
    assert double == pytest.approx(2 * one, abs=2)
    assert brighter == pytest.approx(one + 500, abs=1)
    assert np.mean((other > 0) & (one > 0)) < 0.002


def test_hot_pixels_have_the_shot_noise_of_their_electrons() -> None:
    device = replace(IDEAL, hot_pixels=(1.0, 5e6))
    of = world(0, device, "hot-pixels", "shot-noise", shape=(20, 20))
    mean = images_e(world(0, device, "hot-pixels", shape=(20, 20)))[0]
    noise = images_e(of, 400) - mean
    counted = mean > 200

    normal = noise.var(axis=0)[counted] / mean[counted]
    assert normal.mean() == pytest.approx(1, abs=5 * math.sqrt(2 / 400 / counted.sum()) + 0.01)


def test_noisy_pixels_add_their_variance_to_that_of_the_read_out() -> None:
    sensor = Sensor(gain_e_per_dn=1.0, read_noise_e=30.0, bits=16, dark_dn=5000.0)
    device, shape = replace(IDEAL, noisy_pixels=(0.3, 200.0)), (20, 30)
    of = world(0, device, "noisy-pixels", "read-noise", shape=shape, sensor=sensor)
    taken = images_e(of, 600)
    variance = taken.var(axis=0, ddof=1)
    noisy = variance > 30**2 + 12 * 30**2 * math.sqrt(2 / 600)

    assert noisy.mean() == pytest.approx(0.3, abs=0.1)
    quiet = np.sort(variance.ravel())[: int(0.5 * variance.size)]
    assert quiet.mean() == pytest.approx(30**2 + 1 / 12, rel=0.08)
    # of an exponential density of sizes the mean square is twice the square of the mean
    count = 0.3 * variance.size
    expected = 0.3 * 2 * 200**2
    assert variance.mean() - 30**2 == pytest.approx(expected, rel=5 * math.sqrt(6 / count))
    assert abs(taken.mean(axis=0)[noisy]).max() < 6 * math.sqrt(variance.max() / 600)


@pytest.mark.parametrize("level_e", [2000.0, 20_000.0, 36_000.0])
def test_non_linearity_bends_the_mean_and_its_slope_the_noise(level_e: float) -> None:
    lack, shape = 0.2, (300, 400)
    sensor = replace(Sensor().ideal(), gain_e_per_dn=1.0)
    device = replace(IDEAL, non_linearity=lack)
    seen = images_e(
        world(level_e, device, "non-linearity", "shot-noise", shape=shape, sensor=sensor)
    )[0]

    slope = 1 - 2 * lack * level_e / FULL_E
    bent = level_e - lack * (level_e**2 + level_e) / FULL_E  # E n^2 = mean^2 + mean
    error = 5 / math.sqrt(seen.size)
    assert seen.mean() == pytest.approx(bent, abs=error * math.sqrt(level_e))
    assert seen.var() == pytest.approx(slope**2 * level_e + 1 / 12, rel=math.sqrt(2) * error)


def test_non_linearity_moves_a_moment_by_what_its_rule_says() -> None:
    device, lack = replace(IDEAL, non_linearity=0.04), 0.04
    of = world(5000.0, device, "non-linearity", "ambient", ambient_e=3000.0, sequence=PHASES)
    call = of.calls(PHASES)["non-linearity"]
    moved = moments_e(of, 1)[0] - 10_000 * np.exp(2j * np.pi * F_HZ * DELAY_S)

    assert abs(moved).mean() == pytest.approx(call.size_dn, rel=0.01)
    assert call.size_dn == pytest.approx(lack * 10_000 * (10_000 + 6000) / FULL_E)


# --- images unlike the others ---------------------------------------------------------------------


def test_jitter_is_one_number_for_all_pixels_of_an_image_and_spares_other_light() -> None:
    device, plane = replace(IDEAL, jitter=(0.0, 0.05)), np.linspace(5e3, 3e4, 192).reshape(12, 16)
    of = world(plane, device, "jitter", "ambient", ambient_e=4000.0)
    on = (images_e(of, 500) - 4000) / plane
    dark = images_e(of, 3, index=1)

    assert on == pytest.approx(np.broadcast_to(on[:, :1, :1], on.shape), abs=3e-4)
    powers = on[:, 0, 0]
    assert powers.mean() == pytest.approx(1, abs=5 * 0.05 / math.sqrt(500))
    assert powers.std() == pytest.approx(0.05, rel=5 / math.sqrt(2 * 500))
    assert dark == pytest.approx(4000, abs=1)
    successive = np.corrcoef(powers[1:], powers[:-1])[0, 1]
    assert successive == pytest.approx(0, abs=5 / math.sqrt(500))


@pytest.mark.parametrize("figures", [(5e-11, 0.0), (0.0, 0.01), (3e-11, 5e-3)])
def test_jitter_scatters_moments_by_what_its_rule_says(figures: tuple[float, float]) -> None:
    of = world(10_000.0, replace(IDEAL, jitter=figures), "jitter", sequence=PHASES)
    call, seen = of.calls(PHASES)["jitter"], moments_e(of, 1200)
    error = seen[:, 0, 0] - 20_000 * np.exp(2j * np.pi * F_HZ * DELAY_S)

    scatter = math.sqrt(np.mean(np.abs(error) ** 2))
    # of four independent images, by a delay sigma: b^2 (omega sigma)^2 / 2; by a power: 3/2 b^2
    omega = 2 * np.pi * F_HZ * figures[0]
    closed = 20_000 * math.sqrt(omega**2 / 2 + 1.5 * figures[1] ** 2)
    assert scatter == pytest.approx(closed, rel=5 / math.sqrt(4 * 1200))
    assert call.size_dn == pytest.approx(closed, rel=0.01)
    # averages over the pixels keep it
    assert np.mean(seen, axis=(1, 2)) == pytest.approx(seen[:, 0, 0], abs=2)


def test_jitter_draws_from_a_stream_of_its_own() -> None:
    none = replace(IDEAL, jitter=(0.0, 0.0))
    noisy = ("shot-noise", "read-noise")
    quiet, with_it = (images_e(world(9e3, none, *noisy, *on), 3) for on in ((), ("jitter",)))

    assert (quiet == with_it).all()


def test_two_taps_of_an_exposure_share_its_light() -> None:
    """Where both get the same, their difference stays nothing, whatever the lamp does."""
    device = replace(IDEAL, jitter=(0.0, 0.1))
    of = world(5000.0, device, "jitter", sensor=Sensor(gain_e_per_dn=4.0, read_noise_e=0.0))
    taps = DifferentialPixels(
        SwitchableWorld(of),
        saturated=0,
        # in quadrature to the light, and in phase with it
        phases_rad=(2 * np.pi * F_HZ * DELAY_S + np.pi / 2, 2 * np.pi * F_HZ * DELAY_S),
    )
    seen = np.array(
        [taps.differences(F_HZ, EXPOSURE_S, delay_s=0.0, device_time_s=0.1 * n) for n in range(20)],
        dtype=float,
    )

    assert seen[:, 0] == pytest.approx(2048, abs=1)
    assert seen[:, 1].mean(axis=(1, 2)).std() == pytest.approx(0.1 * 1250, rel=0.6)


def test_faults_of_a_scene_that_moves_come_in_every_image() -> None:
    """What exchanges light between pixels cannot be computed region by region."""
    local = {effect.name: getattr(effect, "local", True) for effect in EFFECTS}

    assert not local["crosstalk"]
    assert not local["ghost"]
    assert not local["lens-scatter"]


def test_what_is_done_once_costs_nothing_an_image() -> None:
    device = replace(TYPICAL, name="ideal")
    calls = world(30_000.0, device).calls(ONCE)
    costs_s = {name: calls[name].cost_s for name in FAULTS}

    once = {name for name, cost_s in costs_s.items() if cost_s == 0}
    assert once == {"ghost", "crosstalk"}
