"""A daemon in a process of its own, as a user would start it, and what it spends."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import httpx

VIDEO = {"base_frequency_hz": 23e6, "harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}
"""The paper's video setting (Sec. 6.3): 12 images, 18.6 Hz."""
COMPILED_WITHIN_S = 900.0
_LOOK_EVERY_S = 0.5
_QUIET = {"PYTHONUNBUFFERED": "1", "TRANSIENTCAM_LOG_LEVEL": "warning"}


class Process:
    """A program that prints where it serves."""

    def __init__(
        self,
        command: Sequence[str | Path],
        environment: Mapping[str, str],
        *,
        log: int | None = None,
    ) -> None:
        self.started_s = time.perf_counter()
        self._process = subprocess.Popen(
            command,
            env=os.environ | _QUIET | dict(environment),
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )
        assert self._process.stdout is not None
        found = None
        while found is None:
            line = self._process.stdout.readline()
            if not line:
                raise RuntimeError("the program ended before it said where it serves")
            # the last one: the name of a camera may hold an address, too
            found = re.search(r".*\b((http|ws)s?://\S+)", line)
        self.url = found.group(1)
        self.address_s = self.age_s()

    @property
    def stream_url(self) -> str:
        """Address of its stream."""
        return self.url.replace("http", "ws", 1).rstrip("/") + "/api/v1/stream"

    def settle(self, within_s: float = COMPILED_WITHIN_S) -> None:
        """Wait until it compiles nothing any more."""
        end_s = time.monotonic() + within_s
        with httpx.Client(base_url=self.url, timeout=60.0, verify=False) as client:
            while client.get("/api/v1/info").raise_for_status().json()["kernels"]:
                if time.monotonic() > end_s:
                    raise TimeoutError("the kernels are still being compiled")
                time.sleep(_LOOK_EVERY_S)

    def age_s(self) -> float:
        """Return the time since the process was started, in s."""
        return time.perf_counter() - self.started_s

    def cpu_s(self) -> float:
        """Return the processor time spent so far, in s, also by threads that have ended."""
        # what clock_getcpuclockid(3) returns: in ns, where /proc/PID/stat counts ticks of 10 ms
        return time.clock_gettime(~self._process.pid << 3 | 2)

    def loop_cpu_s(self) -> float:
        """Return the processor time of its first thread, which runs the event loop, in s."""
        pid = self._process.pid
        stat = Path(f"/proc/{pid}/task/{pid}/schedstat").read_text(encoding="utf-8")
        return int(stat.split()[0]) * 1e-9

    def resident_bytes(self) -> int:
        """Return the memory it occupies."""
        status = Path(f"/proc/{self._process.pid}/status").read_text(encoding="utf-8")
        found = re.search(r"VmRSS:\s+(\d+) kB", status)
        assert found is not None
        return 1024 * int(found.group(1))

    def descriptors(self) -> int:
        """Return how many files, sockets and pipes it has open."""
        return sum(1 for _ in Path(f"/proc/{self._process.pid}/fd").iterdir())

    def threads(self) -> int:
        """Return how many threads it runs."""
        return sum(1 for _ in Path(f"/proc/{self._process.pid}/task").iterdir())

    def kill(self) -> None:
        """End it wherever it is, with SIGKILL."""
        self._process.kill()
        self._process.communicate()

    def end_within(self, limit_s: float) -> float | None:
        """Ask it to end; return how long that took, or None and kill it where it takes longer."""
        begin_s = time.perf_counter()
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.communicate(timeout=limit_s)
        except subprocess.TimeoutExpired:
            self.kill()
            return None
        return time.perf_counter() - begin_s

    def end(self) -> None:
        """Ask it to end, and wait until it has."""
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.communicate(timeout=15)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise


@contextmanager
def running(
    command: Sequence[str | Path], environment: Mapping[str, str] | None = None
) -> Iterator[Process]:
    """Run a program until the block ends."""
    process = Process(command, environment or {})
    try:
        yield process
    finally:
        process.end()


@contextmanager
def daemon(*options: str, environment: Mapping[str, str] | None = None) -> Iterator[Process]:
    """Run ``transientcam serve`` on a port the system chooses, until the block ends."""
    program = Path(sys.executable).with_name("transientcam")
    command: list[str | Path] = [program, "serve", "--port", "0", *options]
    with running(command, environment) as process:
        yield process
