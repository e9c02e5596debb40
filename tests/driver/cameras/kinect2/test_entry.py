"""The plug-in ``kinect2``: which names it takes."""

import pytest

from transientcam_driver import CameraError, SpecError, open_camera
from transientcam_driver.camera import CameraName
from transientcam_driver.clock import VirtualClock
from transientcam_simulation.entries import kinect2


@pytest.mark.parametrize(
    ("spec", "reason"),
    [
        ("kinect2?rows=left", "rows = 'left': must be one of top, bottom"),
        ("kinect2?transfers=3", "transfers = '3': must be an integer from 16 to 1000"),
        ("kinect2:001?scene=hall", "scene belongs to kinect2:emulated"),
        ("kinect2:emulated?noise=some", "noise = 'some'"),
    ],
)
def test_a_name_that_is_not_valid_is_refused_with_the_part(spec: str, reason: str) -> None:
    with pytest.raises(SpecError, match=reason):
        kinect2.PLUGIN.check(CameraName.parse(spec))


@pytest.mark.parametrize("spec", ["kinect2", "kinect2:001?rows=bottom&transfers=120"])
def test_a_real_camera_is_any_or_that_with_a_serial_number(spec: str) -> None:
    kinect2.PLUGIN.check(CameraName.parse(spec))


def test_the_emulated_one_is_listed_without_libusb(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise CameraError("the package libusb1 is not installed")

    monkeypatch.setattr(kinect2, "list_kinects", missing)

    assert [each.spec for each in kinect2.PLUGIN.find()] == ["kinect2:emulated"]


def test_the_reading_of_the_rows_is_a_fact_of_the_report() -> None:
    (fact,) = kinect2.PLUGIN.facts(CameraName.parse("kinect2:emulated?rows=bottom"))

    assert fact[0] == "rows"
    assert "counted from the bottom row" in fact[1]


def test_the_emulated_one_stands_before_two_walls_unless_a_scene_is_named() -> None:
    with open_camera("kinect2:emulated", clock=VirtualClock()) as camera:
        assert camera.simulation is not None
        assert camera.simulation.scene == "corner"
