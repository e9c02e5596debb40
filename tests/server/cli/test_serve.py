"""Opening a camera that another program is about to give back."""

import pytest

import transientcam_driver
from transientcam_driver import CameraBusy
from transientcam_server.cli.serve import open_after_others


class Held:
    """A camera that another program holds until some time, and the clock."""

    def __init__(self, until_s: float) -> None:
        self.now_s = 0.0
        self._until_s = until_s

    def open(self, spec: str) -> "Held":
        assert spec == "kinect2"
        if self.now_s < self._until_s:
            raise CameraBusy("/dev/bus/usb/002/001")
        return self

    def pause(self, duration_s: float) -> None:
        self.now_s += duration_s


def opened(held: Held, monkeypatch: pytest.MonkeyPatch) -> object:
    monkeypatch.setattr(transientcam_driver, "open_camera", held.open)
    return open_after_others("kinect2", pause=held.pause)


def test_a_supervisor_that_still_switches_off_is_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    held = Held(until_s=5.0)

    assert opened(held, monkeypatch) is held
    assert held.now_s == pytest.approx(5.0, abs=0.2)


def test_another_program_that_keeps_the_camera_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CameraBusy, match="/dev/bus/usb/002/001"):
        opened(Held(until_s=1e9), monkeypatch)
