"""The same firmware under the real libusb: real usbfs ioctls, in a process of its own."""

import ctypes.util
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

PRELOAD = "libumockdev-preload.so.0"
HERE = Path(__file__).parent


class Process:
    """A script that answers each line with a line of JSON."""

    def __init__(self, script: str, *arguments: str, environment: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, HERE / script, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | environment,
        )

    def hear(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        assert line, f"the process ended with {self._process.wait(10)}"
        return json.loads(line)

    def ask(self, line: str) -> Any:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()
        return self.hear()

    def end(self) -> int:
        """Close its input; return how it ended."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        try:
            return self._process.wait(30)
        finally:
            self._process.kill()
            self._process.wait()
            self._process.stdout.close()

    def kill(self) -> None:
        """Let it die without a word."""
        self._process.kill()
        self._process.wait()


@pytest.fixture
def root() -> Iterator[Path]:
    """The device tree, by a short path: names of sockets are limited to 107 characters."""
    missing = [
        name
        for name, found in (
            (PRELOAD, _loads(PRELOAD)),
            ("libusb-1.0", ctypes.util.find_library("usb-1.0")),
        )
        if not found
    ]
    if missing:
        advice = f"{' and '.join(missing)} missing: apt install umockdev libusb-1.0-0"
        if os.environ.get("CI"):
            pytest.fail(advice)
        pytest.skip(advice)
    with tempfile.TemporaryDirectory(prefix="usb-", dir="/tmp") as folder:
        yield Path(folder)


def _loads(library: str) -> bool:
    code = f"import ctypes; ctypes.CDLL({library!r})"
    return subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


@pytest.fixture
def server(root: Path) -> Iterator[Process]:
    process = Process("server.py", str(root), environment={})
    try:
        assert process.hear() == "ready"
        yield process
    finally:
        assert process.end() == 0


@pytest.fixture
def start_client(server: Process, root: Path) -> Iterator[Any]:
    with ExitStack() as stack:

        def start() -> Process:
            process = Process(
                "client.py",
                environment={
                    "UMOCKDEV_DIR": str(root),
                    "LD_PRELOAD": PRELOAD,
                    # libudev would refuse a sysfs that is none
                    "SYSTEMD_DEVICE_VERIFY_SYSFS": "0",
                },
            )
            stack.callback(process.end)
            return process

        yield start


def test_frames_stream_through_the_real_libusb_and_survive_a_replug(
    server: Process, start_client: Any
) -> None:
    client = start_client()
    opened = client.ask("open")
    assert opened == {"value": {"serial": "SIM-ideal-0", "state": "idle"}}
    assert server.ask("light") is False
    assert client.ask("start") == {"value": {"images": 12, "epoch": 2}}
    frames = [client.ask("read")["value"] for _ in range(4)]

    numbers = [frame["number"] for frame in frames]
    assert numbers == sorted(set(numbers))
    assert {tuple(frame["shape"]) for frame in frames} == {(12, 120, 163)}
    assert all(frame["mean"] > 100 and frame["resyncs"] == 0 for frame in frames)
    assert server.ask("light") is True

    assert server.ask("unplug") == "done"
    assert client.ask("read")["error"] == "CameraLost"
    assert client.ask("reconnect")["error"] == "CameraNotFound"

    assert server.ask("replug") == "done"
    for _ in range(200):  # the news of the plug travels through udev's monitor
        answer = client.ask("reconnect")
        if "value" in answer:
            break
        assert answer["error"] == "CameraNotFound"
    assert answer == {"value": "streaming"}
    frame = client.ask("read")["value"]
    assert (frame["number"], tuple(frame["shape"])) == (0, (12, 120, 163))

    assert client.ask("close") == {"value": "disconnected"}
    assert server.ask("light") is False


def test_a_halted_endpoint_is_cleared_through_the_real_libusb(
    server: Process, start_client: Any
) -> None:
    client = start_client()
    client.ask("open")
    client.ask("start")
    before = client.ask("read")["value"]["number"]
    assert server.ask("halt") == "done"

    assert client.ask("read")["value"]["number"] > before
    client.ask("close")


def test_the_light_goes_off_when_the_process_dies(server: Process, start_client: Any) -> None:
    client = start_client()
    client.ask("open")
    client.ask("start")
    client.ask("read")
    assert server.ask("light") is True

    client.kill()

    while server.ask("light"):  # the device's watchdog; the test's own time limit ends this
        time.sleep(0.05)


def test_a_camera_that_another_process_holds_is_busy(server: Process, start_client: Any) -> None:
    first, second = start_client(), start_client()
    first.ask("open")

    answer = second.ask("open_another")

    assert answer["error"] == "CameraBusy"
    assert "/dev/bus/usb/001/001" in answer["text"]
    assert second.ask("open_wrong")["error"] == "CameraNotFound"
    assert first.ask("status") == {"value": False}
    first.ask("close")
    assert second.ask("open")["value"]["state"] == "idle"
    second.ask("close")
