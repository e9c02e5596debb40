"""The driver's findings for `transientcam doctor`, on file systems and buses made for it."""

import errno
import os
from pathlib import Path
from typing import Any

import pytest
import usb.backend.libusb1
import usb.core

from transientcam_driver.cameras.open_usb import UDEV_RULE
from transientcam_driver.cli.doctor import Reported, checks
from transientcam_driver.clock import VirtualClock
from transientcam_simulation.emulated import build, find_scene
from transientcam_simulation.emulated._open_usb.bus import SimulatedBus


def found(root: Path, bus: SimulatedBus | None = None) -> dict[str, Reported]:
    return {each[1]: each for each in checks(root=root, backend=bus or SimulatedBus([]))}


def rule(root: Path, text: str, name: str = "60-camera.rules") -> None:
    directory = root / "etc" / "udev" / "rules.d"
    directory.mkdir(parents=True)
    (directory / name).write_text(text)


@pytest.fixture
def user(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run as a user that needs a rule."""
    monkeypatch.setattr(os, "geteuid", lambda: 1000)


def test_a_machine_that_is_set_up_is_in_order(tmp_path: Path) -> None:
    (tmp_path / "dev/bus/usb/001").mkdir(parents=True)
    (tmp_path / "dev/bus/usb/001/003").touch()
    rule(tmp_path, UDEV_RULE + "\n")
    device, _ = build(find_scene("wall"), width=163, height=120, seed=1, clock=VirtualClock())

    seen = found(tmp_path, SimulatedBus([device]))

    assert {each[0] for each in seen.values()} == {"ok"}
    assert seen["USB"][2] == "1 device nodes below /dev/bus/usb"
    assert seen["udev rule"][2] == "/etc/udev/rules.d/60-camera.rules"
    assert seen["camera"][2].startswith("usb:SIM-ideal-0: ")


def test_without_device_nodes_a_container_is_advised(tmp_path: Path) -> None:
    level, _, message, remedy = found(tmp_path)["USB"]

    assert (level, message) == ("warning", "there is no /dev/bus/usb")
    assert "c 189:* rmw" in str(remedy)


@pytest.mark.usefixtures("user")
@pytest.mark.parametrize(
    "text",
    ["", "# " + UDEV_RULE, UDEV_RULE.replace("1209", "120a"), UDEV_RULE.replace("0001", "0002")],
)
def test_a_rule_that_is_not_there_or_not_for_this_camera_is_shown(
    tmp_path: Path, text: str
) -> None:
    rule(tmp_path, text)

    level, _, _, remedy = found(tmp_path)["udev rule"]

    assert level == "warning"
    assert UDEV_RULE in str(remedy)


@pytest.mark.usefixtures("user")
def test_a_rule_over_several_lines_and_in_capitals_is_a_rule(tmp_path: Path) -> None:
    rule(tmp_path, UDEV_RULE.replace("1209", "1209".upper()).replace(", ", ", \\\n  "))

    assert found(tmp_path)["udev rule"][0] == "ok"


def test_a_rule_that_tags_too_late_is_reported(tmp_path: Path) -> None:
    rule(tmp_path, UDEV_RULE, "99-camera.rules")

    level, _, message, remedy = found(tmp_path)["udev rule"]

    assert (level, remedy) == ("warning", "rename it to /etc/udev/rules.d/60-transientcam.rules")
    assert "73-seat-late" in message


def test_root_needs_no_rule(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 0)

    assert found(tmp_path)["udev rule"][0] == "ok"


def test_a_camera_that_may_not_be_opened_is_a_fault_with_its_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: Any) -> None:
        raise usb.core.USBError("Access denied", -3, errno.EACCES)

    device, _ = build(find_scene("wall"), width=163, height=120, seed=1, clock=VirtualClock())
    monkeypatch.setattr(SimulatedBus, "open_device", refused)

    level, _, message, remedy = found(tmp_path, SimulatedBus([device]))["camera"]

    assert level == "fault"
    assert message == "/dev/bus/usb/001/001: no permission to open /dev/bus/usb/001/001"
    assert UDEV_RULE in str(remedy)


def test_a_missing_libusb_is_reported_and_looked_no_further(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda: None)

    seen = {each[1]: each for each in checks(root=tmp_path)}

    assert seen["libusb"][0] == "warning"
    assert "apt install" in seen["libusb"][2]
    assert "camera" not in seen
