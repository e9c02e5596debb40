"""Each effect: its physics, its answer, and that it does not exist where it is not called for."""

import math
import pkgutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import SceneError, Sequence, SubPhases
from transientcam_driver.camera import Sensor
from transientcam_simulation import effects as package
from transientcam_simulation.base import (
    IDEAL,
    TYPICAL,
    DarkCurrent,
    DeviceProfile,
    Drift,
    Lens,
    LensScatter,
    Outliers,
    Pattern,
    RollOff,
    SparseResponses,
    Waveform,
)
from transientcam_simulation.base._imperfections import PROTOTYPE
from transientcam_simulation.effects import (
    CALLED_ABOVE,
    EFFECTS,
    Effect,
    measured_harmonics,
    read_offsets_rad,
)
from transientcam_simulation.emulated import find_scene, world_of
from transientcam_simulation.imaging import World
from transientcam_simulation.light import GivenScenery
from transientcam_simulation.scene import Motion, Rectangle, Scene, Surface

SHAPE = (12, 16)
EXPOSURE_S = 1e-3
DELAY_S = 11e-9
F_HZ = 23e6
QUIET = {"shot-noise": "off", "read-noise": "off"}
PLAIN = Sequence(F_HZ, 1, "estimated", exposure_s=EXPOSURE_S, sub_phases=SubPhases("none"))
OPTIONAL = [effect for effect in EFFECTS if effect.optional]


def world(
    device: DeviceProfile = IDEAL,
    *,
    effects: Mapping[str, str] | None = None,
    electrons: float = 20_000.0,
    ambient: float = 0.0,
    plane: NDArray[np.float64] | None = None,
    sensor: Sensor | None = None,
) -> World:
    """One return, read without noise and with 16 bits."""
    weight = np.ones(SHAPE) if plane is None else plane
    return World(
        GivenScenery(SparseResponses(np.full_like(weight, DELAY_S)[None], weight[None])),
        sensor or Sensor().ideal(),
        electrons_per_s=electrons / EXPOSURE_S,
        effects=QUIET if effects is None else effects,
        seed=1,
        device=device,
        ambient_electrons_per_s=ambient / EXPOSURE_S,
    )


def images(of: World, sequence: Sequence = PLAIN, *, time_s: float = 0.0) -> NDArray[np.float64]:
    """All images of a sequence, in electrons."""
    of.configure(sequence, sequence.labels)
    sensor = of.sensor
    taken = [
        of.image(label, number=n, device_time_s=time_s) for n, label in enumerate(sequence.labels)
    ]
    return (np.array(taken, dtype=np.float64) - sensor.dark_dn) * sensor.gain_e_per_dn


def moment(of: World, sequence: Sequence = PLAIN, *, time_s: float = 0.0) -> NDArray[np.complex128]:
    i_0, i_90, i_180, i_270 = images(of, sequence, time_s=time_s)[:4]
    result: NDArray[np.complex128] = (i_0 - i_180) + 1j * (i_90 - i_270)
    return result


IDEAL_MOMENT = 20_000 * np.exp(2j * np.pi * F_HZ * DELAY_S)


# --- what is not called for does not exist ------------------------------------------------------


