"""The daemon as a process: its address, its signals, its socket."""

import asyncio
import gc
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

import httpx
import pytest

from tests.server.streaming import streaming
from transientcam import wire
from transientcam_driver import open_camera
from transientcam_server.api import build_app
from transientcam_server.daemon._configuration import ENVIRONMENT_PREFIX
from transientcam_server.daemon._server import (
    NOTSENT_LOWAT_BYTES,
    USER_TIMEOUT_MS,
    Server,
    address,
    exit_without_joining,
    freeze_startup_objects,
    listen,
)
from transientcam_server.errors import AddressUnavailable
from transientcam_server.recording import Recording
from transientcam_server.service import Service
from transientcam_server.settings import Settings

PATIENCE_S = 60.0
# without kernels the defaults take half a second a frame, and longer on a laden machine
QUICK = {
    "TRANSIENTCAM_RECONSTRUCTION__ESTIMATOR": "pisarenko",
    "TRANSIENTCAM_RECONSTRUCTION__NEIGHBOURS": "gaussian",
}


def environment(**variables: str) -> dict[str, str]:
    clean = {k: v for k, v in os.environ.items() if not k.startswith(ENVIRONMENT_PREFIX)}
    # nothing is compiled here: it would go on long after the test
    clean |= {"TRANSIENTCAM_KERNELS": "off", "TRANSIENTCAM_TOKENS_FILE": "/nowhere/tokens.json"}
    return clean | variables


