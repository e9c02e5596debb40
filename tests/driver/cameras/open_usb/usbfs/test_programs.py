"""Whole programs on the emulated bus: the daemon, a program that dies, and lsusb."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

import transientcam
from tests.driver.cameras.open_usb.usbfs.processes import (
    EmulatedCamera,
    Program,
    emulated_camera,
    skip_or_fail,
)
from tests.waiting import wait_until

QUICK = {"harmonics": 1, "zeroth": "estimated", "exposure_s": 0.0005}


@pytest.fixture
def usb_camera() -> Iterator[EmulatedCamera]:
    with emulated_camera() as camera:
        yield camera


@pytest.fixture(scope="module")
def idle_camera() -> Iterator[EmulatedCamera]:
    """One for all tests that only look at it."""
    with emulated_camera() as camera:
        yield camera


@contextmanager
def daemon(camera: EmulatedCamera) -> Iterator[tuple[str, "subprocess.Popen[str]"]]:
    """``transientcam serve --camera usb`` as a user would start it, without the compiler."""
    process = subprocess.Popen(
        [
            *(sys.executable, "-c", "from transientcam.cli import main; main()"),
            *("serve", "--camera", "usb", "--port", "0"),
        ],
        stdout=subprocess.PIPE,
        text=True,
        env=camera.environment
        | {"NUMBA_DISABLE_JIT": "1", "COLUMNS": "200"}
        | {"TRANSIENTCAM_CAPTURE_AT_START": "true", "TRANSIENTCAM_LIGHT__DELAY_S": "0"},
    )
    assert process.stdout is not None
    try:
        line = process.stdout.readline()
        found = re.search(r"http://\S+", line)
        assert found, line
        yield found.group(), process
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def test_frames_travel_from_the_usb_endpoint_to_a_clients_array(usb_camera: EmulatedCamera) -> None:
    with daemon(usb_camera) as (url, process), transientcam.Camera(url, timeout_s=60) as camera:
        camera.sequence = QUICK
        with camera.stream("raw", "range") as stream:
            frames = iter(stream)
            raw = next(f for f in frames if f.product == "raw" and f.meta["harmonics"] == 1)
            depth = next(f for f in frames if f.product == "range" and f.meta["harmonics"] == 1)

            assert raw.array.shape == (4, 120, 163)
            assert raw.array.dtype == np.uint16
            assert np.isfinite(depth.array).mean() > 0.9
            wait_until(lambda: usb_camera.lit)  # a laden machine leaves it to its watchdog at times

            usb_camera.do("unplug")
            while camera.camera["state"] != "lost":
                time.sleep(0.05)
            usb_camera.do("replug")
            kinds: list[str] = []
            for frame in frames:  # notices come among them
                kinds = [notice.kind for notice in stream.notices]
                if "camera-back" in kinds:
                    assert frame.meta["harmonics"] == 1
                    break

            assert kinds.index("camera-lost") < kinds.index("camera-back")
            wait_until(lambda: usb_camera.lit)  # a laden machine leaves it to its watchdog at times

        process.send_signal(signal.SIGTERM)
        assert process.wait(60.0) == 0
        assert not usb_camera.lit


def test_the_light_goes_off_when_the_program_dies(usb_camera: EmulatedCamera) -> None:
    program = Program(usb_camera.environment)
    camera = program.open()
    camera.start()
    camera.read_frame(timeout_s=60.0)
    assert usb_camera.lit

    program.kill()

    while usb_camera.lit:  # the device's watchdog; the test's own time limit ends this
        time.sleep(0.05)


def test_lsusb_reads_every_descriptor_without_a_warning(idle_camera: EmulatedCamera) -> None:
    lsusb = shutil.which("lsusb", path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")
    if lsusb is None:
        skip_or_fail("lsusb missing: apt install usbutils")
    listed = subprocess.run(
        [str(lsusb), "-v", "-d", "1209:0001"],
        env=idle_camera.environment,
        capture_output=True,
        text=True,
        timeout=60,
    )

    assert (listed.returncode, listed.stderr) == (0, "")
    words = " ".join(listed.stdout.split())
    for complaint in (
        "can't get",
        "cannot",
        "couldn't",
        "invalid",
        "unrecognized",
        "warning",
        "missing",
    ):
        assert complaint not in words.lower()
    for said in (
        "idVendor 0x1209",
        "idProduct 0x0001",
        "bcdUSB 2.10",
        "iManufacturer 1 transientcam",
        "iProduct 2 AMCW lidar (simulated)",
        "iSerial 3 SIM-ideal-0",
        "bInterfaceClass 255",
        "bEndpointAddress 0x81 EP 1 IN",
        "wMaxPacketSize 0x0200 1x 512 bytes",
        "Binary Object Store Descriptor",
        "bNumDeviceCaps 2",
        "PlatformCapabilityUUID {d8dd60df-4589-4cc7-9cd2-659d9e648a9f}",
        "Device Status: 0x0000",
    ):
        assert said in words, listed.stdout


def test_devices_lists_the_camera_on_the_bus(idle_camera: EmulatedCamera) -> None:
    program = "from transientcam.cli import main; main()"
    listed = subprocess.run(
        [sys.executable, "-c", program, "devices", "--no-network"],
        env=idle_camera.environment | {"COLUMNS": "200"},
        capture_output=True,
        text=True,
        timeout=60,
    )

    assert (listed.returncode, listed.stderr) == (0, "")
    assert "usb:SIM-ideal-0" in listed.stdout
