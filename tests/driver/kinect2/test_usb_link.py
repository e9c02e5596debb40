"""The link by libusb: the real one, in another process, on an emulated bus."""

import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.driver.kinect2.standing import SERIAL, STILL, emulated
from tests.driver.kinect2.usb3 import Usb3Mount
from tests.driver.usbfs.processes import PRELOAD, missing_libraries, skip_or_fail
from transientcam_driver.kinect2 import measurement

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
        assert line, f"the program ended with {self.process.wait(10)}"
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


def test_frames_travel_through_isochronous_transfers_of_the_real_libusb(program: Program) -> None:
    camera = program.mount.device.camera
    shown = hashlib.sha256(measurement.images(STILL.data).tobytes()).hexdigest()

    assert program.do("list") == [[f"kinect2:{SERIAL}", None]]
    assert program.do("open") == [SERIAL, "2.3.3913.7"]
    assert not camera.lit
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
