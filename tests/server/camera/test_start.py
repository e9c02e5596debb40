"""What the camera captures from the start is a setting."""

import logging

import pytest

from transientcam_driver import Sequence, open_camera
from transientcam_server.camera import start_with
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
