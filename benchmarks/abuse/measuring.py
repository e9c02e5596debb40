"""What healthy clients have of a daemon while others attack it."""

import contextlib
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import httpx
import trustme

from benchmarks.abuse.attacks import SOURCE
from benchmarks.common.daemon import VIDEO, Process
from benchmarks.service.viewers import RANGE, Viewer, beside, cut, watch

GIVE_UP_S: Final = 30.0
"""What was not done by then is taken for never."""
LEASE_S: Final = 2.0
_PROBE_EVERY_S = 0.2
_LIGHT_OFF_S: Final = 1.5
_SAFE_OFFS: Final = 10
COMES_BACK_S: Final = 3.0
_FIRST_FRAMES_S: Final = 1.0
_WAITING_S: Final = 0.1
HISTORY_S: Final = 2.0
"""Frames are kept for so long, and memory grows until then."""


@dataclass
class AttackOutcome:
    """What healthy clients had during one attack; times in s, None for never."""

    frames: float = 0.0
    """Share of the camera's frames that the viewer received, over that without an attack."""
    livez_s: float | None = None
    livez_cpu_s: float | None = None
    """``livez_s``, ``livez_cpu_s``: the longest answer of /livez: real time, and processor time of
    the loop's thread meanwhile."""
    lapse_s: float | None = None
    safe_off_s: float | None = None
    """``lapse_s``, ``safe_off_s``: from when the light should have gone off to the last capture."""
    beside_s: float | None = None
    """The longest of some safe-offs from the address of the attack, each over a new connection,
    until it was answered with 200."""
    grown_bytes: int = 0
    left_bytes: int = 0
    """``grown_bytes``, ``left_bytes``: memory over that before: at most, and a while after."""
    end_s: float | None = None
    """From SIGTERM to the end."""


@dataclass
class Probe:
    """Asks /livez again and again on a thread, each time over a new connection."""

    process: Process
    client: httpx.Client
    waits_s: list[float | None] = field(default_factory=list)
    cpu_s: list[float] = field(default_factory=list)
    memory_bytes: list[int] = field(default_factory=list)

    def run(self, ended: threading.Event) -> None:
        """Ask until the event is set."""
        while not ended.wait(_PROBE_EVERY_S):
            begin_s, cpu_s = time.perf_counter(), self.process.loop_cpu_s()
            try:
                self.client.get("/livez", headers={"Connection": "close"}).raise_for_status()
                self.waits_s.append(time.perf_counter() - begin_s)
            except httpx.HTTPError:
                self.waits_s.append(None)
            self.cpu_s.append(self.process.loop_cpu_s() - cpu_s)
            self.memory_bytes.append(self.process.resident_bytes())


@contextlib.contextmanager
def served(*, tls: bool) -> Iterator[Process]:
    """Run a daemon until the block ends; it may be gone before."""
    program = Path(sys.executable).with_name("transientcam")
    command: list[str | Path] = [program, "serve", "--port", "0", "--camera", "sim:mirrors"]
    with tempfile.TemporaryDirectory() as name:
        environment = {"XDG_DATA_HOME": name, "TRANSIENTCAM_HISTORY__SECONDS": f"{HISTORY_S}"}
        if tls:
            command += ["--tls-certificate", _certificate(Path(name))]
        process = Process(command, environment, log=subprocess.DEVNULL)
        try:
            yield process
        finally:
            process.kill()


def _certificate(directory: Path) -> Path:
    path = directory / "certificate.pem"
    trustme.CA().issue_cert("127.0.0.1").private_key_and_cert_chain_pem.write_to_path(str(path))
    return path


