"""How long a camera's light stays on where the daemon loses control of it.

Each camera is a process of its own, and says itself when its light went off. The daemon is another
one and reaches it by real calls of libusb; so does its supervisor. `try_all` does everything many
times, several cameras beside each other, and notes each try; ``python -m benchmarks
losing_control`` makes a table of them.
"""

import json
import math
import multiprocessing
import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import httpx
import psutil

from tests.driver.cameras.open_usb.usbfs.processes import EmulatedCamera, emulated_camera
from tests.server.relay.forwarder import Forwarder, forwarding
from tests.serving import Served, serving
from tests.waiting import wait_until

KINDS: Final = ("usb", "kinect2", "opt8241")
RELAYED: Final = ("usb", "opt8241")
"""A Kinect v2 is not relayed yet."""
DARK_S: Final = 0.3
SURELY_DARK_S: Final = 1.5
"""Where it is counted: a laden machine requests no frame for a while, and then again."""
DARK_BEFORE_S: Final = 0.3
"""A camera that exposes on request is dark so long between two images."""
PATIENCE_S: Final = 60.0
STALLED_REQUESTS: Final = 12
LIGHT: Final = {
    "TRANSIENTCAM_KERNELS": "off",
    "NUMBA_DISABLE_JIT": "1",
    "TRANSIENTCAM_RECONSTRUCTION__ESTIMATOR": "pisarenko",
    "TRANSIENTCAM_RECONSTRUCTION__NEIGHBOURS": "gaussian",
}


