"""The built-in scenes, and what the camera sees of scenes that users compose."""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import SceneError, Sequence, list_scenes, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_simulation.base import Scatter, SparseResponses
from transientcam_simulation.emulated import find_scene, world_of
from transientcam_simulation.emulated._build import scenery_of
from transientcam_simulation.imaging import World
from transientcam_simulation.light import LightRequirements
from transientcam_simulation.scene import load_scene

C = 299_792_458.0
BUILT_IN = [info.name for info in list_scenes() if info.name != "measured"]
LOW_FREQUENCY_HZ = {"hall": 7e6}  # of scenes made for cameras of low frequencies


@cache
def world(name: str) -> World:
    """Return one that several tests look at."""
    return new_world(name)


def new_world(name: str, *, effects: dict[str, str] | None = None) -> World:
    scene = find_scene(name)
    scene.effects.update(effects or {})
    built = world_of(scene, width=163, height=120, readout_s=4e-3)
    sequence = Sequence()
    built.configure(sequence, sequence.labels)
    return built


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_scene_is_lit_not_saturated_and_within_its_frequencys_range(name: str) -> None:
    sequence = Sequence(base_frequency_hz=LOW_FREQUENCY_HZ.get(name, 23e6))
    with open_camera(f"sim:{name}", clock=VirtualClock()) as camera:
        camera.configure(sequence)
        camera.start()
        images = camera.read_frame(timeout_s=60).images
        assert camera.simulation is not None
        truth = camera.simulation.truth()

    lit = np.mean(truth.brightness > 100)
    full_well = 64 + 40_000 / 9  # beyond the converter's range
    assert lit > 0.95
    # at the visitor's video exposure nothing saturates; at the default one the actor may
    assert np.mean(images >= min(4095, full_well)) < (0.2 if name == "visitor" else 0.01)
    unambiguous_m = C / (2 * sequence.base_frequency_hz)
    assert np.nanmin(truth.range_m) >= 0
    assert np.nanmax(truth.range_m) < unambiguous_m


def test_the_wall_is_two_metres_away() -> None:
    assert world("wall").truth().range_m[60, 81] == pytest.approx(2.0, abs=0.01)


def test_calibration_is_one_return_at_phase_zero() -> None:
    truth = world("calibration").truth()

    assert (truth.delay_s == 0).all()
    assert len(truth.delay_s) == 1
    assert truth.brightness[60, 81] > 1.1 * truth.brightness[0, 0] > 0


def test_the_corners_walls_meet_where_the_file_says() -> None:
    """Distance along the rays to two planes at a right angle."""
    built = world("corner")
    truth = built.truth()
    half = math.tan(math.radians(20))
    columns = half * (2 * (np.arange(163) + 0.5) / 163 - 1)
    rows = half * (120 / 163) * (1 - 2 * (np.arange(120) + 0.5) / 120)
    x, z = np.meshgrid(columns, rows)
    depth = 2.4 / (1 + np.abs(x))  # y = 2.4 - |x|
    camera_m = depth * np.sqrt(1 + x**2 + z**2)
    lamp_m = np.sqrt((depth * x - 0.05) ** 2 + depth**2 + (depth * z) ** 2)

    assert truth.kind == "dense"
    expected_m = (camera_m + lamp_m) / 2
    beside = np.abs(np.arange(163) - 81) > 1  # pixels that see both walls have a return of each
    assert truth.range_m[:, beside] == pytest.approx(expected_m[:, beside], abs=1e-5)
    assert truth.range_m == pytest.approx(expected_m, abs=5e-3)


def test_most_of_the_right_wall_is_lit_by_the_left_one_only() -> None:
    built = world("corner-left")
    direct = new_world("corner-left", effects={"interreflection": "off"}).truth().brightness
    whole = built.truth().brightness

    assert (direct[:, :80] > 0).all()
    assert np.mean(direct[:, 84:] == 0) > 0.9
    assert (whole[:, 84:] > 30).all()


def test_light_that_enters_a_surface_comes_back_as_a_modified_gaussian() -> None:
    truth = world("translucent").truth()
    time_s, density = truth.impulse_response(40, 60)  # on the block of wax
    step_s = time_s[1] - time_s[0]

    mean_s = np.sum(time_s * density) / density.sum()
    late_s = density[time_s > mean_s + 2e-9]
    # beyond the width, it falls by exp(-t / 1.2 ns)
    assert late_s[40] / late_s[0] == pytest.approx(math.exp(-40 * step_s / 1.2e-9), rel=0.1)
    assert truth.kind == "dense"