@contextmanager
def daemon(
    directory: Path, *arguments: str, **variables: str
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run `transientcam serve` and return it with the address it prints."""
    command = [str(Path(sys.executable).parent / "transientcam"), "serve", "--port", "0"]
    with subprocess.Popen(
        [*command, *arguments],
        cwd=directory,
        env=environment(**QUICK | variables),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            found = re.search(r"http://\S+:\d+", line)
            assert found, line + process.communicate()[1]
            yield process, found.group()
        finally:
            process.kill()


def test_the_address_is_printed_once_it_is_listened_on(tmp_path: Path) -> None:
    with daemon(tmp_path) as (process, url):
        assert httpx.get(f"{url}/livez").status_code == 200
        process.terminate()
        process.communicate(timeout=PATIENCE_S)

        assert process.returncode == 0


def test_sigterm_notifies_the_clients_and_ends_well(tmp_path: Path) -> None:
    with daemon(tmp_path) as (process, url):
        with streaming(url.replace("http", "ws") + "/api/v1/stream") as client:
            client.subscribe("flags")
            client.frame()
            process.send_signal(signal.SIGTERM)
            code = client.close_code()
        _, errors = process.communicate(timeout=PATIENCE_S)

    assert code == wire.CloseCode.GOING_AWAY
    assert process.returncode == 0
    assert errors == ""


def test_an_interrupt_ends_it_without_a_traceback(tmp_path: Path) -> None:
    with daemon(tmp_path) as (process, _):
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE_S)

    assert process.returncode == 130
    assert "Traceback" not in errors


def test_the_environment_and_a_file_set_what_the_command_line_does_not(tmp_path: Path) -> None:
    (tmp_path / "transientcam.toml").write_text("[stream]\nmax_clients = 0\n")
    with daemon(tmp_path, TRANSIENTCAM_STREAM__MAX_CLIENTS="3") as (process, url):
        assert httpx.get(f"{url}/livez").status_code == 200
        process.terminate()
        process.communicate(timeout=PATIENCE_S)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--host", "0.0.0.0"], "--insecure"),
        (["--port", "70000"], "--port"),
        (["--camera", "sim:nowhere"], "nowhere"),
        (["--config", "absent.toml"], "absent.toml"),
    ],
)
def test_what_cannot_be_served_is_reported_in_a_sentence(
    tmp_path: Path, arguments: list[str], message: str
) -> None:
    result = subprocess.run(
        [str(Path(sys.executable).parent / "transientcam"), "serve", "--port", "0", *arguments],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )

    assert result.returncode == 1
    assert message in result.stderr
    assert "Traceback" not in result.stderr


def test_a_port_that_is_taken_is_reported_in_a_sentence(tmp_path: Path) -> None:
    with listen("127.0.0.1", 0) as listener:
        port = str(listener.getsockname()[1])
        result = subprocess.run(
            [str(Path(sys.executable).parent / "transientcam"), "serve", "--port", port],
            cwd=tmp_path,
            env=environment(),
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )

    assert result.returncode == 1
    assert port in result.stderr
    assert "Traceback" not in result.stderr


def test_connections_inherit_what_keeps_dead_and_slow_clients_short() -> None:
    with listen("127.0.0.1", 0) as listener:
        listener.setblocking(True)
        with socket.create_connection(listener.getsockname()):
            accepted, _ = listener.accept()
            with accepted:
                options = {
                    name: accepted.getsockopt(socket.IPPROTO_TCP, getattr(socket, name))
                    for name in ("TCP_USER_TIMEOUT", "TCP_NOTSENT_LOWAT")
                }

    assert options == {
        "TCP_USER_TIMEOUT": USER_TIMEOUT_MS,
        "TCP_NOTSENT_LOWAT": NOTSENT_LOWAT_BYTES,
    }


def test_an_address_is_a_url_that_can_be_opened() -> None:
    with listen("127.0.0.1", 0) as four:
        assert address(four) == f"http://127.0.0.1:{four.getsockname()[1]}"
    with listen("::1", 0) as six:
        assert address(six) == f"http://[::1]:{six.getsockname()[1]}"
    with listen("0.0.0.0", 0) as every:
        assert "0.0.0.0" not in address(every)


def test_an_address_that_is_not_of_this_machine_leaves_no_socket_behind() -> None:
    with pytest.raises(AddressUnavailable, match=r"192\.0\.2\.1"):
        listen("192.0.2.1", 0)


def test_the_end_does_not_wait_for_a_compiler() -> None:
    program = """
import threading
from transientcam_server.daemon._server import exit_without_joining

with exit_without_joining():
    for_ever = threading.Event().wait
    threading.Thread(target=for_ever, name="transientcam-compile").start()
    print("closed")
    {how}
"""
    for how, code in (("pass", 0), ("raise KeyboardInterrupt", 130)):
        result = subprocess.run(
            [sys.executable, "-c", program.format(how=how)],
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )

        assert (result.returncode, result.stdout, result.stderr) == (code, "closed\n", "")


def test_what_is_not_at_work_changes_nothing_at_the_end() -> None:
    idle = threading.Thread(target=str, name="transientcam-compile")
    idle.start()
    idle.join()
    with exit_without_joining():
        pass

    with pytest.raises(KeyboardInterrupt), exit_without_joining():
        raise KeyboardInterrupt


def test_the_light_is_off_after_the_service() -> None:
    settings = Settings(camera="sim:wall", port=0, log_level="warning")
    with open_camera(settings.camera) as camera:
        app = build_app(camera, settings)
        with listen("127.0.0.1", 0) as listener:

            def end() -> None:
                server.should_exit = True

            server = Server(app, settings, on_listening=end)
            server.run([listener])
        service: Service = app.state.service

        assert service.acquisition.status().running  # no pause was requested
        assert not camera.status().light_on


def test_sigterm_while_kernels_are_compiled_closes_streams_and_recordings(tmp_path: Path) -> None:
    compiling = {"TRANSIENTCAM_KERNELS": "on", "NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    recordings = tmp_path / "recordings"
    kept = {"DIRECTORY": str(recordings), "MIN_FREE_BYTES": "0"}
    settings = {f"TRANSIENTCAM_RECORDINGS__{name}": value for name, value in kept.items()}
    with daemon(tmp_path, **compiling, **settings) as (process, url):
        with streaming(url.replace("http", "ws") + "/api/v1/stream") as client:
            client.subscribe("flags")
            running = httpx.post(f"{url}/api/v1/recordings", json={}).json()["id"]
            client.frame()
            compiling_now = httpx.get(f"{url}/api/v1/info").json()["kernels"]
            process.send_signal(signal.SIGTERM)
            code = client.close_code()
        _, errors = process.communicate(timeout=PATIENCE_S)

    assert compiling_now is not None
    assert code == wire.CloseCode.GOING_AWAY
    assert process.returncode == 0
    assert "Traceback" not in errors
    assert [path.name for path in recordings.iterdir()] == [f"{running}.h5"]
    with Recording(recordings / f"{running}.h5") as recording:
        assert recording.end["reason"] == "shutdown"
        assert recording.frames >= 1


@pytest.fixture
def collector() -> Iterator[None]:
    """Let go of what the test froze."""
    yield
    gc.unfreeze()
    gc.collect()
    gc.freeze()  # as it was after collection (tests/conftest.py)


class Node:
    """Something that refers to itself."""

    def __init__(self) -> None:
        self.itself = self


@pytest.mark.usefixtures("collector")
def test_startup_objects_and_those_of_the_compiler_are_frozen() -> None:
    finish = threading.Event()
    left: list[Node] = []

    def compile_() -> None:
        finish.wait()
        left.extend(Node() for _ in range(20_000))

    compiling = threading.Thread(target=compile_)
    compiling.start()
    waiting = freeze_startup_objects(compiling)
    before = gc.get_freeze_count()
    finish.set()
    waiting.join()

    assert before > 1000
    # what other tests had frozen may go meanwhile
    assert gc.get_freeze_count() >= before + 10_000
    frozen = {id(each) for each in gc.get_objects()}
    assert not any(id(each) in frozen for each in left)


@pytest.mark.usefixtures("collector")
def test_later_garbage_is_still_collected() -> None:
    done = threading.Thread(target=lambda: None)
    done.start()
    freeze_startup_objects(done).join()
    for _ in range(10):
        Node()

    assert gc.collect() >= 10


def test_a_clock_beyond_the_year_9999_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    with open_camera("sim:wall?noise=off") as camera:
        settings = Settings(camera="sim:wall?noise=off")
        app = build_app(camera, settings)
        server = Server(app, settings, on_listening=lambda: None)
        server.config.load()
        monkeypatch.setattr("uvicorn.server.time.time", lambda: 3e11)

        assert asyncio.run(server.on_tick(0)) is False
        server.should_exit = True
        assert asyncio.run(server.on_tick(0)) is True
        app.state.service._executor.shutdown()