@contextlib.contextmanager
def attacked(name: str, url: str, connections: int) -> Iterator[None]:
    """Attack until the block ends."""
    command = [sys.executable, "-m", "benchmarks.abuse.attacks", name, url, str(connections)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as attacker:
        try:
            assert attacker.stdout is not None
            attacker.stdout.readline()
            yield
        finally:
            attacker.send_signal(signal.SIGKILL)


def measure(name: str, connections: int, *, duration_s: float) -> AttackOutcome:
    """Attack a fresh daemon, and look what healthy clients have of it meanwhile."""
    tls = name == "silent TLS handshakes"
    seen = AttackOutcome()
    with (
        served(tls=tls) as process,
        httpx.Client(base_url=process.url, timeout=GIVE_UP_S, verify=False) as client,
    ):
        prepare(process, client)
        viewer = None if tls else Viewer(process.stream_url, RANGE)  # the viewers speak no TLS
        if viewer is not None:
            watch([viewer], duration_s=_FIRST_FRAMES_S)
        # by its end memory does not grow any more
        before = _frames(viewer, client, max(duration_s, HISTORY_S + 1.0))
        memory_bytes = process.resident_bytes()
        probe = Probe(process, client)
        with contextlib.ExitStack() as attack:
            attack.enter_context(attacked(name, process.url, connections))
            with beside(probe.run):
                frames = _frames(viewer, client, duration_s)
            seen.frames = frames / before if before else 0.0
            seen.lapse_s = _lapse(client)
            seen.safe_off_s = _safe_off(client)
            seen.beside_s = _beside(process.url)
        seen.livez_s = (
            None if None in probe.waits_s else max(filter(None, probe.waits_s), default=None)
        )
        seen.livez_cpu_s = max(probe.cpu_s, default=None)
        seen.grown_bytes = max(probe.memory_bytes, default=memory_bytes) - memory_bytes
        time.sleep(COMES_BACK_S)
        seen.left_bytes = process.resident_bytes() - memory_bytes
        with attacked(name, process.url, connections):
            time.sleep(1.0)
            seen.end_s = process.end_within(GIVE_UP_S)
        if viewer is not None:
            cut([viewer.connection])
    return seen


def prepare(process: Process, client: httpx.Client) -> float:
    """Set the paper's video setting, wait for the kernels, and return the frame rate in Hz."""
    applied = client.put("/api/v1/sequence", json=VIDEO).raise_for_status().json()
    process.settle()
    # what is made once is made now, so that it does not count as growth
    client.get("/api/v1/frames/latest/transient", params={"bins": 100, "wait_s": 10.0})
    client.get("/api/v1/frames/latest/transient.tiff", params={"bins": 1})
    client.get("/openapi.json")
    rate_hz: float = applied["frame_rate_hz"]
    return rate_hz


def _frames(viewer: Viewer | None, client: httpx.Client, duration_s: float) -> float:
    """Return frames a second that a viewer has; with TLS, those that are captured."""
    if viewer is None:
        before = _captured(client)
        time.sleep(duration_s)
        return (_captured(client) - before) / duration_s
    watch([viewer], duration_s=_WAITING_S)  # what came since it read last
    count = len(viewer.seen.numbers)
    took_s = watch([viewer], duration_s=duration_s)
    return (len(viewer.seen.numbers) - count) / took_s


def _captured(client: httpx.Client) -> int:
    return int(client.get("/api/v1/acquisition").json()["frames"])


def _lapse(client: httpx.Client) -> float | None:
    """Take a lease, let it lapse, and return how much later the last frame was captured."""
    body = {"holder": "abuse", "duration_s": LEASE_S, "on_lapse": "stop"}
    try:
        client.post("/api/v1/lease", json=body).raise_for_status()
        due_s = time.time() + LEASE_S
        time.sleep(LEASE_S + _LIGHT_OFF_S)
        return _last_capture_after(client, due_s)
    except (httpx.HTTPError, LookupError):
        return None


def _safe_off(client: httpx.Client) -> float | None:
    """Start again, switch off, and return how much later the last frame was captured."""
    try:
        client.put("/api/v1/acquisition", json={"running": True}).raise_for_status()
        time.sleep(1.0)
        asked_s = time.time()
        client.post("/api/v1/acquisition/safe-off").raise_for_status()
        time.sleep(_LIGHT_OFF_S)
        return _last_capture_after(client, asked_s)
    except (httpx.HTTPError, LookupError):
        return None


def _beside(url: str) -> float | None:
    """Switch off from the attack's address, again and again; return the longest answer."""
    waits_s = []
    transport = httpx.HTTPTransport(local_address=SOURCE, verify=False)
    try:
        with httpx.Client(base_url=url, timeout=GIVE_UP_S, transport=transport) as client:
            for _ in range(_SAFE_OFFS):
                begin_s = time.perf_counter()
                headers = {"Connection": "close"}
                client.post("/api/v1/acquisition/safe-off", headers=headers).raise_for_status()
                waits_s.append(time.perf_counter() - begin_s)
                time.sleep(_PROBE_EVERY_S)
    except httpx.HTTPError:
        return None
    return max(waits_s)


def _last_capture_after(client: httpx.Client, due_s: float) -> float:
    """Return when the last frame was captured, after a time; 0 if before."""
    while True:
        frame = client.get("/api/v1/frames/latest").raise_for_status().json()
        if not client.get("/api/v1/acquisition").raise_for_status().json()["running"]:
            return max(0.0, float(frame["host_time_s"]) - due_s)
        if time.time() > due_s + GIVE_UP_S:
            raise LookupError
        time.sleep(0.5)
