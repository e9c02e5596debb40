"""Another process that calls functions: what it is, how it fails, when it ends."""

import os
import select
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NoReturn

import pytest

from tests.compiled import calls
from transientcam_compiled import ChildProcess, ProcessEnded
from transientcam_compiled._process import NICE, python


class GivenUp(Exception):  # noqa: N818 - is no error
    pass


def go_on() -> None:
    pass


def give_up(*_: object) -> NoReturn:
    raise GivenUp


@pytest.fixture
def child() -> Iterator[ChildProcess]:
    child = ChildProcess(calls.noted)
    yield child
    child.end()


def is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_another_process_answers_and_stays_for_the_next_call(child: ChildProcess) -> None:
    child.start()
    first, second = (child.call(calls.pid, ask=go_on) for _ in range(2))

    assert first == second != os.getpid()


def test_it_takes_what_others_leave_of_the_processor(child: ChildProcess) -> None:
    assert child.call(calls.niceness, ask=go_on) == min(os.nice(0) + NICE, 19)


def test_where_memory_is_short_it_goes_first_and_it_never_gets_much() -> None:
    child = ChildProcess(memory_bytes=1 << 28)
    small = child.call(calls.limits, ask=go_on)
    child.end()
    child = ChildProcess(memory_bytes=1 << 30)
    large = child.call(calls.limits, ask=go_on)
    child.end()

    assert small[0] == large[0] == 1000
    assert 0.7 * 2**30 < large[1] - small[1] < 0.8 * 2**30


def test_it_runs_no_main_module_of_this_program(child: ChildProcess) -> None:
    found = Path(child.call(calls.main_module, ask=go_on))

    assert (found.parent.name, found.name) == ("transientcam_compiled", "__main__.py")


def test_all_that_is_said_arrives_in_order_before_the_answer(child: ChildProcess) -> None:
    said: list[object] = []

    assert child.call(calls.count, 3, ask=go_on, told=said.append) == 3
    assert said == [0, 1, 2]


def test_calls_are_inside_a_context(child: ChildProcess) -> None:
    assert child.call(calls.seen, ask=go_on) == ["entered"]


def test_it_has_something_to_do_while_nothing_is_called(tmp_path: Path) -> None:
    fifo = tmp_path / "said"
    os.mkfifo(fifo)
    child = ChildProcess(idle=partial(calls.write, fifo))
    child.start()

    assert fifo.read_text() == "idle"  # waits for it
    child.end()


def test_what_it_raises_is_raised_here_and_does_not_end_it(child: ChildProcess) -> None:
    before = child.call(calls.pid, ask=go_on)

    with pytest.raises(OSError, match="full") as raised:
        child.call(calls.refuse, ask=go_on)

    assert not isinstance(raised.value, ProcessEnded)
    assert child.call(calls.pid, ask=go_on) == before


def test_an_answer_that_cannot_be_sent_is_an_error_of_that_call(child: ChildProcess) -> None:
    with pytest.raises(TypeError, match="pickle"):
        child.call(calls.a_lock, ask=go_on)

    assert child.call(calls.pid, ask=go_on) > 0


def test_a_call_that_is_given_up_kills_it_and_the_next_one_starts_another(
    child: ChildProcess,
) -> None:
    said: list[int] = []

    def ask() -> None:
        if said:
            raise GivenUp

    with pytest.raises(GivenUp):
        child.call(calls.go_on_for_ever, ask=ask, told=lambda each: said.append(int(str(each))))

    assert not is_running(said[0])
    assert child.call(calls.pid, ask=go_on) != said[0]


def test_whoever_is_told_may_give_up_too(child: ChildProcess) -> None:
    with pytest.raises(GivenUp):
        child.call(calls.go_on_for_ever, ask=go_on, told=give_up)


def test_one_that_ends_meanwhile_is_noticed_and_the_next_call_starts_another(
    child: ChildProcess,
) -> None:
    with pytest.raises(ProcessEnded):
        child.call(calls.end_at_once, ask=go_on)

    assert child.call(calls.pid, ask=go_on) > 0


def test_one_that_ends_before_its_first_call_is_noticed() -> None:
    with pytest.raises(ProcessEnded):
        ChildProcess(calls.ending).call(calls.pid, ask=go_on)


def test_a_python_that_is_not_there_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")

    with pytest.raises(FileNotFoundError):
        ChildProcess().start()


@pytest.mark.parametrize("executable", ["", "/opt/matlab/bin/matlab", None])
def test_a_program_that_embeds_python_is_not_started_again(
    executable: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", executable)

    assert python() is None
    with pytest.raises(OSError, match="no Python"):
        ChildProcess().start()


def test_a_packed_program_is_not_started_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "frozen", True, raising=False)

    assert python() is None


@pytest.mark.parametrize("does", ["go_on_for_ever", "hold_the_interpreter"])
def test_it_ends_with_a_parent_that_is_killed_whatever_it_does(does: str) -> None:
    code = (
        "from tests.compiled import calls\n"
        "from transientcam_compiled import ChildProcess\n"
        f"ChildProcess().call(calls.{does}, ask=lambda: None,\n"
        "    told=lambda pid: print(pid, flush=True))\n"
    )
    root = Path(__file__).resolve().parents[2]
    parent = subprocess.Popen(
        [sys.executable, "-W", "error", "-c", code],
        env=os.environ | {"PYTHONPATH": str(root)},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert parent.stdout is not None
    child = os.pidfd_open(int(parent.stdout.readline()))
    try:
        parent.kill()
        parent.communicate()

        ended, _, _ = select.select([child], [], [], 600)
        assert ended, "it goes on computing without a parent"
    finally:
        os.close(child)
