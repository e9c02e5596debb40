"""Kernels of a library that are not in the cache: who compiles them, and what goes on without."""

import logging
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from tests.compiled import calls
from transientcam_compiled import THREAD, Cache, Kernels

HERE = f"a of {THREAD}"


@pytest.fixture
def cache(tmp_path: Path) -> Cache:
    return Cache("transientcam_compiled._spread", environ={"NUMBA_CACHE_DIR": str(tmp_path)})


def made(cache: Cache, load: Callable[[str], object] = calls.load, **environ: str) -> Kernels[str]:
    """Return kernels after two were made ready in the background."""
    kernels = Kernels[str](environ, cache, load)
    thread = kernels.prefer(["a", "b"])
    if thread is not None:
        thread.join()
    assert kernels.compiling is None
    return kernels


def test_what_another_process_has_compiled_is_loaded_by_this_one(
    cache: Cache, caplog: pytest.LogCaptureFixture
) -> None:
    assert made(cache).compiled["a"] == HERE
    assert not caplog.records


def test_what_ends_the_process_is_reported_once_and_compiled_on_the_thread(
    cache: Cache, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, "transientcam_compiled"):
        kernels = made(cache, partial(calls.load_here, os.getpid()))

    assert kernels.compiled.keys() == {"a", "b"}
    assert len(caplog.records) == 1
    assert "(it has ended); they are compiled on a thread" in caplog.text


def test_a_system_without_room_for_a_process_is_reported_once(
    cache: Cache, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")

    assert made(cache).compiled.keys() == {"a", "b"}
    assert len(caplog.records) == 1


def test_a_program_that_is_no_python_compiles_on_the_thread(
    cache: Cache, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "")

    assert made(cache).compiled["a"] == HERE
    assert not caplog.records


def test_where_nothing_is_kept_no_process_compiles(caplog: pytest.LogCaptureFixture) -> None:
    nowhere = Cache("transientcam_compiled._spread", environ={})

    assert made(nowhere, partial(calls.load_here, os.getpid())).compiled["a"] == HERE
    assert not caplog.records


def test_what_cannot_be_compiled_says_why_in_one_line(cache: Cache) -> None:
    kernels = made(cache, calls.fail)

    assert kernels.failed == dict.fromkeys("ab", "RuntimeError: no such processor")
    assert not kernels.compiled


def test_kernels_that_are_off_are_never_made(cache: Cache, tmp_path: Path) -> None:
    kernels = made(cache, TRANSIENTCAM_KERNELS="off")
    kernels.make_ready("a")

    assert not kernels.compiled
    assert list(tmp_path.iterdir()) == []


def test_a_program_that_ends_does_not_wait_for_what_another_process_compiles(
    tmp_path: Path,
) -> None:
    code = (
        "import os\n"
        "from functools import partial\n"
        "from tests.compiled import calls\n"
        "from transientcam_compiled import Cache, Kernels\n"
        "load = partial(calls.load_never, os.getpid())\n"
        "kernels = Kernels({}, Cache('transientcam_compiled._spread'), load)\n"
        "kernels.prefer(['a'])\n"
        "print('the end')\n"
    )
    root = Path(__file__).resolve().parents[2]
    environ = {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(root)}
    command = [sys.executable, "-W", "error", "-c", code]

    printed = subprocess.check_output(command, env=os.environ | environ, text=True, timeout=300)

    assert printed == "the end\n"


class Slow:
    """Loads nothing before it may, and notes what it was asked for."""

    def __init__(self) -> None:
        self.begun, self.go_on = threading.Event(), threading.Event()
        self.keys: list[str] = []

    def __call__(self, key: str) -> str:
        self.begun.set()
        assert self.go_on.wait(60.0)
        self.keys.append(key)
        return key


def test_what_is_preferred_goes_first_and_what_calls_wanted_before_is_dropped() -> None:
    slow = Slow()
    kernels = Kernels[str]({}, Cache("transientcam_compiled._spread", environ={}), slow)
    kernels.want("begun")
    assert slow.begun.wait(60.0)
    kernels.want("before")
    kernels.prefer(["x", "y"])
    kernels.want("meanwhile")
    thread = kernels.prefer(["begun", "z", "y"])
    assert thread is not None
    slow.go_on.set()
    thread.join()

    assert slow.keys == ["begun", "z", "y"]
    kernels.want("before")  # that calls still do without it is seen when they want it again
    for thread in threading.enumerate():
        if thread.name == THREAD:
            thread.join()
    assert slow.keys[3:] == ["before"]


def test_how_long_it_takes_is_expected_from_what_is_known_and_has_passed() -> None:
    slow = Slow()
    kernels = Kernels[str](
        {},
        Cache("transientcam_compiled._spread", environ={}),
        slow,
        expected_s=lambda key: 10.0 if key == "a" else 2.0,
    )
    assert kernels.left("abc", 0.0) == ([], 0.0)
    thread = kernels.prefer(["a", "b", "c"])
    assert slow.begun.wait(60.0)

    assert kernels.left("abc", 100.0) == (["a", "b", "c"], 14.0)
    assert kernels.left(["b"], 104.0) == (["b"], 8.0)
    assert kernels.left(["a"], 150.0) == (["a"], 1.0), "longer than expected: not yet"

    slow.go_on.set()
    assert thread is not None
    thread.join()
    assert kernels.left("abc", 200.0) == ([], 0.0)
