"""Waiting for a disk that may not answer."""

import asyncio
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from tests.conftest import ROOT
from tests.waiting import wait_until
from transientcam_server.errors import Problem, kinds
from transientcam_server.recording import DiskThreads

STALLED_S = 0.05


class Gate:
    """A disk that answers once it is opened."""

    def __init__(self) -> None:
        self.opened = threading.Event()
        self.waiting = 0
        self.done: list[int] = []

    def pass_through(self, number: int) -> int:
        """Wait for it."""
        self.waiting += 1
        self.opened.wait()
        self.done.append(number)
        return number


@pytest.fixture
def gate() -> Iterator[Gate]:
    gate = Gate()
    yield gate
    gate.opened.set()


@pytest.fixture
def threads(gate: Gate) -> Iterator[DiskThreads]:
    threads = DiskThreads(stalled_s=STALLED_S)
    yield threads
    gate.opened.set()
    threads.close()


def test_results_and_errors_come_back(threads: DiskThreads) -> None:
    assert asyncio.run(threads.run(divmod, 7, 2)) == (3, 1)
    with pytest.raises(ZeroDivisionError):
        asyncio.run(threads.run(divmod, 7, 0))


def test_a_disk_that_does_not_answer_is_said_to_be_stalled_and_takes_few_threads(
    threads: DiskThreads, gate: Gate
) -> None:
    async def ask() -> list[object]:
        wanted = (threads.run(gate.pass_through, number) for number in range(50))
        return list(await asyncio.gather(*wanted, return_exceptions=True))

    answers = asyncio.run(ask())

    assert all(isinstance(each, Problem) for each in answers)
    assert {each.kind for each in answers if isinstance(each, Problem)} == {kinds.DISK_STALLED}
    assert threads._threads < 10
    wait_until(lambda: gate.waiting == threads._threads)  # those that had only just begun, too
    wait_until(lambda: threads.waiting_s >= STALLED_S)


def test_what_was_refused_before_it_began_is_never_done(threads: DiskThreads, gate: Gate) -> None:
    async def ask() -> None:
        wanted = (threads.run(gate.pass_through, number) for number in range(50))
        await asyncio.gather(*wanted, return_exceptions=True)
        begun = gate.waiting
        gate.opened.set()
        assert await threads.run(gate.pass_through, 100) == 100
        wait_until(lambda: len(gate.done) == begun + 1)

    asyncio.run(ask())
    assert threads.waiting_s == 0.0


def test_a_disk_that_is_only_slow_is_waited_for(gate: Gate) -> None:
    done = iter(range(1000))
    turns: list[int] = []

    def activity() -> int:
        turns.append(next(done))
        if len(turns) == 6:
            gate.opened.set()
        return turns[-1]

    threads = DiskThreads(stalled_s=STALLED_S, activity=activity)
    assert asyncio.run(threads.run(gate.pass_through, 1)) == 1
    assert len(turns) >= 6
    threads.close()


def test_work_has_waited_since_the_first_of_it_began(gate: Gate) -> None:
    now_s = [1000.25]
    threads = DiskThreads(stalled_s=60.0, clock=lambda: now_s[0])

    async def wait_for_two() -> None:
        first = asyncio.create_task(threads.run(gate.pass_through, 1))
        await asyncio.to_thread(wait_until, lambda: gate.waiting == 1)
        now_s[0] += 2.5
        second = asyncio.create_task(threads.run(gate.pass_through, 2))
        await asyncio.to_thread(wait_until, lambda: gate.waiting == 2)
        now_s[0] += 2.0
        assert threads.waiting_s == 4.5
        gate.opened.set()
        await asyncio.gather(first, second)

    asyncio.run(wait_for_two())
    assert threads.waiting_s == 0.0
    threads.close()


def test_work_is_done_as_whoever_accounts_for_it_has_it(threads: DiskThreads) -> None:
    threads.around = lambda work: lambda: (work(), "counted")

    assert asyncio.run(threads.run(divmod, 7, 2)) == ((3, 1), "counted")


@pytest.fixture
def hung(tmp_path: Path) -> Iterator[tuple["subprocess.Popen[str]", httpx.Client]]:
    """A daemon whose disk hangs once there is a file ``hangs``, and a client."""
    with subprocess.Popen(
        [
            *(sys.executable, "-m", "tests.server.recording.hung_daemon", str(tmp_path / "hangs")),
            *("serve", "--camera", "sim:mirrors", "--port", "0", "--log-level", "error"),
        ],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ
        | {
            "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path]),
            "NUMBA_DISABLE_JIT": "1",
            "COLUMNS": "200",
            "TRANSIENTCAM_RECONSTRUCTION__NEIGHBOURS": "gaussian",
            "STATE_DIRECTORY": str(tmp_path),
            "TRANSIENTCAM_RECORDINGS__MIN_FREE_BYTES": "0",
            "TRANSIENTCAM_RECORDINGS__STALLED_S": "1.0",
            "TRANSIENTCAM_LIMITS__UNSERVED_S": "60",  # a laden machine would end the capture
        },
    ) as process:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None
        with httpx.Client(base_url=found.group(), timeout=60.0) as client:
            yield process, client
        process.kill()


def test_a_service_whose_disk_hangs_serves_all_else_and_ends_when_it_is_to(
    hung: tuple["subprocess.Popen[str]", httpx.Client], tmp_path: Path
) -> None:
    process, client = hung

    def frames() -> int:
        found = client.get("/api/v1/recordings").json().get("recordings")
        return found[0]["frames"] if found else 0

    client.post("/api/v1/recordings", json={})  # a laden machine may take longer than is waited
    wait_until(lambda: frames() > 0)
    recording = client.get("/api/v1/recordings").raise_for_status().json()["active"]
    (tmp_path / "hangs").touch()

    # not a frame, which is kept once it was read
    parts = f"/api/v1/recordings/{recording}/zarr/.zmetadata"
    wait_until(lambda: client.get(parts).status_code == 503)
    for method, path in (("GET", parts), ("GET", f"/api/v1/recordings/{recording}/frames/1")):
        answer = client.request(method, path)
        assert (answer.status_code, answer.json()["type"]) == (503, "/problems/disk-stalled"), path
        assert int(answer.headers["retry-after"]) >= 1
    assert client.get("/api/v1/frames/latest").status_code == 200
    # what the recorder knows of what it records is on no disk
    assert client.get(f"/api/v1/recordings/{recording}").json()["state"] == "recording"
    stopped = client.post(f"/api/v1/recordings/{recording}/stop").json()
    # never complete, as long as the disk hangs
    assert stopped.get("state") == "finishing" or stopped["type"] == "/problems/disk-stalled"
    waiting = re.search(
        r"^transientcam_disk_waiting_seconds (\S+)", client.get("/metrics").text, re.M
    )
    assert waiting is not None
    assert float(waiting.group(1)) > 1.0
    client.post("/api/v1/acquisition/safe-off").raise_for_status()

    process.send_signal(signal.SIGTERM)
    assert process.wait(60.0) == 0
    assert [path.name for path in (tmp_path / "recordings").iterdir()] == [f"{recording}.h5.part"]
