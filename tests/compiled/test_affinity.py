"""Threads that work on other processors than the thread that calls them."""

import os
import threading
from collections.abc import Iterator

import pytest

from transientcam_compiled._spread import ThreadsApart

if not hasattr(os, "sched_setaffinity"):
    pytest.skip("the system does not let threads be placed", allow_module_level=True)

ALLOWED = os.sched_getaffinity(0)


class _Caller:
    """Where the calling thread is said to run."""

    processor = min(ALLOWED)

    def __call__(self) -> int:
        return self.processor


@pytest.fixture
def caller() -> _Caller:
    return _Caller()


@pytest.fixture
def threads(caller: _Caller) -> Iterator[ThreadsApart]:
    with ThreadsApart(1, "test-apart", caller) as made:
        made.submit(int).result()  # the thread exists
        yield made


def places(threads: ThreadsApart) -> set[int]:
    """Return the processors that work submitted now may use."""
    found: set[int] = threads.submit(os.sched_getaffinity, 0).result()
    return found


needs_two = pytest.mark.skipif(len(ALLOWED) < 2, reason="there is one processor only")


@needs_two
def test_work_is_done_off_the_processor_of_the_caller(threads: ThreadsApart) -> None:
    assert places(threads) == ALLOWED - {min(ALLOWED)}


@needs_two
def test_threads_follow_a_caller_that_has_moved(threads: ThreadsApart, caller: _Caller) -> None:
    places(threads)
    caller.processor = max(ALLOWED)
    assert places(threads) == ALLOWED - {max(ALLOWED)}
    assert os.sched_getaffinity(0) == ALLOWED, "the caller itself stays free"


def test_a_caller_with_one_processor_shares_it(threads: ThreadsApart, caller: _Caller) -> None:
    found: list[set[int]] = []

    def call() -> None:
        os.sched_setaffinity(0, {caller.processor})
        found.append(places(threads))

    thread = threading.Thread(target=call)
    thread.start()
    thread.join()
    assert found == [{caller.processor}]


@needs_two
def test_threads_are_let_go_again_with_their_caller(threads: ThreadsApart, caller: _Caller) -> None:
    test_a_caller_with_one_processor_shares_it(threads, caller)
    assert places(threads) == ALLOWED - {caller.processor}


def test_threads_stay_where_the_system_puts_them_if_it_does_not_say_where_a_caller_runs(
    threads: ThreadsApart, caller: _Caller
) -> None:
    caller.processor = -1
    with ThreadsApart(1, "test-apart", caller) as others:
        others.submit(int).result()
        assert places(others) == ALLOWED


def test_a_system_that_forbids_placing_threads_stops_no_work(
    threads: ThreadsApart, monkeypatch: pytest.MonkeyPatch
) -> None:
    def forbidden(_thread: int, _processors: set[int]) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setaffinity", forbidden)
    assert threads.submit(max, 2, 3).result() == 3


@needs_two
def test_the_real_processor_of_a_caller_is_left() -> None:
    """Whatever processor the caller runs on, it is one that the threads do not use."""
    with ThreadsApart(1, "test-apart") as made:
        made.submit(int).result()
        found = places(made)
    assert len(found) == len(ALLOWED) - 1
    assert found < ALLOWED
