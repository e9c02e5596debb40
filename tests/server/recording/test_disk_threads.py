"""Waiting for a disk that may not answer."""

import asyncio
import threading
from collections.abc import Iterator

import pytest

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

    before = threading.active_count()
    answers = asyncio.run(ask())

    assert all(isinstance(each, Problem) for each in answers)
    assert {each.kind for each in answers if isinstance(each, Problem)} == {kinds.DISK_STALLED}
    assert threading.active_count() - before == gate.waiting < 10
    assert threads.waiting_s >= STALLED_S


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


def test_work_is_done_as_whoever_accounts_for_it_has_it(threads: DiskThreads) -> None:
    threads.around = lambda work: lambda: (work(), "counted")

    assert asyncio.run(threads.run(divmod, 7, 2)) == ((3, 1), "counted")