@pytest.mark.parametrize(("width_s", "decay_s"), [(0.0, 1e-9), (2e-10, 0.0), (2e-10, 1e-9)])
def test_densities_of_scattered_light_have_its_moments(width_s: float, decay_s: float) -> None:
    shape = (1, 1)
    scatter = Scatter(np.full(shape, width_s), np.full(shape, decay_s))
    responses = SparseResponses(np.full((1, *shape), 9e-9), np.ones((1, *shape)), scatter)

    time_s, density = responses.of_pixel(0, 0)

    mass = density * (time_s[1] - time_s[0])
    assert mass.sum() == pytest.approx(1, abs=1e-4)
    for frequency_hz in (23e6, 92e6):
        phasor = np.sum(mass * np.exp(2j * np.pi * frequency_hz * time_s))
        assert phasor == pytest.approx(responses.moments(frequency_hz)[0, 0], abs=2e-3)


def test_the_visitor_comes_waves_and_goes() -> None:
    built = world("visitor")

    def nearest_m(time_s: float) -> tuple[float, float]:
        range_m: NDArray[np.float64] = built.truth(device_time_s=time_s).range_m
        near = range_m < 1.8
        return float(near.mean()), float(np.nonzero(near)[1].mean()) if near.any() else -1.0

    share = {time_s: nearest_m(time_s) for time_s in (0.3, 4.0, 9.0, 18.0)}
    assert share[0.3][0] < 0.01
    assert share[9.0][0] > 0.15
    assert share[4.0][1] < share[9.0][1] < share[18.0][1]
    assert nearest_m(9.0) == pytest.approx(nearest_m(9.0 + 24.0), rel=0.01)  # all begins again


def test_a_moving_scene_depends_on_the_devices_time_alone() -> None:
    first, second = new_world("visitor"), world("visitor")
    label = Sequence().labels[5]
    second.image(label, number=1, device_time_s=2.0)  # one more than the first

    images = [of.image(label, number=9, device_time_s=9.0).tobytes() for of in (first, second)]

    assert images[0] == images[1]
    assert images[0] != first.image(label, number=9, device_time_s=9.5).tobytes()


def test_without_motion_during_the_sequence_all_images_see_the_scene_at_its_first() -> None:
    quiet = {"shot-noise": "off", "read-noise": "off", "mixed-pixels": "off"}
    frozen = new_world("visitor", effects=quiet | {"motion": "off"})
    moving = new_world("visitor", effects=quiet | {"motion": "on"})
    period_s = 0.00192 + 4e-3
    labels = Sequence().labels
    at = {"number": 0, "device_time_s": 9.0}
    last = {"number": 0, "device_time_s": 9.0 + 12 * period_s}

    # the same phase of the same harmonic, as the first image and as a later one
    early, late = (
        frozen.image(labels[12], number=0, device_time_s=9.0 + 12 * period_s),
        frozen.image(labels[12], number=0, device_time_s=9.0 + 12 * period_s),
    )
    assert (early == late).all()
    assert (frozen.image(labels[12], **last) != moving.image(labels[12], **last)).any()  # type: ignore[arg-type]
    assert (frozen.image(labels[0], **at) == moving.image(labels[0], **at)).all()  # type: ignore[arg-type]


