"""An emulated camera in one process, and programs that reach it by real usbfs calls in others."""

import ctypes.util
import json
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, cast

import pytest

from transientcam_driver import Camera, Sequence

PRELOAD = "libumockdev-preload.so.0"
HERE = Path(__file__).parent
_METHODS = (
    "close",
    "configure",
    "device_time_s",
    "read_frame",
    "reconnect",
    "safe_off",
    "start",
    "status",
    "stop",
    "validate",
)


class EmulatedCamera:
    """The process of ``server.py``."""

    def __init__(self, root: Path, kind: str = "usb") -> None:
        self.root = root
        self.kind = kind
        self._process = subprocess.Popen(
            [sys.executable, HERE / "server.py", root, kind],
            env=os.environ | {"PYTHONPATH": str(HERE.parents[4])},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._hear() == "ready"

    @property
    def environment(self) -> dict[str, str]:
        """What makes a process see this camera on its bus."""
        return os.environ | {
            "UMOCKDEV_DIR": str(self.root),
            "LD_PRELOAD": PRELOAD,
            # libudev would refuse a sysfs that is none
            "SYSTEMD_DEVICE_VERIFY_SYSFS": "0",
        }

    @property
    def lit(self) -> bool:
        """Whether the light is on."""
        return bool(self._ask("light"))

    @property
    def watchdog_tripped(self) -> bool:
        """Whether the light went off because no heartbeat came."""
        return bool(self._ask("watchdog"))

    def do(self, command: str, *arguments: Any) -> None:
        """Let something happen to the camera."""
        assert self._ask(command, *arguments) == "done"

    def signal(self, pid: int, number: int) -> float | None:
        """Send a signal to a process while the light is on; return when, by `time.monotonic`.

        None where it stays dark.
        """
        sent_s: float | None = self._ask("signal", pid, number)
        return sent_s

    def off_since(self, dark_s: float) -> float:
        """Wait until the light is off for so long from now on.

        Return when it went off, as `signal` does; infinity where it does not.
        """
        return float(self._ask("off", dark_s))

    def close(self) -> None:
        """End the process; it must end well."""
        _end(self._process)
        assert self._process.returncode == 0

    def _ask(self, *command: Any) -> Any:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(command) + "\n")
        self._process.stdin.flush()
        return self._hear()

    def _hear(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        assert line, f"the process ended with {self._process.wait(60.0)}"
        return json.loads(line)


class Program:
    """The process of ``client.py``, which owns cameras on its own bus.

    Of two at the same time, one gets ``spare`` descriptors; see there.
    """

    def __init__(self, environment: dict[str, str], *, spare: int = 0) -> None:
        self._process = subprocess.Popen(
            [sys.executable, HERE / "client.py", str(spare)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
        )

    def open(self, spec: str = "usb", sequence: Sequence | None = None) -> Camera:
        """Open a camera there, and return one that stands for it here."""
        return cast("Camera", _RemoteCamera(self, self.request("open", spec, sequence)))

    def request(self, *request: Any) -> Any:
        """Return the answer, or raise the error that came instead of it."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        pickle.dump(request, self._process.stdin)
        self._process.stdin.flush()
        kind, content = pickle.load(self._process.stdout)
        if kind == "error":
            raise content
        return content

    def close(self) -> None:
        """End the process."""
        _end(self._process)

    def kill(self) -> None:
        """Let it die without a word."""
        self._process.kill()
        self.close()


class _RemoteCamera:
    """A camera in another process: methods are called and properties read there."""

    def __init__(self, program: Program, number: int) -> None:
        self._program = program
        self._number = number

    def __getattr__(self, name: str) -> Any:
        if name not in _METHODS:
            return self._program.request("get", self._number, name)

        def call(*positional: Any, **named: Any) -> Any:
            return self._program.request("call", self._number, name, positional, named)

        return call

    def __enter__(self) -> "_RemoteCamera":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextmanager
def emulated_camera(kind: str = "usb") -> Iterator[EmulatedCamera]:
    """Plug a camera into a bus of its own; skip, or fail where CI is set, if there can be none."""
    if missing := missing_libraries():
        skip_or_fail(missing)
    # by a short path: names of sockets are limited to 107 characters
    with tempfile.TemporaryDirectory(prefix="usb-", dir="/tmp") as folder:
        camera = EmulatedCamera(Path(folder), kind)
        try:
            yield camera
        finally:
            camera.close()


def missing_libraries() -> str | None:
    """Return which libraries an emulated bus lacks, and what installs them."""
    missing = [
        name
        for name, found in (
            (PRELOAD, _loads(PRELOAD)),
            ("libusb-1.0", ctypes.util.find_library("usb-1.0")),
        )
        if not found
    ]
    if not missing:
        return None
    return f"{' and '.join(missing)} missing: apt install umockdev libusb-1.0-0"


def skip_or_fail(reason: str) -> None:
    """Skip, but nothing may be left out where CI is set."""
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


def _loads(library: str) -> bool:
    code = f"import ctypes; ctypes.CDLL({library!r})"
    return subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


def _end(process: "subprocess.Popen[Any]") -> None:
    """Close its input and wait for its end."""
    assert process.stdin is not None
    assert process.stdout is not None
    with suppress(BrokenPipeError):  # it is gone already
        process.stdin.close()
    try:
        process.wait(60.0)
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