class Zygote:
    """The process that daemons are forks of."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, Path(__file__).with_name("zygote.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | LIGHT | {"LD_PRELOAD": "libumockdev-preload.so.0"},
        )
        assert self._hear() == "ready"

    def daemon(self, camera: EmulatedCamera, state: Path, silence_s: float) -> dict[str, Any]:
        """Start a daemon; return where it serves, and its process."""
        environment = {
            **camera.environment,
            "STATE_DIRECTORY": str(state),
            "TRANSIENTCAM_LIMITS__UNSERVED_S": str(silence_s),
            "TRANSIENTCAM_LIGHT__DELAY_S": "0",
        }
        arguments = ["serve", "--json", "--camera", camera.kind, "--port", "0"]
        asked = {"arguments": [*arguments, "--log-level", "error"], "environment": environment}
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(asked) + "\n")
        self._process.stdin.flush()
        told: dict[str, Any] = self._hear()
        return told

    def close(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(PATIENCE_S)
        self._process.stdout.close()

    def _hear(self) -> Any:
        assert self._process.stdout is not None
        told, _, _ = select.select([self._process.stdout], [], [], 2 * PATIENCE_S)
        assert told, "the daemon does not come up"
        return json.loads(self._process.stdout.readline())


class Control:
    """A daemon before a camera, both of which are there as soon as they are needed."""

    def __init__(
        self, zygote: Zygote, camera: EmulatedCamera, folder: Path, silence_s: float, dark_s: float
    ) -> None:
        self.camera = camera
        self._zygote = zygote
        self._folder = folder
        self._silence_s = silence_s
        self._dark_s = dark_s
        self._fifos = 0
        self._client: httpx.Client | None = None
        self.url = ""
        self.off_s = -math.inf
        """When the light was last seen to have gone off."""
        self.process: psutil.Process | None = None
        self.supervisor: psutil.Process | None = None

    def light(self) -> None:
        """Have the light on."""
        if self.process is None or not self.process.is_running():
            self.start()
        try:
            wait_until(self._lights)  # again where it has not noticed yet that it was switched off
        except AssertionError:
            raise AssertionError(f"it stays dark: {self.state()}") from None

    def _lights(self) -> bool:
        assert self._client is not None
        assert self.process is not None
        answer = self._client.put("/api/v1/acquisition", json={"running": True})
        if answer.status_code != httpx.codes.CONFLICT:  # it was switched off meanwhile
            answer.raise_for_status()
        # some light for moments only: the camera is asked to wait for one
        lit = self.camera.signal(self.process.pid, 0) is not None
        family = self.process.children()
        watching = [each for each in family if "transientcam_supervisor" in _command(each)]
        if watching and watching[0] != self.supervisor:
            self.supervisor = watching[0]
            _share_time(self.supervisor.pid)
        return lit and bool(watching)

    def start(self) -> None:
        self.close()
        told = self._zygote.daemon(self.camera, self._folder, self._silence_s)
        self.process = psutil.Process(told["pid"])
        self.url = told["url"]
        self._client = httpx.Client(base_url=told["url"], timeout=PATIENCE_S)

    def safe_off(self) -> None:
        """Request it, whether or not the daemon says that it could."""
        assert self._client is not None
        self._client.post("/api/v1/acquisition/safe-off")

    def prepare_to_plan(self) -> None:
        """Have the daemon start the process that plans."""
        assert self._client is not None
        self._client.get("/prepare").raise_for_status()

    def state(self) -> tuple[str, str | None]:
        """Return what the daemon says of the capture, and why."""
        assert self._client is not None
        document = self._client.get("/api/v1/acquisition").json()
        return document["state"], document["reason"]

    def signal(self, number: signal.Signals) -> float:
        """Send a signal while the light is on; return when, in s.

        A machine that is laden enough puts it out before that.
        """
        assert self.process is not None
        while (sent_s := self.camera.signal(self.process.pid, int(number))) is None:
            self.light()
        return sent_s

    @contextmanager
    def stuck(self, where: str) -> Iterator[float]:
        """Let threads wait to the end of the block; yield since when they may do so, in s."""
        self._fifos += 1
        fifo = self._folder / f"fifo-{self._fifos}"
        os.mkfifo(fifo)
        assert self._client is not None
        asking = threading.Thread(
            target=self._client.get, args=(f"/{where}",), kwargs={"params": {"fifo": str(fifo)}}
        )
        begin_s = time.monotonic()
        asking.start()
        with fifo.open("wb"):  # opens once the other end is open: they wait
            yield begin_s
        asking.join()

    def stays_off(self) -> bool:
        """Return whether it stays dark, and does so over a restart, until somebody starts."""
        assert self.process is not None
        off_s = self.off_s
        if self.process.is_running() and self.process.status() != psutil.STATUS_STOPPED:
            wait_until(lambda: self.state()[0] == "stopped")  # it may only now run again
        self.start()
        self.goes_off(off_s)
        stayed = self.off_s == off_s and self.state()[0] == "stopped"
        self.light()
        return stayed

    def goes_off(self, since_s: float) -> float:
        """Wait until the light stays off; return how long after ``since_s`` it went off, in s.

        One that exposes on request is dark between two requests, too.
        """
        self.off_s = self.camera.off_since(self._dark_s)
        return self.off_s - since_s

    def end(self) -> None:
        """End the daemon, however it is, and see its supervisor end, as systemd does."""
        if self.process is not None:
            with suppress(psutil.NoSuchProcess):
                self.process.kill()
            self.process.wait(PATIENCE_S)
        watching, self.supervisor = self.supervisor, None
        if watching is not None:
            wait_until(lambda: not _command(watching))

    def close(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None
        self.end()
        self.process = None


def _command(process: psutil.Process) -> list[str]:
    """Return the command of a process; of one that has ended there is none."""
    try:
        return list(process.cmdline())
    except psutil.Error:
        return []


def _share_time(pid: int) -> None:
    """Give a session the priority of this one, where the kernel shares time between sessions."""
    with suppress(OSError):
        shares = Path("/proc/self/autogroup").read_text().split()
        if shares:  # a container may have the file, and nothing in it
            Path(f"/proc/{pid}/autogroup").write_text(shares[-1])


def _killed(control: Control) -> float:
    return control.goes_off(control.signal(signal.SIGKILL))


def _crashed(control: Control) -> float:
    return control.goes_off(control.signal(signal.SIGSEGV))


def _out_of_memory(control: Control) -> float:
    """Kill what the kernel would: the greatest ``oom_score`` first, until the daemon is gone."""
    assert control.process is not None
    control.prepare_to_plan()
    daemon = control.process.pid
    children = {each.pid: each for each in control.process.children()}
    while True:
        family = [daemon, *children]
        chosen = max(family, key=lambda pid: int(Path(f"/proc/{pid}/oom_score").read_text()))
        if chosen == daemon:
            return _killed(control)
        victim = children.pop(chosen)
        assert victim != control.supervisor
        victim.kill()


def _stopped(control: Control) -> float:
    return control.goes_off(control.signal(signal.SIGSTOP))


def _hung_disk(control: Control) -> float:
    """Nothing that waits for the disk comes back, and the daemon is asked to end."""
    with control.stuck("stuck-threads"):
        return control.goes_off(control.signal(signal.SIGTERM))


def _stuck_loop(control: Control) -> float:
    with control.stuck("stuck") as begin_s:
        return control.goes_off(begin_s)


def _stuck_camera(control: Control) -> float:
    with control.stuck("stuck-camera") as begin_s:
        return control.goes_off(begin_s)


def _stalled(control: Control) -> float:
    """The camera stalls requests, and somebody wants it off."""
    begin_s = time.monotonic()
    control.camera.do("stall", STALLED_REQUESTS)
    control.safe_off()
    took_s = control.goes_off(begin_s)
    control.camera.do("stall", 0)  # the next daemon could not open it
    return took_s


def _restarted(control: Control) -> float:
    """Asked to end, as a service manager does before it starts the next one."""
    return control.goes_off(control.signal(signal.SIGTERM))


def _supervisor_ended(control: Control) -> float:
    assert control.supervisor is not None
    begin_s = time.monotonic()
    control.supervisor.terminate()
    return control.goes_off(begin_s)


def _supervisor_killed(control: Control) -> float:
    assert control.supervisor is not None
    begin_s = time.monotonic()
    control.supervisor.kill()
    return control.goes_off(begin_s)


EVENTS: Final[dict[str, Callable[[Control], float]]] = {
    "stuck loop": _stuck_loop,
    "stuck camera thread": _stuck_camera,
    "USB stall": _stalled,
    "supervisor SIGTERM": _supervisor_ended,
    "supervisor SIGKILL": _supervisor_killed,
    "SIGSTOP": _stopped,
    "hung disk, SIGTERM": _hung_disk,
    "restart": _restarted,
    "out of memory": _out_of_memory,
    "SIGSEGV": _crashed,
    "SIGKILL": _killed,
}


ENDING: Final = {"SIGSTOP", "hung disk, SIGTERM", "restart", "out of memory", "SIGSEGV", "SIGKILL"}
"""After these the daemon is of no more use."""


def lose(control: Control, event: str) -> float:
    """Have the light on, let it happen, and return how long the light then stays on, in s.

    It is repeated where a machine that is laden had put the light out before.
    """
    took_s = -math.inf
    while took_s < -DARK_BEFORE_S:
        control.light()
        took_s = EVENTS[event](control)
        if event in ENDING:
            control.end()
    return max(took_s, 0.0)


NETWORKS: Final = {"0 s": 0.0, "4 s": 4.0, "silent": math.inf}
HOPS: Final = 3


class Relays:
    """Relays one behind the other, and the networks between them: the camera's is the first."""

    def __init__(self, control: Control, stack: ExitStack) -> None:
        self._control = control
        self._links: list[Forwarder] = []
        self._relays: list[Served] = []
        url = control.url
        for _ in range(HOPS):
            self._links.append(stack.enter_context(forwarding(url)))
            relay = f"relay:{self._links[-1].url}?timeout_s={PATIENCE_S:g}"
            self._relays.append(stack.enter_context(serving(relay)))
            url = self._relays[-1].url

    def safe_off(self, hop: int, delay_s: float) -> tuple[bool, float]:
        """Request it; return whether the light then stays off, and how long it was on, in s.

        That is beyond what the networks take; of silent ones from when they speak.
        """
        silent = delay_s == math.inf
        lit = False
        while not lit:
            self._control.light()
            for each in self._links:
                each.delay_s = 0.0 if silent else delay_s
                if silent:
                    each.silence()
            begin_s = time.monotonic()
            where = f"{self._relays[hop - 1].url}/api/v1/acquisition/safe-off"
            httpx.post(where, headers={"Prefer": "wait=0"}, timeout=PATIENCE_S)
            lit = not silent or self._is_lit()
            if silent:
                begin_s = time.monotonic()
                for each in self._links:
                    each.speak()
            if not lit:
                wait_until(self._settled)
        took_s = self._control.goes_off(begin_s) - (0.0 if silent else hop * delay_s)
        off_s = self._control.off_s
        for each in self._links:
            each.delay_s = 0.0
        wait_until(self._settled)
        self._control.goes_off(off_s)
        return self._control.off_s == off_s and self._control.state()[0] == "stopped", took_s

    def _is_lit(self) -> bool:
        """Wait for light, of some cameras now and then, or for a laden machine to put it out."""
        lit = False

        def look() -> bool:
            nonlocal lit
            lit = self._control.camera.lit
            return lit or self._control.state()[0] == "stopped"

        wait_until(look)
        return lit

    def _settled(self) -> bool:
        """Return whether every relay knows that it is off, and no request is on its way."""
        known = not any(each.service.acquisition.status().switching_off for each in self._relays)
        return known and not any(each.waiting for each in self._links)


