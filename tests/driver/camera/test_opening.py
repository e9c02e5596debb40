import json
import sys
from functools import partial
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.driver.conftest import OpenCamera
from transientcam_driver import (
    CameraName,
    CameraNotFound,
    CameraPlugin,
    PluginError,
    SceneError,
    SpecError,
)
from transientcam_driver.camera import _opening as opening, check_camera, open_camera
from transientcam_driver.camera._plugin import GROUP
from transientcam_driver.cameras.open_usb._transport import SameCamera
from transientcam_simulation.emulated._open_usb.bus import SimulatedBus
from transientcam_simulation.entries.sim import SimulatedScene, scene_of


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        ("usb", CameraName("usb", "usb")),
        ("usb:A-17", CameraName("usb:A-17", "usb", "A-17")),
        ("lidar:10.0.0.7:5000", CameraName("lidar:10.0.0.7:5000", "lidar", "10.0.0.7:5000")),
        (
            "sim:a/b.toml?noise=on&seed=",
            CameraName(
                "sim:a/b.toml?noise=on&seed=", "sim", "a/b.toml", {"noise": "on", "seed": ""}
            ),
        ),
    ],
)
def test_a_name_is_taken_apart(spec: str, expected: CameraName) -> None:
    assert CameraName.parse(spec) == expected


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        ("sim:mirrors", SimulatedScene("mirrors")),
        ("sim:mirrors?noise=off&seed=3", SimulatedScene("mirrors", noise=False, seed=3)),
        ("sim:wall?device=prototype", SimulatedScene("wall", device="prototype")),
        (
            "sim:measured:x.npz?background=median&time_zero=peak",
            SimulatedScene("measured:x.npz", background="median", time_zero="peak"),
        ),
    ],
)
def test_a_simulated_cameras_name_says_its_scene(spec: str, expected: SimulatedScene) -> None:
    assert scene_of(CameraName.parse(spec)) == expected


@pytest.mark.parametrize(
    ("spec", "reason"),
    [
        ("", "no camera is called ''"),
        ("webcam", "no camera is called 'webcam'; known are kinect2, "),
        ("usb:A-17?speed=3", "unknown option 'speed'; there are none"),
        ("sim:", "it names no scene"),
        ("sim:mirrors?depth=3", "unknown option 'depth'"),
        ("sim:mirrors?width=320", "width and height come together"),
        (
            "sim:mirrors?width=100&height=100",
            "100 x 100: known are 163 x 120, 320 x 240, 640 x 480",
        ),
        ("sim:mirrors?width=x&height=240", "width = 'x'"),
        ("sim:mirrors?noise=no", "noise = 'no': must be one of on, off"),
        ("sim:mirrors?seed=-1", "seed = '-1'"),
        ("sim:mirrors?device=mine", "device = 'mine': must be one of ideal, prototype"),
        ("sim:mirrors?seed=99999999999999999999", "seed"),
        ("sim:mirrors?background=median", "belong to sim:measured:PATH.npz"),
        ("sim:measured:x.npz?background=mean", "one of none, median"),
    ],
)
def test_a_name_that_cannot_be_read_says_why(spec: str, reason: str) -> None:
    with pytest.raises(SpecError) as caught:
        open_camera(spec)

    assert reason in str(caught.value)
    assert repr(spec) in str(caught.value)


def test_measured_alone_requires_a_file() -> None:
    with pytest.raises(SceneError, match=r"measured:PATH\.npz with a file"):
        open_camera("sim:measured")


def test_an_unknown_scene_names_the_known_ones() -> None:
    with pytest.raises(SceneError, match="mirrors"):
        open_camera("sim:hall-of-mirrors")


def test_an_absent_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"absent\.npz.*No such file"):
        open_camera(f"sim:measured:{tmp_path}/absent.npz")


def test_without_a_camera_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "transientcam_driver.cameras.open_usb._plugin.SameCamera",
        partial(SameCamera, backend=SimulatedBus([])),
    )

    with pytest.raises(CameraNotFound, match="A-17"):
        open_camera("usb:A-17")


@pytest.mark.parametrize(("width", "height"), [(163, 120), (320, 240), (640, 480)])
def test_resolutions_can_be_chosen(open_virtual: OpenCamera, width: int, height: int) -> None:
    camera = open_virtual(f"sim:wall?width={width}&height={height}")
    camera.start()

    assert camera.read_frame().images.shape == (16, height, width)


def test_without_noise_two_frames_are_the_same_and_16_bits_are_used(
    open_virtual: OpenCamera,
) -> None:
    camera = open_virtual("sim:mirrors?noise=off")
    camera.start()
    first, second = camera.read_frame(), camera.read_frame()

    assert np.array_equal(first.images, second.images)
    assert camera.capabilities.bits == 16
    assert 30_000 < first.images.max() < 65_535


def test_with_noise_two_frames_differ(open_virtual: OpenCamera) -> None:
    camera = open_virtual("sim:mirrors")
    camera.start()

    assert not np.array_equal(camera.read_frame().images, camera.read_frame().images)