@pytest.mark.parametrize("scene", ["wall", "mirrors", "corner", "visitor", "translucent"])
def test_the_bytes_are_those_of_a_build_without_what_is_not_called_for(
    scene: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sequence = Sequence(exposure_s=0.5e-3)
    whole = world_of(find_scene(scene), width=41, height=30, readout_s=4e-3)
    whole.configure(sequence, sequence.labels)
    explained = whole.explain(scene, sequence)
    built = {each.effect for each in explained.effects if each.built}
    expected = [
        whole.image(label, number=n, device_time_s=5 + 0.0045 * n).tobytes()
        for n, label in enumerate(sequence.labels)
    ]

    left = tuple(effect for effect in EFFECTS if effect.name in built)
    monkeypatch.setattr("transientcam_simulation.imaging._world.EFFECTS", left)
    without = world_of(find_scene(scene), width=41, height=30, readout_s=4e-3)
    without.configure(sequence, sequence.labels)

    assert len(left) < len(EFFECTS)
    for n, label in enumerate(sequence.labels):
        image = without.image(label, number=n, device_time_s=5 + 0.0045 * n)
        assert image.tobytes() == expected[n]


@pytest.mark.parametrize("effect", OPTIONAL)
def test_an_effect_that_is_not_called_for_is_never_called(
    effect: type[Effect], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("called")

    for name in ("__init__", "apply", "on_light", "on_shot", "harmonics"):
        if hasattr(effect, name):
            monkeypatch.setattr(effect, name, never)
    sequence = Sequence(exposure_s=EXPOSURE_S)
    everything_off = {each.name: "off" for each in OPTIONAL}

    images(world(PROTOTYPE, effects=everything_off, ambient=5000.0), sequence)
    if effect.name not in ("shot-noise", "read-noise"):
        images(world(effects={}), sequence)  # nor by an ideal device in a plain scene
    with pytest.raises(AssertionError, match="called"):
        images(world(PROTOTYPE, effects=everything_off | {effect.name: "on"}), sequence)


def test_a_frame_without_effects_draws_no_random_number(monkeypatch: pytest.MonkeyPatch) -> None:
    still = world()
    still.configure(PLAIN, PLAIN.labels)

    class NoRandom:
        def __getattr__(self, name: str) -> None:
            raise AssertionError(name)

    monkeypatch.setattr(np.random, "Generator", lambda _bits: NoRandom())
    still.image(PLAIN.labels[0], number=3, device_time_s=0.0)


def test_outliers_draw_from_a_stream_of_their_own() -> None:
    """The noise of an image stays what it is when outliers come in."""
    device = replace(IDEAL, outliers=Outliers(0.0001))
    noisy = {"read-noise": "on", "shot-noise": "on", "outliers": "off"}
    with_none = images(world(device, effects=noisy))
    with_some = images(world(device, effects=noisy | {"outliers": "on"}))

    assert (with_none == with_some).all()


@pytest.mark.parametrize("effect", OPTIONAL)
def test_each_effect_answers_for_an_ideal_device_and_a_typical_one(effect: type[Effect]) -> None:
    sequence = Sequence(exposure_s=EXPOSURE_S)
    for device in (IDEAL, TYPICAL):
        of = world(device, ambient=0.0 if device is IDEAL else 4000.0)
        call = effect.called_for(of.conditions(sequence))
        assert call.reason
        assert call.size_dn >= 0
        assert math.isfinite(call.size_dn)
    ideal = effect.called_for(world().conditions(sequence))
    electrons = 60_000 if effect.name == "blooming" else 20_000  # only full pixels spill
    typical = world(TYPICAL, electrons=electrons)
    typical_device = effect.called_for(typical.conditions(sequence))
    if effect.figures and effect.holder == "device":
        assert not ideal.called
        assert typical_device.called


def test_an_effect_is_called_for_above_a_tenth_of_the_noise_floor() -> None:
    sequence = Sequence(exposure_s=EXPOSURE_S, sub_phases=SubPhases("none"))
    conditions = world().conditions(sequence)
    for factor, called in ((0.9, False), (1.1, True)):
        third = (
            factor
            * CALLED_ABOVE
            * conditions.floor_dn
            / (conditions.brightness_e / conditions.sensor.gain_e_per_dn)
        )
        device = replace(IDEAL, waveform=Waveform(None, (1e6, 1e9), (third, third)))
        call = world(device).calls(sequence)["modulation-harmonics"]
        assert call.called == called


def test_the_noise_floor_is_the_measured_error_of_a_moment() -> None:
    sensor = Sensor()
    ones = np.ones((60, 80))
    noisy = World(
        GivenScenery(SparseResponses((DELAY_S * ones)[None], ones[None])),
        sensor,
        electrons_per_s=20_000 / EXPOSURE_S,
        effects={},
        seed=4,
    )
    error = moment(noisy) / sensor.gain_e_per_dn
    error = error - error.mean()

    measured = math.sqrt(np.mean(np.abs(error) ** 2))
    assert measured == pytest.approx(noisy.conditions(PLAIN).floor_dn, rel=0.05)


# --- the physics of each --------------------------------------------------------------------------


def test_roll_off_weakens_what_is_modulated_and_nothing_else() -> None:
    device = replace(IDEAL, roll_off=RollOff((20e6, 40e6), (0.8, 0.4)))
    sequence = Sequence(20e6, 2, "on-off", exposure_s=EXPOSURE_S, sub_phases=SubPhases("none"))

    on, off, *rest = images(world(device), sequence)

    assert on.mean() - off.mean() == pytest.approx(10_000, rel=1e-4)
    for j, expected in ((0, 0.8), (1, 0.4)):
        i_0, i_90, i_180, i_270 = rest[4 * j : 4 * j + 4]
        assert abs((i_0 - i_180) + 1j * (i_90 - i_270)).mean() == pytest.approx(
            expected * 20_000, rel=1e-4
        )


def test_harmonics_reach_the_moment_through_sub_phases_only_as_far_as_these_let_them() -> None:
    third = 0.1
    device = replace(IDEAL, waveform=Waveform(None, (1e6, 1e9), (third, third)))
    # no image is darker than dark: other light leaves room for the third harmonic
    brightened = world(device, ambient=5000.0, effects=QUIET | {"ambient": "on"})
    raw = moment(brightened).mean()
    # (I0 - I180) + i (I90 - I270) of the third harmonic turns the other way round
    aliased = third * 20_000 * np.exp(-2j * np.pi * 3 * F_HZ * DELAY_S)
    assert raw == pytest.approx(IDEAL_MOMENT + aliased, abs=2)

    arccos = replace(PLAIN, sub_phases=SubPhases("arccos", 8))
    gain = complex(np.mean(np.exp(-1j * np.array(arccos.sub_phases.phases_rad))))
    error = abs(moment(world(device), arccos).mean() / gain - IDEAL_MOMENT) / 20_000
    assert error < 0.005  # of 0.1


def test_harmonics_of_a_measured_correlation_are_those_of_its_spectrum(data_dir: Path) -> None:
    path = data_dir / "modulation" / "keatof_2MHz_ham-k3_min.npy"

    content = measured_harmonics(path)

    rows = np.load(path)
    spectrum = np.abs(np.fft.rfft(rows[0] - rows[1]))
    assert content[1] == pytest.approx(1)
    assert abs(content[3]) == pytest.approx(spectrum[3] / spectrum[1])
    assert abs(content[3]) == pytest.approx(0.19, abs=0.01)
    # the camera's images over phase follow the measured correlation function
    device = replace(IDEAL, waveform=Waveform(file=path))
    theta = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    of = world(device, plane=np.full(SHAPE, 1.0))
    of.configure(PLAIN, PLAIN.labels)
    label = PLAIN.labels[0]
    curve = [
        float(of.image(replace(label, phase_rad=float(t)), number=0, device_time_s=0.0)[0, 0])
        for t in theta
    ]
    seen = np.abs(np.fft.rfft(curve))
    assert seen[3] / seen[1] == pytest.approx(spectrum[3] / spectrum[1], rel=0.01)


@pytest.mark.parametrize("content", [b"", b"not numpy"])
def test_a_waveform_that_cannot_be_read_is_reported(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "wave.npy"
    path.write_bytes(content)

    with pytest.raises(SceneError, match=r"readable .npy"):
        measured_harmonics(path)


def test_a_waveform_of_another_kind_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "wave.npy"
    np.save(path, np.ones((2, 3, 4)))
    with pytest.raises(SceneError, match="samples or more"):
        measured_harmonics(path)
    np.save(path, np.ones(64))
    with pytest.raises(SceneError, match="no fundamental"):
        measured_harmonics(path)


def test_the_pattern_turns_phases_like_a_delay_and_scales_everything() -> None:
    device = replace(IDEAL, pattern=Pattern(delay_s=1e-9, gain=0.02))
    one = moment(world(device)) / IDEAL_MOMENT
    double = Sequence(2 * F_HZ, 1, "estimated", exposure_s=EXPOSURE_S, sub_phases=PLAIN.sub_phases)
    two = moment(world(device), double) / (20_000 * np.exp(4j * np.pi * F_HZ * DELAY_S))

    assert np.angle(two) == pytest.approx(2 * np.angle(one), abs=2e-3)
    assert np.std(np.angle(one)) == pytest.approx(2 * np.pi * F_HZ * 1e-9, rel=0.2)
    assert np.std(np.abs(one)) == pytest.approx(0.02, rel=0.2)
    # it is the device's: the same before every scene, another one for another device
    brighter = moment(world(device, electrons=30_000)) / IDEAL_MOMENT
    assert brighter == pytest.approx(1.5 * one, rel=1e-3)
    assert moment(world(replace(device, seed=5)))[0, 0] != pytest.approx(one[0, 0] * IDEAL_MOMENT)


def test_a_measured_pattern_is_read_and_placed_on_the_pixels(data_dir: Path) -> None:
    path = data_dir / "modulation" / "TintinCDKCameraPhaseOffset.bin"
    offsets = read_offsets_rad(path)
    assert offsets.shape == (240, 320)
    assert np.degrees(np.std(offsets)) == pytest.approx(10, abs=3)

    device = replace(IDEAL, pattern=Pattern(file=path, file_frequency_hz=F_HZ))
    turned = np.angle(moment(world(device)) / IDEAL_MOMENT)

    assert turned[0, 0] == pytest.approx(offsets[0, 0], abs=1e-3)
    assert turned[6, 8] == pytest.approx(offsets[120, 160], abs=1e-3)


@pytest.mark.parametrize("content", [b"", b"\x02\x00\x02\x00\x00\x00"])
def test_a_pattern_that_cannot_be_used_is_reported(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "offsets.bin"
    path.write_bytes(content)

    with pytest.raises(SceneError, match=r"offsets.bin"):
        read_offsets_rad(path)


def test_drift_follows_the_temperature_since_the_start() -> None:
    device = replace(IDEAL, drift=Drift(10.0, 100.0, 20e-12))
    effects = QUIET | {"thermal-drift": "on"}
    for time_s in (0.0, 100.0, 1e6):
        rise_c = 10 * (1 - math.exp(-time_s / 100))
        of = world(device, effects=effects)
        turn = np.angle(moment(of, time_s=time_s).mean() / IDEAL_MOMENT)

        assert turn == pytest.approx(2 * np.pi * F_HZ * 20e-12 * rise_c, abs=1e-4)
        assert of.temperature_c(time_s) == pytest.approx(25 + rise_c)


def test_a_device_that_does_not_drift_stays_as_warm() -> None:
    of = world()
    images(of)
    assert of.temperature_c(1e4) == 25.0


def test_lens_scatter_moves_light_and_makes_none() -> None:
    point = np.zeros(SHAPE)
    point[6, 8] = 1.0
    device = replace(IDEAL, lens_scatter=LensScatter(share=0.1, width=0.1))
    effects = QUIET | {"lens-scatter": "on"}

    blurred = images(world(device, effects=effects, plane=point), electrons_images())[0]

    assert blurred[6, 8] > 0.9 * 10_000
    assert blurred[6, 6] > blurred[6, 3] > 0
    assert blurred.sum() == pytest.approx(10_000, rel=0.01)  # all of it lands on the sensor here


def electrons_images() -> Sequence:
    return Sequence(F_HZ, 1, "on-off", exposure_s=EXPOSURE_S)


def test_ambient_light_is_in_every_image_and_cancels_in_the_moments() -> None:
    of = world(ambient=5000.0, effects=QUIET | {"ambient": "on"})

    on, off, *_ = images(of, electrons_images())

    assert off.mean() == pytest.approx(5000, abs=1)
    assert on.mean() == pytest.approx(15_000, abs=1)
    assert moment(of).mean() == pytest.approx(IDEAL_MOMENT, abs=2)


def test_ambient_light_adds_its_shot_noise() -> None:
    noisy = {"shot-noise": "on", "read-noise": "off", "ambient": "on"}
    quiet, bright = world(effects=noisy | {"ambient": "off"}), world(effects=noisy, ambient=10_000)

    dark = images(quiet, electrons_images())[0].var()
    light = images(bright, electrons_images())[0].var()

    values = math.prod(SHAPE)
    assert light / dark == pytest.approx(2, rel=6 * math.sqrt(2 * 2 / values))


def test_saturation_is_called_for_where_a_pixel_may_be_full_before_the_converter_ends() -> None:
    small = replace(Sensor(), full_well_e=20_000.0)

    assert not world(sensor=small, electrons=15_000).calls(PLAIN)["saturation"].called
    assert world(sensor=small, electrons=21_000).calls(PLAIN)["saturation"].called
    assert not world(sensor=Sensor(), electrons=60_000).calls(PLAIN)["saturation"].called
    assert images(world(electrons=200_000)).max() == pytest.approx(
        min(40_000, (65_535 - 1024) * 9 / 16)
    )


def test_outliers_come_by_their_share_and_leave_the_others_alone() -> None:
    device = replace(IDEAL, outliers=Outliers(0.08))
    of = world(device, effects=QUIET | {"outliers": "on"})
    of.configure(PLAIN, PLAIN.labels)
    label = PLAIN.labels[0]
    series = np.array(
        [of.image(label, number=n, device_time_s=0.0)[0, 0] for n in range(1500)], dtype=float
    )

    usual = np.median(series)
    share = np.mean(series != usual)
    assert share == pytest.approx(0.08, abs=5 * math.sqrt(0.08 * 0.92 / 1500))
    assert np.abs(series - usual).max() > 0.3 * usual


def test_effects_of_the_prototype_spoil_nominal_moments_and_the_ideal_device_none() -> None:
    """That is why the built-in scenes stand before an ideal device."""
    sequence = Sequence(exposure_s=EXPOSURE_S, zeroth="estimated")
    gain = complex(np.mean(np.exp(-1j * np.array(sequence.sub_phases.phases_rad))))
    ideal = moment(world(effects=QUIET), sequence) / gain / IDEAL_MOMENT
    prototype = moment(world(PROTOTYPE, effects=QUIET), sequence) / gain / IDEAL_MOMENT

    assert np.abs(ideal - 1).max() < 1e-3
    assert np.abs(prototype - 1).mean() > 0.1


def test_every_file_of_an_effect_has_its_entry_and_a_name_of_its_own() -> None:
    files = {each.name for each in pkgutil.iter_modules(package.__path__)} - {
        "_conditions",
        "_effect",
        "_glimpses",
        "_missing",
    }

    assert {effect.__module__.rpartition(".")[2] for effect in EFFECTS} == files
    assert len({effect.name for effect in EFFECTS}) == len(EFFECTS)


def test_the_fano_factor_is_that_of_real_counts(data_dir: Path) -> None:
    """Ten raw takes behind three inches of foam: counts of bins vary as Poisson's do.

    (The direct capture's bright peak varies ten times as much: its source is unsteady.)
    """
    takes = np.load(data_dir / "measured" / "capture_3_0_inch.npz")["first_10_takes"].astype(float)
    real = _fano(takes)
    sensor = Sensor(gain_e_per_dn=1.0, read_noise_e=0.0, dark_dn=0.0)
    mean = takes.mean(axis=0)[:12_000].reshape(100, 120)
    of = World(
        GivenScenery(SparseResponses(np.zeros((1, 100, 120)), 2 * mean[None])),
        sensor,
        electrons_per_s=1 / EXPOSURE_S,
        effects={},
        seed=2,
    )
    sequence = electrons_images()
    of.configure(sequence, sequence.labels)
    simulated = np.array(
        [
            of.image(sequence.labels[0], number=n, device_time_s=0.0).ravel().astype(float)
            for n in range(10)
        ]
    )

    # of n takes, a variance is uncertain by sqrt(2 / (n - 1)) of itself
    error = 4 * math.sqrt(2 / 9 * (mean**2).sum()) / mean.sum()
    assert error < 0.15
    assert _fano(simulated) == pytest.approx(1, abs=error)
    assert real == pytest.approx(_fano(simulated), abs=error)


def _fano(takes: NDArray[np.float64]) -> float:
    """Variance over mean, of all bins with counts."""
    return float(takes.var(axis=0, ddof=1).sum() / takes.mean(axis=0).sum())


def test_vignetting_takes_light_by_the_cosine_to_the_axis() -> None:
    scene = find_scene("wall")
    assert scene.camera is not None
    lens = Lens(vignetting=4.0)
    dark = replace(scene, camera=replace(scene.camera, lens=lens))
    sequence = Sequence(exposure_s=0.5e-3)
    frames = []
    for each in (scene, dark):
        of = world_of(each, width=41, height=31, readout_s=4e-3)
        of.configure(sequence, sequence.labels)
        frames.append(of.mean_image_e(sequence.labels[0], number=0, device_time_s=0.0))
    x = math.tan(math.radians(20)) * (2 * (np.arange(41) + 0.5) / 41 - 1)
    y = math.tan(math.radians(20)) * (31 / 41) * (2 * (np.arange(31) + 0.5) / 31 - 1)

    expected = (1 + x[None, :] ** 2 + y[:, None] ** 2) ** -2

    assert frames[1] / frames[0] == pytest.approx(expected, rel=1e-5)


def test_dark_current_is_there_without_light_and_cancels_in_the_moments() -> None:
    device = replace(IDEAL, dark_current=DarkCurrent(2e5))
    of = world(device, effects=QUIET | {"dark-current": "on"})

    _on, off, *_ = images(of, electrons_images())

    assert off.mean() == pytest.approx(2e5 * EXPOSURE_S, abs=1)
    assert moment(of).mean() == pytest.approx(IDEAL_MOMENT, abs=2)


def test_what_is_dark_at_the_start_is_judged_by_what_comes_later() -> None:
    """A ball before nothing that comes into view after some seconds."""
    scene = find_scene("visitor")
    ball = replace(scene.surfaces[3], motions=(Motion(np.array([[-3.0, 0, 0], [0.2, 0, 0]]), 20),))
    void = replace(scene, surfaces=(ball,))
    of = world_of(void, width=41, height=30, readout_s=4e-3)
    sequence = Sequence(exposure_s=0.5e-3)

    calls = of.calls(sequence)
    of.configure(sequence, sequence.labels)

    assert not of.mean_image_e(sequence.labels[0], number=0, device_time_s=0.0).any()
    assert all(calls[name].called for name in ("shot-noise", "motion", "mixed-pixels"))


def test_motion_counts_from_the_first_image_of_a_sequence_to_the_last() -> None:
    scene = find_scene("visitor")
    slow = Motion(np.array([[-0.2, 0, 0], [0.2, 0, 0]]), 2e4, "back")
    ball = replace(scene.surfaces[3], motions=(slow,))
    of = world_of(
        replace(scene, surfaces=(scene.surfaces[0], ball)), width=41, height=30, readout_s=4e-3
    )

    short, long = (of.calls(Sequence(takes=takes))["motion"] for takes in (1, 256))

    # 256 takes: 16 times less noise, and 256 times as far
    assert long.relative > 16 * short.relative
    assert long.called


def passing_bar(speed_m_s: float) -> Scene:
    """A bar that passes before a wall, some 0.02 rad across and 150 pixels a m away."""
    scene = find_scene("wall")
    bar = Rectangle.facing(np.array([0, 1.2, 0]), np.array([0, -1.0, 0]), size=(0.1, 0.5))
    passes = Motion(np.array([[-0.3, 0, 0], [0.3, 0, 0]]), 0.6 / speed_m_s, "restart")
    bars = Surface("bar", "diffuse", bar, 0.9, motions=(passes,))
    return replace(scene, surfaces=(*scene.surfaces, bars))


@pytest.mark.parametrize("speed_m_s", [0.5, 2.0, 8.0])
def test_an_image_of_what_moves_is_the_mean_over_its_exposure(speed_m_s: float) -> None:
    sequence = Sequence(exposure_s=5e-3)
    scene, label = passing_bar(speed_m_s), sequence.labels[2]

    def world(blur: str) -> World:
        effects = {"blur": blur, "motion": "on", "mixed-pixels": "on"}
        of = world_of(replace(scene, effects=effects), width=61, height=20, readout_s=4e-3)
        of.configure(sequence, sequence.labels)
        return of

    begun_s, instants = 0.3 / speed_m_s, 160
    sharp = world("off")
    offsets_s = ((np.arange(instants) + 0.5) / instants - 0.5) * sequence.exposure_s
    wanted = np.mean(
        [
            sharp.mean_image_e(label, number=2, device_time_s=begun_s + by_s).astype(float)
            for by_s in offsets_s
        ],
        axis=0,
    )
    middle, blurred = (
        world(each).mean_image_e(label, number=2, device_time_s=begun_s) for each in ("off", "on")
    )
    left, blurs = (np.abs(each - wanted).max() for each in (blurred, middle))
    assert left < 0.15 * blurs + 1e-3 * wanted.max()


def test_blur_is_called_for_where_an_exposure_is_long_for_what_moves() -> None:
    scene = passing_bar(2.0)
    of = world_of(scene, width=163, height=120, readout_s=4e-3)

    short, long = (of.calls(Sequence(exposure_s=each))["blur"] for each in (0.05e-3, 5e-3))

    assert not short.called
    assert long.called
    assert (
        not world_of(find_scene("wall"), width=41, height=30, readout_s=4e-3)
        .calls(Sequence())["blur"]
        .called
    )


@pytest.mark.parametrize("place_m", [0.0, 0.004, 0.009, 0.013])
def test_an_upright_edge_that_moves_between_the_pixels_judged_is_called_for(place_m: float) -> None:
    """A bar that moves by 0.08 pixels within a sequence, while every third pixel is judged."""
    scene = find_scene("wall")
    bar = Rectangle.facing(np.array([place_m, 1.2, 0]), np.array([0, -1.0, 0]), size=(0.06, 0.5))
    creep = Motion(np.array([[0.0, 0, 0], [0.02, 0, 0]]), 4.0, "back")
    moving = replace(
        scene, surfaces=(*scene.surfaces, Surface("bar", "diffuse", bar, 0.9, motions=(creep,)))
    )
    of = world_of(moving, width=163, height=120, readout_s=4e-3)

    call = of.calls(Sequence(harmonics=3, zeroth="estimated", exposure_s=0.5e-3))["motion"]

    assert call.called
