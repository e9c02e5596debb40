"""What switches the light off: the table of docs/operations.md, line by line.

The camera is a process of its own and the daemon is another one, which reaches it by real calls of
libusb, so that the daemon can be stopped and killed. Nothing here is timed: each test waits until
the device itself says that its light is off, and asks why.
"""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest

from tests.driver.cameras.open_usb.usbfs.processes import EmulatedCamera, emulated_camera
from tests.server.streaming import Client, streaming
from tests.waiting import wait_until

QUICK = {"harmonics": 1, "zeroth": "estimated", "exposure_s": 0.0005}
PATIENCE_S = 60.0
LEASE = {"holder": "a test", "duration_s": 1.0, "on_lapse": "stop"}


class Daemon:
    """A daemon whose loop can be stopped, before an emulated camera; its light is announced."""

    def __init__(self, camera: EmulatedCamera, directory: Path, **settings: str) -> None:
        self.camera = camera
        self.directory = directory
        given = {"LIGHT__DIRECTORY": str(directory), "LIGHT__DELAY_S": "0.2", **settings}
        self.process = subprocess.Popen(
            [
                *(sys.executable, Path(__file__).with_name("stuck_daemon.py")),
                *("serve", "--camera", "usb", "--port", "0", "--log-level", "error"),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=camera.environment
            | {"NUMBA_DISABLE_JIT": "1", "COLUMNS": "200"}
            | {"TRANSIENTCAM_RECONSTRUCTION__NEIGHBOURS": "gaussian"}
            | {f"TRANSIENTCAM_{name}": value for name, value in given.items()},
        )
        assert self.process.stdout is not None
        found = re.search(r"http://\S+", self.process.stdout.readline())
        assert found is not None
        self.client = httpx.Client(base_url=found.group(), timeout=PATIENCE_S)
        self.stream_url = found.group().replace("http", "ws", 1) + "/api/v1/stream"
        self.put("sequence", QUICK)

    def put(self, path: str, document: dict[str, Any]) -> None:
        self.client.put(f"/api/v1/{path}", json=document).raise_for_status()

    def acquisition(self) -> dict[str, Any]:
        document: dict[str, Any] = self.client.get("/api/v1/acquisition").json()
        return document

    def state(self) -> str:
        return str(self.acquisition()["state"])

    @contextmanager
    def stuck(self, directory: Path) -> Iterator[None]:
        """Stop the event loop to the end of the block."""
        fifo = directory / "fifo"
        os.mkfifo(fifo)
        asking = threading.Thread(
            target=self.client.get, args=("/stuck",), kwargs={"params": {"fifo": str(fifo)}}
        )
        asking.start()
        with fifo.open("wb"):  # opens once the other end is open: the loop stands still
            yield
        asking.join()

    def close(self) -> None:
        assert self.process.stdout is not None
        self.client.close()
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    with emulated_camera() as camera:
        daemon = Daemon(camera, tmp_path_factory.mktemp("light"))
        try:
            yield daemon
        finally:
            daemon.close()


@pytest.fixture
def lit(running: Daemon) -> Daemon:
    """The daemon, capturing with the light on."""

    def lights() -> bool:  # again where a laden machine put it out since
        running.client.put("/api/v1/acquisition", json={"running": True})
        return running.state() == "streaming" and running.camera.lit

    wait_until(lights)
    return running


@pytest.fixture
def watching(lit: Daemon) -> Iterator[Client]:
    with streaming(lit.stream_url) as client:
        client.subscribe("flags")
        client.frame()
        yield client


def goes_off(daemon: Daemon) -> None:
    wait_until(lambda: not daemon.camera.lit)


def test_a_start_lights_nothing(running: Daemon) -> None:
    found = running.acquisition()

    assert (found["state"], found["running"], found["off_because"]) == ("stopped", False, "start")
    assert found["off_kept"]
    assert not running.camera.lit


def test_light_is_announced_to_clients_and_can_be_called_off(running: Daemon) -> None:
    with streaming(running.stream_url) as client:
        client.subscribe("flags")
        running.put("acquisition", {"running": True})
        assert client.notice("light-arming").details == {"in_s": 0.2}
        running.put("acquisition", {"running": False})
        off = client.notice("light-off").details

    assert off["because"] == "stop"
    assert "off until the capture is started" in off["reason"]


def test_a_client_that_is_gone_leaves_a_lease_that_lapses(lit: Daemon) -> None:
    with httpx.Client(base_url=lit.client.base_url) as client:
        client.post("/api/v1/lease", json=LEASE).raise_for_status()

    goes_off(lit)
    wait_until(lambda: lit.state() == "stopped")
    assert not lit.camera.watchdog_tripped


def test_a_loop_that_is_stuck_puts_the_light_out_until_somebody_starts(
    lit: Daemon, watching: Client, tmp_path: Path
) -> None:
    with lit.stuck(tmp_path):
        goes_off(lit)
        assert not lit.camera.watchdog_tripped  # it was switched off, not left alone
    off = watching.notice("light-off")

    assert off.details["because"] == "unserved"
    assert (lit.state(), lit.camera.lit) == ("stopped", False)


def test_a_start_that_arrived_before_a_safe_off_lights_nothing(lit: Daemon) -> None:
    """It begins first, on a connection of its own, and is complete only afterwards."""
    url = lit.client.base_url
    with socket.create_connection((url.host, url.port or 0), PATIENCE_S) as early:
        early.sendall(
            b"PUT /api/v1/acquisition HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n"
            b'Content-Type: application/json\r\nContent-Length: 17\r\n\r\n{"running":'
        )
        lit.client.get("/livez")  # what came before it was read
        lit.client.post("/api/v1/acquisition/safe-off").raise_for_status()
        early.sendall(b" true}")
        answer = early.makefile("rb").read()

    assert b" 409 " in answer.partition(b"\r\n")[0]
    assert b"/problems/start-outdated" in answer
    assert (lit.state(), lit.camera.lit) == ("stopped", False)


def test_a_start_of_what_was_seen_before_a_safe_off_lights_nothing(lit: Daemon) -> None:
    seen = lit.acquisition()["offs"]
    lit.client.post("/api/v1/acquisition/safe-off").raise_for_status()
    answer = lit.client.put("/api/v1/acquisition", json={"running": True, "offs": seen})

    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/start-outdated")
    assert not lit.camera.lit
    lit.put("acquisition", {"running": True, "offs": lit.acquisition()["offs"]})


def test_a_lease_that_lapses_while_the_loop_is_stuck_keeps_the_light_off(
    lit: Daemon, tmp_path: Path
) -> None:
    lit.client.post("/api/v1/lease", json=LEASE).raise_for_status()
    with lit.stuck(tmp_path):
        goes_off(lit)
        lapsed = threading.Event()
        lapsed.wait(2.0 * LEASE["duration_s"])  # type: ignore[operator]  # a number

    assert lit.state() == "stopped"
    assert not lit.camera.lit
    assert lit.client.get("/api/v1/lease").json()["held"] is False


def test_safe_off_needs_nothing_but_a_request(lit: Daemon) -> None:
    lit.client.post("/api/v1/acquisition/safe-off").raise_for_status()

    assert not lit.camera.lit


def test_an_open_interlock_puts_the_light_out_until_somebody_starts(lit: Daemon) -> None:
    lit.camera.do("interlock", False)

    assert not lit.camera.lit
    wait_until(lambda: lit.state() == "stopped")
    refused = lit.client.put("/api/v1/acquisition", json={"running": True})
    assert (refused.status_code, refused.json()["type"]) == (502, "/problems/camera-failed")
    assert "interlock" in refused.json()["detail"]
    lit.camera.do("interlock", True)
    assert lit.acquisition()["off_because"] == "device"
    assert not lit.camera.lit
    lit.put("acquisition", {"running": True})
    wait_until(lambda: lit.camera.lit)


def test_without_the_cable_there_is_no_light_and_with_it_again_there_is(lit: Daemon) -> None:
    lit.camera.do("unplug")
    wait_until(lambda: lit.state() == "lost")
    lit.camera.do("replug")

    wait_until(lambda: lit.camera.lit)


def test_requests_that_stall_put_the_light_out(lit: Daemon) -> None:
    lit.camera.do("stall", 10**6)

    goes_off(lit)
    lit.camera.do("unplug")
    lit.camera.do("replug")
    wait_until(lambda: lit.state() == "streaming")


def test_a_host_that_hangs_is_missed_by_the_device(lit: Daemon) -> None:
    (supervisor,) = (
        each
        for each in psutil.Process(lit.process.pid).children()
        if "transientcam_supervisor" in each.cmdline()
    )
    supervisor.suspend()
    lit.process.send_signal(signal.SIGSTOP)
    try:
        goes_off(lit)
        assert lit.camera.watchdog_tripped
    finally:
        supervisor.resume()
        lit.process.send_signal(signal.SIGCONT)

    wait_until(lambda: lit.state() == "stopped")
    assert not lit.camera.lit


@pytest.mark.parametrize("off", ["safe-off", "interlock", "nothing"])
def test_a_daemon_that_is_killed_is_missed_by_the_device_and_the_next_one_lights_nothing(
    lit: Daemon, off: str
) -> None:
    """The last one: nothing is left to test after it."""
    if off == "safe-off":
        lit.client.post("/api/v1/acquisition/safe-off").raise_for_status()
    elif off == "interlock":
        lit.camera.do("interlock", False)
        wait_until(lambda: bool(lit.acquisition()["off_kept"]))
        lit.camera.do("interlock", True)
    lit.process.kill()
    goes_off(lit)
    lit.close()

    # only where nothing switched it off may a setting light it
    settings = {} if off == "nothing" else {"CAPTURE_AT_START": "true"}
    restarted = Daemon(lit.camera, lit.directory, **settings)
    vars(lit).update(vars(restarted))
    found = lit.acquisition()

    because = {"interlock": "device", "nothing": "start"}.get(off, off)
    assert (found["state"], found["off_because"], found["off_kept"]) == ("stopped", because, True)
    assert not lit.camera.lit