def test_a_scene_file_is_opened_by_its_path(open_virtual: OpenCamera, tmp_path: Path) -> None:
    path = tmp_path / "wall.toml"
    path.write_text(
        """
[light]
position_m = [0, 0, 0]
aim_at_m = [0, 1, 0]
electrons_per_s = 2e7
[[surface]]
kind = "diffuse"
centre_m = [0, 2, 0]
normal = [0, -1, 0]
size_m = [4, 4]
albedo = 0.5
"""
    )
    camera = open_virtual(f"sim:{path}")
    camera.start()
    camera.read_frame()

    assert camera.simulation is not None
    assert camera.simulation.truth().range_m[60, 81] == pytest.approx(2.0, abs=1e-4)


def test_a_simulated_unit_keeps_its_serial_number_before_every_scene(
    open_virtual: OpenCamera,
) -> None:
    serials = [
        open_virtual(f"sim:{scene}?device={device}").capabilities.serial
        for device in ("prototype", "ideal")
        for scene in ("mirrors", "calibration")
    ]
    assert serials == ["SIM-prototype-0"] * 2 + ["SIM-ideal-0"] * 2


def test_measured_files_may_be_given_by_name(open_virtual: OpenCamera, tmp_path: Path) -> None:
    path = tmp_path / "counts.npz"
    np.savez(path, counts=[5, 5, 5, 5, 405, 5], bin_s=1e-9)

    camera = open_virtual(f"sim:measured:{path}?background=median&time_zero=start")

    assert camera.simulation is not None
    assert camera.simulation.scene == "measured"
    time_s, density = camera.simulation.truth().impulse_response(0, 0)
    assert time_s[density > 0] == pytest.approx([4.5e-9])


def test_the_snr_of_the_papers_single_take_is_good_but_visibly_noisy(
    open_virtual: OpenCamera,
) -> None:
    camera = open_virtual("sim:mirrors")
    camera.start()
    assert camera.simulation is not None
    truth = camera.simulation.truth()

    frames = np.array([camera.read_frame().images for _ in range(12)], dtype=np.float64)
    buckets = frames.reshape(12, 4, 4, 120, 163)[:, 1:]
    moments = buckets[:, :, 0] - buckets[:, :, 2] + 1j * (buckets[:, :, 1] - buckets[:, :, 3])
    sigma = np.sqrt(moments.var(axis=0, ddof=1).mean(axis=0) / 2) / 0.79  # |G_1| at n = 8
    snr = np.median(truth.direct / sigma)

    assert 50 < snr < 100


def offer(monkeypatch: pytest.MonkeyPatch, *values: str) -> None:
    """Let packages offer a camera called `odd`."""
    points = [EntryPoint("odd", value, GROUP) for value in values]
    monkeypatch.setattr(opening, "entry_points", lambda **_: points)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (["package_that_is_not_there:PLUGIN"], "package_that_is_not_there is not installed"),
        (["math:pi"], "math:pi is a float, not a CameraPlugin"),
        (["math:tau_and_more"], "cannot be imported: AttributeError"),
        (["a:PLUGIN", "b:PLUGIN"], "several packages offer it: a:PLUGIN, b:PLUGIN"),
    ],
)
def test_a_plug_in_that_cannot_be_used_says_why(
    monkeypatch: pytest.MonkeyPatch, values: list[str], reason: str
) -> None:
    offer(monkeypatch, *values)

    with pytest.raises(PluginError, match=reason):
        open_camera("odd:1")


@pytest.mark.parametrize(
    ("opens", "reason"),
    [
        (lambda name, clock: name.options["lut"], r"open\(\) raised KeyError\('lut'\)"),
        (lambda name, clock: json.loads("{"), r"open\(\) raised JSONDecodeError\("),
        (lambda name, clock: sys.exit(5), r"open\(\) raised SystemExit\(5\)"),
        (lambda name, clock: None, r"open\(\) returned None, no Camera"),
    ],
)
def test_what_a_package_does_instead_of_opening_a_camera_is_said(
    monkeypatch: pytest.MonkeyPatch, opens: Any, reason: str
) -> None:
    plugin = CameraPlugin("odd", "odd:", opens)
    monkeypatch.setattr(opening, "plugin_of", lambda spec: (CameraName.parse(spec), plugin))

    with pytest.raises(PluginError, match=reason):
        open_camera("odd:1")


def test_a_camera_is_checked_without_being_opened() -> None:
    check_camera("usb:not-there")
    check_camera("sim:wall")
    with pytest.raises(SceneError):
        check_camera("sim:hall-of-mirrors")
    with pytest.raises(SpecError):
        check_camera("sim:wall?height=3")


@pytest.mark.parametrize("text", ["", "x", "nan", "inf", "-1", "1e9"])
def test_a_number_in_a_name_is_one_within_its_limits(text: str) -> None:
    name = CameraName("a:?wait=" + text, "a", options={"wait": text})

    with pytest.raises(SpecError, match=r"wait = .* a number from 0 to 10"):
        name.number("wait", 1.0, least=0.0, most=10.0)
    assert CameraName("a", "a").number("wait", 1.0, least=0.0, most=10.0) == 1.0