COMPOSED = """
[light]
position_m = [0, 0, 0]
aim_at_m = [0, 1, 0]
electrons_per_s = 1e7

[[motion]]
name = "swing"
period_s = 2
path_m = [[-0.5, 0, 0], [0.5, 0, 0]]
repeat = "back"

[[surface]]
kind = "diffuse"
shape = "sphere"
centre_m = [0, 2, 0]
radius_m = 0.5
albedo = 0.5
motion = "swing"

[[surface]]
kind = "translucent"
centre_m = [0, 3, 0]
normal = [0, -1, 0]
size_m = [3, 2]
albedo = 0.5
scatter_decay_s = 1e-9
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def test_a_composed_scene_is_seen_where_it_is_at_that_time(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, COMPOSED))
    views = scenery_of(scene, width=41, height=31).view(
        LightRequirements(frozenset({"scattering"}))
    )
    for time_s, x in ((0.0, -0.5), (0.5, 0.0), (1.0, 0.5)):
        delay_s = views.exact(time_s).returns()[0][0]
        nearest = np.nanargmin(delay_s[15])
        seen_at = math.tan(math.radians(22.5)) * (2 * (nearest + 0.5) / 41 - 1) * 1.55
        assert seen_at == pytest.approx(x, abs=0.15)


@pytest.mark.parametrize(
    ("old", "new", "key", "allowed"),
    [
        ("radius_m = 0.5", "radius_m = 0", "surface[0].radius_m", "at least 1e-06"),
        ("radius_m = 0.5", "", "surface[0].radius_m", "present"),
        ('"sphere"', '"cube"', "surface[0].shape", "rectangle, sphere, ellipsoid"),
        ('motion = "swing"', 'motion = "walk"', "surface[0].motion", "swing"),
        ('motion = "swing"', "motion = 3", "surface[0].motion", "a text or a list of texts"),
        ('repeat = "back"', 'repeat = "on"', "motion[0].repeat", "restart, back, loop"),
        ("period_s = 2", "period_s = 0", "motion[0].period_s", "at least"),
        ("[[-0.5, 0, 0], [0.5, 0, 0]]", "[[0, 0, 0]]", "motion[0].path_m", "at least 2"),
        ("[[-0.5, 0, 0], [0.5, 0, 0]]", "[[0, 0], [1, 1]]", "motion[0].path_m", "3 numbers"),
        ("scatter_decay_s = 1e-9", "", "surface[1].scatter_decay_s", "present"),
        ("scatter_decay_s = 1e-9", "scatter_decay_s = 1", "surface[1].scatter_decay_s", "1e-06"),
        ("[light]", "[device]\nprofile = 'new'\n[light]", "device.profile", "ideal, prototype"),
        ("[light]", "[device]\noutlier_share = 2\n[light]", "device.outlier_share", "at most 1"),
        ("[light]", "[ambient]\nelectrons_per_s = -1\n[light]", "ambient.electrons_per_s", "0"),
        ("radius_m = 0.5", "radius_m = 0.5\ngloss = 0.7", "surface[0].gloss", "at most 0.5"),
        ("[light]", "[camera.lens]\nk1 = 3\n[light]", "camera.lens.k1", "at most 1"),
        ("[light]", "[camera.lens]\nfocus = 3\n[light]", "camera.lens.focus", "vignetting"),
        (
            "[light]",
            "[device]\ndark_current_e_per_s = -1\n[light]",
            "device.dark_current_e_per_s",
            "0",
        ),
        ("[light]", "[ambient]\nflicker = 1.1\n[light]", "ambient.flicker", "at most 1"),
        ("[light]", "[ambient]\nflicker_hz = 0\n[light]", "ambient.flicker_hz", "at least 0.001"),
        (
            "[light]",
            "[ambient]\ncamera_electrons_per_s = 1e5\n[light]",
            "ambient.camera_hz",
            "present",
        ),
        ("[light]", "[device]\ncrosstalk = 0.9\n[light]", "device.crosstalk", "at most 0.8"),
        ("[light]", "[device]\nblooming = 1\n[light]", "device.blooming", "at most 0.9"),
        ("[light]", "[device]\nghost = -0.1\n[light]", "device.ghost", "at least 0"),
        ("[light]", "[device]\nnon_linearity = 1\n[light]", "device.non_linearity", "0.5"),
        (
            "[light]",
            "[device.jitter]\npower = 1\n[light]",
            "device.jitter.power",
            "of at least 0 and of at most 0.3",
        ),
        ("[light]", "[device.jitter]\nphase = 1\n[light]", "device.jitter.phase", "delay_s, power"),
        (
            "[light]",
            "[device.hot_pixels]\nshare = 0.1\n[light]",
            "device.hot_pixels.electrons_per_s",
            "present",
        ),
        (
            "[light]",
            "[device.noisy_pixels]\nshare = 0.1\nelectrons = 1e12\n[light]",
            "device.noisy_pixels.electrons",
            "at most 1e+09",
        ),
        (
            "[light]",
            "[device.drift]\nrise_c = 1e5\n[light]",
            "device.drift.rise_c",
            "at most 10000",
        ),
        ("[light]", "[transport]\npatches = 1\n[light]", "transport.patches", "from 2 to 64"),
        ("[light]", "[diffuser]\n[light]", "surface", "only one of them"),
        ("[light]", "[diffuser]\n[diffusor]\n[light]", "diffusor", "absent beside [diffuser]"),
    ],
)
def test_an_error_in_a_composition_is_named(
    tmp_path: Path, old: str, new: str, key: str, allowed: str
) -> None:
    assert old in COMPOSED

    with pytest.raises(SceneError) as caught:
        load_scene(write(tmp_path, COMPOSED.replace(old, new, 1)))

    assert caught.value.key == key
    assert allowed in caught.value.allowed


def test_mirrors_and_stencils_stay_in_their_place(tmp_path: Path) -> None:
    mirror = """
[[surface]]
kind = "mirror"
centre_m = [1, 1, 0]
normal = [-1, 0, 0]
size_m = [1, 1]
reflectivity = 0.9
motion = "swing"
"""
    with pytest.raises(SceneError, match="a mirror stays in its place"):
        load_scene(write(tmp_path, COMPOSED + mirror))


def test_a_device_file_that_is_missing_is_reported_when_the_camera_is_opened(
    tmp_path: Path,
) -> None:
    device = "[device]\nwaveform_file = 'absent.npy'\n"

    with pytest.raises(SceneError, match=r"absent.npy"):
        open_camera(f"sim:{write(tmp_path, device + COMPOSED)}")
