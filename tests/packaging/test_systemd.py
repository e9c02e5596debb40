"""The files of packaging/, held to the tools they are for."""

import configparser
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from transientcam_driver.cameras.open_usb import UDEV_RULE
from transientcam_driver.errors import UDEV_RULES_FILE

_PACKAGING = Path(__file__).resolve().parents[2] / "packaging"
_UNIT = _PACKAGING / "transientcam.service"
_INSTALLED = "/opt/transientcam/bin/transientcam"
_MOST_EXPOSED = 25
"""Tenths of systemd's points from 0 (sealed) to 10; a network service of root has more than 9."""

needs_systemd = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed"
)


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    """The unit with a program that is really there."""
    here = Path(sys.executable).with_name("transientcam")
    path = tmp_path / _UNIT.name
    path.write_text(_UNIT.read_text().replace(_INSTALLED, str(here)))
    return path


@needs_systemd
def test_systemd_takes_the_unit_without_a_word(unit: Path) -> None:
    done = subprocess.run(
        ["systemd-analyze", "verify", unit], capture_output=True, text=True, check=False
    )

    assert (done.returncode, done.stderr) == (0, "")


@needs_systemd
def test_the_service_is_sealed_off_as_far_as_it_can_be(unit: Path) -> None:
    command = ["systemd-analyze", "security", "--offline=true", f"--threshold={_MOST_EXPOSED}"]
    done = subprocess.run([*command, unit], capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout[-200:]


def service() -> configparser.SectionProxy:
    parser = configparser.ConfigParser(strict=False, interpolation=None)
    parser.optionxform = str  # type: ignore[assignment,method-assign]  # as its manual says
    parser.read(_UNIT)
    return parser["Service"]


def test_the_unit_waits_for_ready_and_is_restarted_when_frames_end() -> None:
    section = service()

    assert section["Type"] == "notify"
    assert int(section["WatchdogSec"]) > 10
    assert section["Restart"] == "on-failure"
    assert section["KillSignal"] == "SIGTERM"
    assert section["OOMPolicy"] == "continue"
    assert section.get("KillMode", "control-group") == "control-group"  # the supervisor's SIGTERM


def test_usb_can_be_reached_and_kernels_can_be_kept() -> None:
    section = service()

    assert section["DeviceAllow"] == "char-usb_device rw"
    assert "PrivateDevices" not in section
    assert "MemoryDenyWriteExecute" not in section
    assert "NUMBA_CACHE_DIR=%C/transientcam" in _UNIT.read_text()
    assert section["CacheDirectory"] == "transientcam"


def test_the_udev_rule_is_for_the_camera_the_driver_looks_for() -> None:
    rules = _PACKAGING / Path(UDEV_RULES_FILE).name
    rule, *_ = [line for line in rules.read_text().splitlines() if not line.startswith("#")]
    keys = re.compile(r'(?:^|, )((?:ATTR|ENV){\w+}|[A-Z]+)(==|\+?=)"([^"]*)"')
    parts = set(keys.findall(rule))

    assert set(keys.findall(UDEV_RULE)) <= parts
    assert ("MODE", "=", "0660") in parts
    assert ("TAG", "+=", "uaccess") in parts
    assert rules.name < "73-seat-late.rules"
    assert ", ".join(f'{key}{sign}"{value}"' for key, sign, value in keys.findall(rule)) == rule


def test_the_user_of_the_unit_is_made_by_the_file_beside_it() -> None:
    lines = (_PACKAGING / "transientcam.sysusers.conf").read_text().splitlines()
    made = [line.split()[:3] for line in lines if not line.startswith("#")]

    assert ["u", service()["User"], "-"] in made
    assert ["m", service()["User"], service()["SupplementaryGroups"]] in made
