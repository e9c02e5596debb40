"""What doctor says of Kinects v2, on file systems made for it."""

import os
from pathlib import Path

import pytest

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


def found(root: Path) -> dict[str, Reported]:
    return {each[1]: each for each in checks(root=root, package=lambda: None)}


def test_without_a_kinect_there_is_one_line(tmp_path: Path) -> None:
    plug(tmp_path, product="02ae")  # a Kinect of the first version

    assert list(checks(root=tmp_path)) == [("ok", "Kinect v2", "none is plugged in", None)]


def test_a_machine_that_is_set_up_is_in_order(tmp_path: Path) -> None:
    plug(tmp_path)
    memory(tmp_path, "16\n")

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
