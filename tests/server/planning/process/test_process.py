"""Plans are computed in a process of its own, which ends with the work that is given up."""

import os
import subprocess
import threading
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

import pytest

from tests.server.planning import calls
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning import PlanningProcess, Progress


@pytest.fixture(scope="module")
def process() -> Iterator[PlanningProcess]:
    process = PlanningProcess()
    yield process
    process.close()


class GivenUp(Exception):  # noqa: N818 - is no error
    pass


class Until:
    """A progress whose work is given up once it computes."""

    def __init__(self) -> None:
        self.process = 0

    def __call__(self, share: float, step: str) -> None:
        if step.isdecimal():
            self.process = int(step)
            raise GivenUp


def test_another_process_computes_and_stays_for_the_next_call(process: PlanningProcess) -> None:
    first, second = (process.run(calls.pid, progress=Progress()) for _ in range(2))

    assert first == second != os.getpid()


def test_each_step_and_what_it_shows_arrives_once_and_in_order(process: PlanningProcess) -> None:
    seen: list[str] = []
    progress = Progress(
        lambda share, step: seen.append(f"{share:.3f} {step}"),
        first=0.5,
        show=lambda part: seen.append(f"shown {part['step']}"),
    )

    count = process.run(calls.steps, 3, progress=progress)

    # asked again where the process says nothing for a while
    assert count == 3
    assert [each for each in dict.fromkeys(seen) if "waiting" not in each] == [
        *("0.500 step 0", "shown 0"),
        *("0.667 step 1", "shown 1"),
        *("0.833 step 2", "shown 2"),
    ]


def test_what_it_raises_is_raised_here_as_it_was(process: PlanningProcess) -> None:
    before = process.run(calls.pid, progress=Progress())

    with pytest.raises(Problem) as raised:
        process.run(calls.refuse, progress=Progress())

    assert (raised.value.kind, raised.value.detail) == (kinds.TARGET_UNREACHABLE, "Too far.")
    assert raised.value.extensions == {"field": "range_error_m", "best": None}
    assert process.run(calls.pid, progress=Progress()) == before


def test_work_that_is_given_up_ends_at_once_and_the_next_goes_on(process: PlanningProcess) -> None:
    until = Until()

    with pytest.raises(GivenUp):
        process.run(calls.go_on_for_ever, progress=Progress(until))

    assert not calls.is_running(until.process)
    assert process.run(calls.pid, progress=Progress()) != until.process


def test_a_process_that_was_killed_is_a_problem_of_that_call_alone(
    process: PlanningProcess,
) -> None:
    with pytest.raises(Problem) as raised:
        process.run(calls.end_at_once, progress=Progress())

    assert (raised.value.kind, raised.value.kind.status) == (kinds.PLANNING_ENDED, 503)
    assert raised.value.extensions == {"retry_after_s": 10}
    assert process.run(calls.pid, progress=Progress()) > 0


def test_too_little_memory_is_the_same(process: PlanningProcess) -> None:
    with pytest.raises(Problem, match="too little memory") as raised:
        process.run(calls.want_all_memory, progress=Progress())

    assert raised.value.kind is kinds.PLANNING_ENDED
    assert process.run(calls.pid, progress=Progress()) > 0


def test_the_end_gives_up_what_is_computed() -> None:
    process = PlanningProcess()
    began = threading.Event()
    raised: list[Problem] = []

    def compute() -> None:
        with pytest.raises(Problem) as info:
            process.run(calls.go_on_for_ever, progress=Progress(lambda share, step: began.set()))
        raised.append(info.value)

    thread = threading.Thread(target=compute)
    thread.start()
    assert began.wait(60)
    process.leave()  # does nothing while it computes

    process.close()
    thread.join()

    assert raised[0].kind is kinds.SHUTTING_DOWN
    with pytest.raises(Problem, match="shutting down"):
        process.run(calls.pid, progress=Progress())


@pytest.mark.parametrize("compute", [calls.go_on_for_ever, calls.tell_for_ever])
def test_what_is_not_done_in_time_is_given_up(compute: Callable[[Progress], NoReturn]) -> None:
    began = threading.Event()
    process = PlanningProcess(60.0, clock=lambda: 61.0 if began.is_set() else 0.0)
    try:
        with pytest.raises(Problem) as raised:
            process.run(compute, progress=Progress(lambda share, step: began.set()))
    finally:
        process.close()
    assert raised.value.kind is kinds.PLAN_TOO_LONG
    assert raised.value.extensions["limit"] == 60.0


def test_it_leaves_when_it_has_nothing_to_do_and_comes_back(process: PlanningProcess) -> None:
    gone = process.run(calls.pid, progress=Progress())

    process.leave()

    assert not calls.is_running(gone)
    assert process.run(calls.pid, progress=Progress()) != gone


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Ids of the processes that are started."""
    ids: list[int] = []
    start = subprocess.Popen

    def noted(*arguments: Any, **options: Any) -> Any:
        process = start(*arguments, **options)
        ids.append(process.pid)
        return process

    monkeypatch.setattr(subprocess, "Popen", noted)
    return ids


def test_it_is_there_before_the_first_call_once_it_was_prepared(started: list[int]) -> None:
    process = PlanningProcess()
    process.prepare()
    process.prepare()
    assert len(started) == 1

    assert process.run(calls.pid, progress=Progress()) == started[0]
    process.close()


def test_none_is_prepared_after_the_end(started: list[int]) -> None:
    process = PlanningProcess()
    process.close()
    process.prepare()
    assert started == []


def test_a_system_without_room_for_a_process_does_not_stop_what_prepares_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def full(*arguments: Any, **options: Any) -> Any:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    process = PlanningProcess()
    with monkeypatch.context() as patched:
        patched.setattr(subprocess, "Popen", full)
        process.prepare()
    assert process.run(calls.pid, progress=Progress()) > 0
    process.close()
