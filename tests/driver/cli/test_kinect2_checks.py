"""What doctor says of Kinects v2, on file systems made for it."""

import json
import os
from pathlib import Path

import pytest

from transientcam.cli import run as command
from transientcam_driver import CameraError
from transientcam_driver.cameras.kinect2 import UDEV_RULES
from transientcam_driver.cli.kinect2_checks import Reported, checks


def plug(root: Path, name: str = "2-1", *, product: str = "02d8", speed: str = "5000") -> None:
    folder = root / "sys/bus/usb/devices" / name
    folder.mkdir(parents=True)
    address = name[-1]
    texts = {"idVendor": "045e", "idProduct": product, "busnum": "2", "devnum": address}
    for file, text in (texts | {"speed": speed, "serial": f"00{address}"}).items():
        (folder / file).write_text(f"{text}\n")
    (folder.parent / f"{name}:1.0").mkdir()
    node = root / f"dev/bus/usb/002/00{address}"
    node.parent.mkdir(parents=True, exist_ok=True)
    node.touch()


def memory(root: Path, text: str) -> None:
    file = root / "sys/module/usbcore/parameters/usbfs_memory_mb"
    file.parent.mkdir(parents=True)
    file.write_text(text)


def controller(root: Path, vendor: str, speed: str = "5000") -> None:
    """A bus of a PCI device, as the kernel links it."""
    device = root / "sys/devices/pci0000:00/0000:00:14.0"
    (device / "usb2").mkdir(parents=True)
    (device / "vendor").write_text(f"{vendor}\n")
    (device / "usb2/speed").write_text(f"{speed}\n")
    (root / "sys/bus/usb/devices").mkdir(parents=True, exist_ok=True)
    (root / "sys/bus/usb/devices/usb2").symlink_to(device / "usb2")


def found(root: Path) -> dict[str, Reported]:
    return {each[1]: each for each in checks(root=root, package=lambda: None)}


def test_without_a_kinect_there_is_one_line(tmp_path: Path) -> None:
    plug(tmp_path, product="02ae")  # a Kinect of the first version

    assert list(checks(root=tmp_path)) == [("ok", "Kinect v2", "none is plugged in", None)]


def test_a_machine_that_is_set_up_is_in_order(tmp_path: Path) -> None:
    plug(tmp_path)
    memory(tmp_path, "16\n")
    controller(tmp_path, "0x8086")

    seen = found(tmp_path)

    assert {each[0] for each in seen.values()} == {"ok"}
    assert seen["Kinect v2"][2] == "kinect2:001 at /dev/bus/usb/002/001, 5000 Mbit/s"
    assert seen["Kinect v2: usbfs_memory_mb"][2] == "16 MB, of which 16 are needed"


def test_both_readings_of_the_rows_are_explained(tmp_path: Path) -> None:
    plug(tmp_path)

    seen = found(tmp_path)

    assert "OpenCL" in seen["Kinect v2: rows=top (without an option)"][2]
    assert "CPU" in seen["Kinect v2: rows=bottom"][2]


def test_a_slow_port_is_a_fault(tmp_path: Path) -> None:
    plug(tmp_path, speed="480")

    level, _, message, remedy = found(tmp_path)["Kinect v2"]

    assert level == "fault"
    assert "480 Mbit/s" in message
    assert "USB 3" in str(remedy)


@pytest.mark.parametrize(
    ("text", "level", "message"),
    [
        ("16", "fault", "16 MB, of which 32 are needed"),
        ("32", "ok", "32 MB, of which 32 are needed"),
        ("0", "ok", "without a limit"),
        ("?", "warning", "32 MB are needed"),
    ],
)
def test_the_memory_of_usbfs_has_to_do_for_all_cameras(
    tmp_path: Path, text: str, level: str, message: str
) -> None:
    plug(tmp_path)
    plug(tmp_path, "2-2", product="02c4")
    memory(tmp_path, text)

    seen = found(tmp_path)["Kinect v2: usbfs_memory_mb"]

    assert seen[0] == level
    assert message in seen[2]


def test_a_node_that_may_not_be_opened_is_shown_with_the_rule(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plug(tmp_path)
    monkeypatch.setattr(os, "access", lambda path, mode: False)

    level, _, message, remedy = found(tmp_path)["Kinect v2: permission"]

    assert (level, message) == ("fault", "this user may not open /dev/bus/usb/002/001")
    assert UDEV_RULES in str(remedy)


def test_a_missing_package_is_a_fault_with_what_installs_it(tmp_path: Path) -> None:
    def absent() -> None:
        raise CameraError("the package libusb1 is not installed: pip install it")

    plug(tmp_path)

    seen = {each[1]: each for each in checks(root=tmp_path, package=absent)}

    assert seen["Kinect v2: libusb"][0] == "fault"
    assert seen["Kinect v2: libusb"][3] == "pip install it"


@pytest.mark.parametrize(
    ("vendor", "speed", "level", "words"),
    [
        ("0x8086", "10000", "ok", "usb2: Intel, known to work"),
        ("0x1b21", "5000", "warning", "usb2: ASMedia, frames are lost with it"),
        ("0x10de", "5000", "ok", "usb2: vendor 10de, few reports are known"),
        ("0x8086", "480", "fault", "this machine has no USB 3"),
    ],
)
def test_a_host_is_judged_without_a_kinect(
    tmp_path: Path, vendor: str, speed: str, level: str, words: str
) -> None:
    controller(tmp_path, vendor, speed)

    seen = {each[1]: each for each in checks(root=tmp_path, package=lambda: None, host=True)}

    assert seen["Kinect v2"][2] == "none is plugged in"
    assert seen["Kinect v2: controller"][:3] == (level, "Kinect v2: controller", words)
    assert (seen["Kinect v2: controller"][3] is None) == (level == "ok")


def test_a_hub_without_its_camera_tells_of_power_or_cable(tmp_path: Path) -> None:
    plug(tmp_path, product="02d9", speed="480")

    (level, _, message, remedy), *_ = checks(root=tmp_path)

    assert (level, message) == (
        "fault",
        "its hub is at /dev/bus/usb/002/001, but no camera behind it",
    )
    assert "power supply" in str(remedy)


def test_a_virtual_machine_is_warned_of(tmp_path: Path) -> None:
    (tmp_path / "proc").mkdir()
    (tmp_path / "proc/cpuinfo").write_text("flags : fpu hypervisor lahf_lm\n")

    seen = {each[1]: each for each in checks(root=tmp_path, package=lambda: None, host=True)}

    assert seen["Kinect v2: host"][0] == "warning"


def test_the_verb_prints_what_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    controller(tmp_path, "0x8086", "480")

    code = command(["kinect2", "--check", "--root", str(tmp_path), "--json"])

    assert code == 1
    assert json.loads(capsys.readouterr().out)["verdict"] == "fault"
    assert command(["kinect2"]) == 2