@contextmanager
def controlled(
    zygote: Zygote, kind: str, *, silence_s: float = 1.0, dark_s: float = DARK_S
) -> Iterator[Control]:
    """Have a camera of a kind, and daemons before it."""
    with emulated_camera(kind) as camera, tempfile.TemporaryDirectory() as folder:
        control = Control(zygote, camera, Path(folder), silence_s, dark_s)
        try:
            yield control
        finally:
            control.close()


SAFE_OFFS: Final = {
    f"safe-off at relay {hop}, network {network}": (hop, delay_s)
    for hop in range(1, HOPS + 1)
    for network, delay_s in NETWORKS.items()
}


@dataclass(frozen=True)
class Try:
    """What became of one of many."""

    kind: str
    event: str
    number: int
    dark: bool
    """Whether the light then stayed off until somebody started it."""
    took_s: float
    """How long it was on."""
    why: str = ""
    """What else went wrong."""


def tries(noted: Path) -> list[Try]:
    """Read what was noted, a JSON object a line."""
    lines = noted.read_text().splitlines() if noted.exists() else ()
    return [Try(**json.loads(each)) for each in lines]


def try_all(times: int, noted: Path, *, cameras: int, kinds: tuple[str, ...] = KINDS) -> None:
    """Try everything so many times that is not noted yet, with so many cameras at a time."""
    done = {(each.kind, each.event, each.number) for each in tries(noted)}
    parts = []
    for first in range(0, times, 10):
        for events, some in ((SAFE_OFFS, RELAYED), (EVENTS, KINDS)):
            for kind in (each for each in some if each in kinds):
                numbers = range(first, min(first + 10, times))
                left = [(event, number) for number in numbers for event in events]
                left = [each for each in left if (kind, *each) not in done]
                parts.append((kind, left, noted))
    spawning = multiprocessing.get_context("spawn")
    with spawning.Pool(cameras, maxtasksperchild=1) as pool:
        for _ in pool.imap_unordered(_try_some, [each for each in parts if each[1]], chunksize=1):
            pass


def _try_some(part: tuple[str, list[tuple[str, int]], Path]) -> None:
    """Try one after another with one camera, and with the next where something went wrong."""
    kind, left, noted = part[0], deque(part[1]), part[2]
    zygote = Zygote()
    while left:
        with controlled(zygote, kind, dark_s=SURELY_DARK_S) as control, ExitStack() as stack:
            control.light()
            relays = Relays(control, stack) if left[0][0] in SAFE_OFFS else None
            why = ""
            while left and not why:
                event, number = left.popleft()
                dark, took_s = False, math.inf
                try:
                    if relays is not None:
                        dark, took_s = relays.safe_off(*SAFE_OFFS[event])
                    else:
                        took_s = lose(control, event)
                        dark = control.stays_off()
                except Exception as error:
                    why = repr(error)
                line = json.dumps(asdict(Try(kind, event, number, dark, took_s, why)))
                with noted.open("a") as file:
                    file.write(line + "\n")
    zygote.close()
