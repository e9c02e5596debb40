"""The link by libusb: the real one, in another process, on an emulated bus."""

import hashlib
import json
import os
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.driver.cameras.kinect2.standing import SERIAL, STILL, emulated
from tests.driver.cameras.kinect2.usb3 import Usb3Mount
from tests.driver.cameras.open_usb.usbfs.processes import PRELOAD, missing_libraries, skip_or_fail
from transientcam_driver import CameraError
from transientcam_driver.cameras.kinect2 import codes
from transientcam_driver.cameras.kinect2._usb_port import require_bandwidth

PROGRAM = Path(__file__).parent / "usb_program.py"


class Program:
    def __init__(self, mount: Usb3Mount, root: Path) -> None:
        self.mount = mount
        environment = os.environ | {
            "UMOCKDEV_DIR": str(root),
            "LD_PRELOAD": PRELOAD,
            "SYSTEMD_DEVICE_VERIFY_SYSFS": "0",
        }
        self.process = subprocess.Popen(
            [sys.executable, PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
        )

    def do(self, step: str) -> Any:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{step}\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        assert line, f"the program ended with {self.process.wait(60.0)}"
        return json.loads(line)

    def close(self) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.wait(60)
        self.process.stdout.close()


@pytest.fixture
def program() -> Iterator[Program]:
    pytest.importorskip("usb1", reason="the package libusb1 is missing")
    if missing := missing_libraries():
        skip_or_fail(missing)
    # by a short path: names of sockets are limited to 107 characters
    with tempfile.TemporaryDirectory(prefix="usb-", dir="/tmp") as folder:
        mount = Usb3Mount(emulated(), SERIAL, Path(folder))
        made = Program(mount, Path(folder))
        try:
            yield made
        finally:
            made.close()
            mount.close()


def port(speed: int, per_interval: int) -> SimpleNamespace:
    """A device as the package usb1 describes it."""
    companion = struct.pack("<BBBBH", 6, 0x30, 15, 0, per_interval)
    endpoint = SimpleNamespace(getAddress=lambda: 0x84, getExtra=lambda: [b"\2\x77", companion])
    return SimpleNamespace(
        getDeviceSpeed=lambda: speed,
        getBusNumber=lambda: 2,
        getDeviceAddress=lambda: 7,
        iterSettings=lambda: [[], [endpoint]],
    )


def test_a_port_without_the_bandwidth_is_refused() -> None:
    require_bandwidth(port(4, 0x8400))
    with pytest.raises(CameraError, match="/dev/bus/usb/002/007 is on a port slower than USB 3"):
        require_bandwidth(port(3, 0x8400))
    with pytest.raises(CameraError, match="33791 bytes an interval, and 33792 are needed"):
        require_bandwidth(port(4, 0x83FF))


def test_frames_travel_through_isochronous_transfers_of_the_real_libusb(program: Program) -> None:
    camera = program.mount.device.camera
    shown = hashlib.sha256(codes.frame_images(STILL.data).tobytes()).hexdigest()

    assert program.do("list") == [[f"kinect2:{SERIAL}", None]]
    assert program.do("open") == [SERIAL, "2.3.3913.7"]
    assert not camera.lit

    program.mount.memory_bytes = 4_000_000
    assert "usbfs_memory_mb is too small" in str(program.do("start"))
    assert not camera.lit
    program.mount.memory_bytes = None

    for _ in range(2):  # it can be started again
        assert program.do("start") == "streaming"
        assert camera.lit
        assert program.do("read") == shown
        assert program.do("stop") == "idle"
        assert not camera.lit

    program.do("start")
    program.do("read")
    program.mount.unplug()
    found = shown
    while found == shown:  # what had arrived before
        found = program.do("read")
    assert "CameraLost" in found
    assert "Camera" in str(program.do("reconnect"))
    program.mount.replug()
    assert program.do("reconnect") == "streaming"
    assert program.do("read") == shown
    assert program.do("stop") == "idle"
    program.mount.unplug()
    assert "CameraLost" in program.do("status")
    assert program.do("close") == "disconnected"
    assert "Camera" in str(program.do("open"))  # libusb 1.0.26 had aborted the process by now
