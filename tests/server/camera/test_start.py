"""What the camera captures from the start is a setting."""

import logging
import math
from typing import Any, cast

import pytest

from transientcam_driver import Camera, Sequence, open_camera
from transientcam_server.camera import LightRules, start_with
from transientcam_server.settings import SequenceSettings, Settings


def test_the_default_measures_four_harmonics_and_no_zeroth_moment() -> None:
    with open_camera("sim:wall") as camera:
        start_with(camera, Settings().sequence)
        applied = camera.applied

    assert (applied.sequence.harmonics, applied.sequence.zeroth) == (4, "estimated")
    assert applied.images == 16
    assert applied.capture_s < 0.1


def test_what_is_set_is_captured() -> None:
    chosen = SequenceSettings(harmonics=2, zeroth="on-off", exposure_s=0.001, takes=3)
    with open_camera("sim:wall") as camera:
        start_with(camera, chosen)
        found = camera.applied.sequence

    assert (found.harmonics, found.zeroth, found.takes) == (2, "on-off", 3)
    assert found.exposure_s == pytest.approx(0.001, rel=1e-3)


def test_a_camera_that_cannot_do_it_does_what_is_nearest(caplog: pytest.LogCaptureFixture) -> None:
    with open_camera("sim:wall") as camera, caplog.at_level(logging.WARNING):
        most = camera.capabilities.max_harmonics
        start_with(camera, SequenceSettings(harmonics=32, base_frequency_hz=23e6))
        found = camera.applied.sequence

    assert found != Sequence()
    assert found.harmonics <= most
    assert found.base_frequency_hz * found.harmonics <= camera.capabilities.max_frequency_hz
    assert "starts with" in caplog.text


def rules(spec: str, camera: str = "sim:wall", **settings: Any) -> LightRules:
    with open_camera(camera) as opened:
        return LightRules.of(opened, Settings(camera=spec, **settings))


class OfDevice:
    """A camera whose device is none that is simulated here."""

    simulation = None

    def __init__(self, camera: Camera) -> None:
        self.capabilities = camera.capabilities


def test_a_simulated_camera_captures_from_the_start_without_delay_and_for_ever() -> None:
    found = rules("sim:wall?seed=1")

    assert found == LightRules("sim:wall?seed=1", True, 0.0, math.inf, math.inf)


@pytest.mark.parametrize("spec", ["usb", "usb:42", "kinect2", "tofcam660:10.0.0.1", "own"])
def test_a_device_starts_dark_and_is_known_by_its_serial_number(spec: str) -> None:
    with open_camera("sim:wall") as camera:
        device = OfDevice(camera)
    about, found = device.capabilities, LightRules.of(cast("Camera", device), Settings(camera=spec))

    assert found == LightRules(f"{about.model} {about.serial}", False, 3.0, 300.0, 1.0)


@pytest.mark.parametrize("kind", ["kinect2", "tofcam660", "opt8241"])
def test_an_emulated_device_captures_from_the_start_and_else_counts_as_the_device(
    kind: str,
) -> None:
    spec = f"{kind}:emulated?scene=wall"
    found = rules(spec, spec)

    assert (found.capture_at_start, found.delay_s, found.unused_s) == (True, 3.0, 300.0)
    assert found.unit
    assert "emulated?" not in found.unit


def test_a_recording_is_replayed_from_the_start_and_nothing_is_kept_of_it() -> None:
    assert rules("recording:a.h5") == LightRules(None, True, 0.0, math.inf, math.inf)


@pytest.mark.parametrize("spec", ["sim:wall", "usb", "recording:a.h5"])
def test_what_is_set_goes_before_what_suits_the_camera(spec: str) -> None:
    light = {"delay_s": 0.5, "unused_s": 7.0}
    lit = rules(spec, capture_at_start=True, light=light)
    dark = rules(spec, capture_at_start=False, light={"delay_s": 0.0, "unused_s": 0.0})

    assert (lit.capture_at_start, lit.delay_s, lit.unused_s) == (True, 0.5, 7.0)
    assert (dark.capture_at_start, dark.delay_s, dark.unused_s) == (False, 0.0, math.inf)
