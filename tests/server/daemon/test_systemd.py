"""Notifications of systemd, through a socket that stands in for its own."""

import asyncio
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any, cast

import httpx
import pytest

from tests.server.daemon.test_server import environment
from transientcam_server.camera import Acquisition, AcquisitionStatus
from transientcam_server.camera._status import State
from transientcam_server.daemon._systemd import ServiceManager, status_line, supervised

PATIENCE_S = 60.0


class Listener:
    """A notification socket, and everything that was said to it."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.said: list[dict[str, str]] = []
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(address.replace("@", "\0", 1))

    def hear(self, timeout_s: float = PATIENCE_S) -> dict[str, str]:
        """Wait for a datagram."""
        self._socket.settimeout(timeout_s)
        lines = self._socket.recv(4096).decode().split("\n")
        heard = dict(line.split("=", 1) for line in lines)
        self.said.append(heard)
        return heard

    def hear_until(self, wanted: Callable[[dict[str, str]], bool]) -> dict[str, str]:
        """Wait for a datagram that will do."""
        ends_s = time.monotonic() + PATIENCE_S
        while True:
            heard = self.hear(max(0.01, ends_s - time.monotonic()))
            if wanted(heard):
                return heard

    def silent(self, seconds: float, name: str) -> bool:
        """Whether nothing of this name is said for a while."""
        ends_s = time.monotonic() + seconds
        while (left_s := ends_s - time.monotonic()) > 0.0:
            try:
                if name in self.hear(left_s):
                    return False
            except TimeoutError:
                return True
        return True

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Listener]:
    listener = Listener(str(tmp_path / "notify"))
    yield listener
    listener.close()


class FakeAcquisition:
    """As much of an acquisition as is asked."""

    def __init__(
        self, state: State = "streaming", *, stalled: bool = False, frames: int = 42
    ) -> None:
        self.state: State = state
        self.frames = frames
        self.stalled = stalled
        self.stuck = False

    def status(self) -> AcquisitionStatus:
        return AcquisitionStatus(
            state=self.state,
            running=True,
            rate_hz=10.6,
            frames=self.frames,
            offs=0,
            frame_age_s=7.0,
            reason="unplugged" if self.state == "lost" else None,
            stalled=self.stalled,
        )

    def submit(self, command: Callable[[], None]) -> Future[None]:
        future: Future[None] = Future()
        if not self.stuck:
            command()
            future.set_result(None)
        return future


def fed(manager: Listener, acquisition: FakeAcquisition, *, rounds: int = 4) -> int:
    """Count how often the watchdog is fed in some rounds of reports."""
    about = ServiceManager(manager.address, watchdog_s=0.06)

    async def run() -> None:
        async with supervised(cast("Acquisition", acquisition), about):
            await asyncio.to_thread(lambda: [manager.hear() for _ in range(1 + 2 * rounds)])

    async def run_unfed() -> None:
        async with supervised(cast("Acquisition", acquisition), about):
            await asyncio.to_thread(lambda: [manager.hear() for _ in range(1 + rounds)])

    unfed = acquisition.stalled or acquisition.stuck
    asyncio.run(run_unfed() if unfed else run())
    return sum("WATCHDOG" in heard for heard in manager.said)


@pytest.mark.parametrize("state", ["streaming", "lost", "stopped"])
def test_the_watchdog_is_fed_while_frames_flow_or_none_can(manager: Listener, state: State) -> None:
    assert fed(manager, FakeAcquisition(state)) >= 3


def test_the_watchdog_is_not_fed_while_frames_are_missed(manager: Listener) -> None:
    assert fed(manager, FakeAcquisition(stalled=True)) == 0
    assert "no frame for 7 s" in manager.said[-1]["STATUS"]


def test_the_watchdog_is_not_fed_while_the_thread_of_the_camera_hangs(manager: Listener) -> None:
    acquisition = FakeAcquisition("lost")
    acquisition.stuck = True

    assert fed(manager, acquisition) <= 1  # the first time it is only asked


def test_ready_comes_first_and_stopping_last(manager: Listener) -> None:
    fed(manager, FakeAcquisition())
    last = manager.hear_until(lambda heard: "STOPPING" in heard)

    assert manager.said[0] == {"READY": "1", "STATUS": "frame 42 at 10.6 Hz"}
    assert last == {"STOPPING": "1"}


def test_without_a_manager_nothing_is_sent_and_nothing_runs() -> None:
    async def run() -> None:
        acquisition = cast("Acquisition", FakeAcquisition())
        async with supervised(acquisition, ServiceManager()):
            assert len(asyncio.all_tasks()) == 1

    asyncio.run(run())


def test_a_manager_that_is_gone_is_no_error(tmp_path: Path) -> None:
    ServiceManager(str(tmp_path / "no-socket")).notify(READY="1")


def test_a_name_in_the_abstract_namespace_is_a_socket_too() -> None:
    listener = Listener(f"@transientcam-test-{os.getpid()}")
    try:
        ServiceManager.of({"NOTIFY_SOCKET": listener.address}).notify(STATUS="two\nlines")
        assert listener.hear() == {"STATUS": "two lines"}
    finally:
        listener.close()


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({}, ServiceManager()),
        ({"NOTIFY_SOCKET": ""}, ServiceManager()),
        ({"NOTIFY_SOCKET": "vsock:2:1234"}, ServiceManager()),
        ({"NOTIFY_SOCKET": "/s"}, ServiceManager("/s")),
        ({"NOTIFY_SOCKET": "@s"}, ServiceManager("\0s")),
        ({"NOTIFY_SOCKET": "/s", "WATCHDOG_USEC": "30000000"}, ServiceManager("/s", 30.0)),
        ({"NOTIFY_SOCKET": "/s", "WATCHDOG_USEC": "0"}, ServiceManager("/s")),
        ({"NOTIFY_SOCKET": "/s", "WATCHDOG_USEC": "soon"}, ServiceManager("/s")),
        (
            {"NOTIFY_SOCKET": "/s", "WATCHDOG_USEC": "6000000", "WATCHDOG_PID": "7"},
            ServiceManager("/s", 6.0),
        ),
        (
            {"NOTIFY_SOCKET": "/s", "WATCHDOG_USEC": "6000000", "WATCHDOG_PID": "8"},
            ServiceManager("/s"),
        ),
    ],
)
def test_the_manager_is_read_from_the_environment(
    variables: dict[str, str], expected: ServiceManager
) -> None:
    assert ServiceManager.of(variables, pid=7) == expected


def test_the_watchdog_is_fed_several_times_within_its_limit() -> None:
    assert ServiceManager("/s", 30.0).every_s == pytest.approx(10.0)
    assert ServiceManager("/s", 3.0).every_s == pytest.approx(1.0)
    assert ServiceManager("/s", 3600.0).every_s == 10.0


@pytest.mark.parametrize(
    ("acquisition", "line"),
    [
        (FakeAcquisition(), "frame 42 at 10.6 Hz"),
        (FakeAcquisition("starting"), "the camera is starting"),
        (FakeAcquisition(frames=0), "waiting for the first frame"),
        (FakeAcquisition("lost"), "the camera is lost: unplugged"),
        (FakeAcquisition("stopped"), "the capture is stopped"),
        (FakeAcquisition("calibrating"), "a calibration is being measured"),
        (FakeAcquisition("starting", stalled=True), "no frame for 7 s"),
    ],
)
def test_the_status_is_a_line(acquisition: FakeAcquisition, line: str) -> None:
    assert status_line(acquisition.status()) == line


def test_the_daemon_reports_ready_fed_unplugged_and_stopping(
    manager: Listener, tmp_path: Path
) -> None:
    command = [str(Path(sys.executable).with_name("transientcam")), "serve", "--port", "0"]
    variables = {"NOTIFY_SOCKET": manager.address, "WATCHDOG_USEC": "600000"}
    with subprocess.Popen(
        [*command, "--camera", "sim:wall", "--json"],
        cwd=tmp_path,
        env=environment(**variables),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as daemon:
        try:
            assert daemon.stdout is not None
            reported: dict[str, Any] = json.loads(daemon.stdout.readline())
            assert manager.hear()["READY"] == "1"
            manager.hear_until(lambda heard: "Hz" in heard.get("STATUS", ""))
            manager.hear_until(lambda heard: "WATCHDOG" in heard)
            fault = {"fault": "unplug"}
            httpx.post(f"{reported['url']}/api/v1/simulation/faults", json=fault).raise_for_status()
            manager.hear_until(lambda heard: "lost" in heard.get("STATUS", ""))
            manager.hear_until(lambda heard: "WATCHDOG" in heard)
            daemon.terminate()
            manager.hear_until(lambda heard: "STOPPING" in heard)
            _, errors = daemon.communicate(timeout=PATIENCE_S)
        finally:
            daemon.kill()

    assert daemon.returncode == 0
    assert "Traceback" not in errors
