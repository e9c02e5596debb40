"""Calls have their kernels made ready in the background, and use all cores; no call waits."""

import logging
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments.compiled_kernels import CACHE, kernels
from transientcam_compiled import Kernels, _kernels, _spread
from transientcam_compiled._memory import Pool
from transientcam_moments import _dispatch
from transientcam_moments._dispatch import (
    HEAVY_PIXELS,
    KERNELS,
    LEAST_PIXELS,
    Key,
    accelerated,
    on_threads,
)


def moments(m: int, pixels: int = HEAVY_PIXELS) -> NDArray[np.complex64]:
    """Two returns a pixel, and a uniform part."""
    random = np.random.default_rng(m)
    phase_rad = random.uniform(0, 2 * np.pi, (2, pixels))
    weight = np.array([[700.0], [200.0]])
    b = np.stack([(weight * np.exp(1j * j * phase_rad)).sum(axis=0) for j in range(m + 1)])
    b[0] += 100
    return b.astype(np.complex64)


class Compiler:
    """Stands in for the compiler: waits until it may go on, and notes what it is asked for."""

    def __init__(self) -> None:
        self.go_on = threading.Event()
        self.keys: list[Key] = []

    def __call__(self, key: Key, *, elsewhere: bool = False) -> None:
        assert self.go_on.wait(60)
        self.keys.append(key)

    def finish(self) -> list[Key]:
        """Let it do everything, and return what that was."""
        self.go_on.set()
        for thread in threading.enumerate():
            if thread.name == tm.kernels.THREAD:
                thread.join()
        return self.keys


@pytest.fixture
def anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have nothing compiled, and nothing wanted before."""
    fresh: Kernels[Key] = Kernels({}, _dispatch.CACHE, expected_s=lambda key: key.compiling_s)
    for name, value in vars(fresh).items():
        monkeypatch.setattr(KERNELS, name, value)


@pytest.fixture
def compiler(anew: None, monkeypatch: pytest.MonkeyPatch) -> Iterator[Compiler]:
    made = Compiler()
    monkeypatch.setattr(KERNELS, "make_ready", made)
    yield made
    made.finish()


def test_a_heavy_call_returns_while_its_kernel_is_being_compiled(compiler: Compiler) -> None:
    b = moments(3)

    first = tm.levinson(b)  # would never return if it waited
    tm.levinson(b)

    assert np.isfinite(first.error).all()
    assert compiler.keys == []
    assert compiler.finish() == [Key("levinson", 3, "f")]


def test_small_calls_are_not_worth_a_compiler(compiler: Compiler) -> None:
    tm.levinson(moments(3, HEAVY_PIXELS - 1))

    assert compiler.finish() == []


def test_an_order_that_has_no_kernel_is_left_to_numpy(compiler: Compiler) -> None:
    tm.pisarenko(moments(9))

    assert "pisarenko" not in {key.name for key in compiler.finish()}


def test_what_takes_long_to_compile_comes_last(compiler: Compiler) -> None:
    for name in ("levinson", "reconstruct", "density", "smooth"):
        KERNELS.want(Key(name, 3, "f"))

    # the first may have begun before the others were wanted
    assert [key.name for key in compiler.finish()] == [
        "levinson",
        "density",
        "smooth",
        "reconstruct",
    ]


def test_what_is_being_made_ready_is_named_in_its_order(compiler: Compiler) -> None:
    tm.kernels.prepare(["likelihood", "reconstruct", "harmonics"], 4)

    named, left_s = tm.kernels.preparing(["reconstruct", "likelihood"], 4, now_s=7.0)

    assert named == ["likelihood m<=8 float32", "reconstruct m=4 float32"]
    assert left_s > 1.0
    assert tm.kernels.preparing(["density"], 4, now_s=7.0) == ([], 0.0)
    assert [key.name for key in compiler.finish()] == ["likelihood", "reconstruct", "harmonics"]


def test_a_process_may_note_what_calls_want_and_make_it_ready_later(compiler: Compiler) -> None:
    compiler.go_on.set()

    with tm.kernels.only_note():
        tm.levinson(moments(3, LEAST_PIXELS))
        tm.levinson(moments(4, LEAST_PIXELS - 1))
    assert tm.kernels.THREAD not in {thread.name for thread in threading.enumerate()}
    tm.kernels.make_ready()

    assert compiler.finish() == [Key("levinson", 3, "f")]


def test_kernels_are_settled_once_those_there_are_serve_or_have_failed(
    compiler: Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not tm.kernels.settled(["levinson", "pisarenko"], 3)
    KERNELS.compiled[Key("levinson", 3, "f")] = lambda b: b
    assert not tm.kernels.settled(["levinson", "pisarenko"], 3)
    KERNELS.failed[Key("pisarenko", 3, "f")] = "no compiler"
    assert tm.kernels.settled(["levinson", "pisarenko"], 3)
    assert tm.kernels.settled(["pisarenko"], 9), "there is none for so many"
    monkeypatch.setattr(KERNELS, "automatic", False)
    assert tm.kernels.settled(["levinson"], 4), "nothing changes by itself"


def test_one_line_says_so_once(compiler: Compiler, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "transientcam_compiled"):
        for m in (3, 4):
            tm.density(tm.levinson(moments(m)), [0.0])

    assert len(caplog.records) == 1
    assert "TRANSIENTCAM_KERNELS=off" in caplog.text


def test_loading_begins_when_the_first_call_has_returned(
    compiler: Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would take the interpreter's lock from that call."""
    waits = threading.Event()

    class Noticed(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            waits.set()
            return super().wait(None)

    monkeypatch.setattr(KERNELS, "_may_load", Noticed())
    compiler.go_on.set()
    loaded_meanwhile: list[Key] = []

    @accelerated("levinson")
    def planar(b: NDArray[np.complex64]) -> NDArray[np.complex64]:
        assert waits.wait(60)
        loaded_meanwhile.extend(compiler.keys)
        return b

    planar(moments(3))

    assert compiler.finish() == [Key("levinson", 3, "f")]
    assert loaded_meanwhile == []


def test_memory_for_the_results_of_the_next_call_is_there_with_its_kernel(
    anew: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    pool, loaded = Pool(), threading.Event()

    def load(key: Key) -> Callable[..., object]:
        assert loaded.wait(60)
        return lambda *planes: None  # leaves everything to NumPy

    monkeypatch.setattr(_kernels, "POOL", pool)
    monkeypatch.setattr(KERNELS, "load", load)
    b = moments(3, 20_000)
    first = tm.levinson(b)
    loaded.set()
    for thread in threading.enumerate():
        if thread.name == tm.kernels.THREAD:
            thread.join()
    assert tm.kernels.state()["compiled"] == ["levinson m=3 float32"]

    assert pool.size_bytes == first.error.nbytes + first.polynomial.nbytes + first.reflection.nbytes


def in_fresh_process(setting: str) -> str:
    code = (
        "import sys, threading, numpy as np, transientcam_moments as tm\n"
        "b = np.ones((2, 4096), np.complex64); b[0] = 3\n"
        "before = tm.levinson(b)\n"
        "[each.join() for each in threading.enumerate() if each.name == 'transientcam-compile']\n"
        "shared = sum(e.name.startswith('transientcam-kernel') for e in threading.enumerate())\n"
        "after = tm.levinson(b)\n"
        "assert np.allclose(before.polynomial, after.polynomial, rtol=1e-6)\n"
        "print(tm.kernels.state()['compiled'], 'numba' in sys.modules, shared)\n"
    )
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env={**os.environ, "TRANSIENTCAM_KERNELS": setting, "NUMBA_CACHE_DIR": str(CACHE)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


def test_a_fresh_process_changes_over_by_itself_with_its_threads_running() -> None:
    kernels, loaded, shared = in_fresh_process("on").rsplit(" ", 2)
    assert (kernels, loaded) == ("['levinson m=1 float32']", "True")
    assert (int(shared) > 0) == (_spread.cores() > 1)


@pytest.mark.parametrize("setting", ["off", "manual"])
def test_where_it_is_not_wanted_nothing_is_compiled(setting: str) -> None:
    assert in_fresh_process(setting) == "[] False 0"


def test_orders_and_precisions_are_given_by_position(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Key] = []
    monkeypatch.setattr(KERNELS, "make_ready", asked.append)

    tm.kernels.compile([3, 4], ["float32"], names=["levinson", "likelihood", "pisarenko"])

    assert [key.name for key in asked].count("likelihood") == 1, "one serves both orders"
    assert {key.harmonics for key in asked if key.name != "likelihood"} == {3, 4}
    assert {key.precision for key in asked} == {"f"}


# -- threads ---------------------------------------------------------------------------------------


def everything(b: NDArray[np.complex64], threads: int | None) -> list[NDArray[np.float32]]:
    c = tm.levinson(b, threads=threads)
    density = tm.density(c, np.linspace(0, 6, 7), threads=threads)
    found = tm.pisarenko(b, threads=threads)
    return [c.error, c.polynomial, density, found.phase_rad, found.weight]


@pytest.mark.parametrize("threads", [None, 2, 5])
def test_no_digit_depends_on_the_number_of_threads(threads: int | None) -> None:
    b = moments(3, 5000)
    with kernels(3, precisions=("float32",), names=("levinson", "density", "pisarenko")):
        for alone, together in zip(everything(b, 1), everything(b, threads), strict=True):
            np.testing.assert_array_equal(alone, together)


@pytest.mark.parametrize(
    "call",
    [
        lambda threads: tm.levinson(moments(3, 64), threads=threads),
        lambda threads: tm.pisarenko(moments(3, 64), threads=threads),
        lambda threads: tm.density(tm.levinson(moments(3, 64)), [0.0], threads=threads),
        lambda threads: tm.reconstruct(moments(3, 64), threads=threads),
    ],
)
@pytest.mark.parametrize("threads", [0, -1, 1.5, True])
def test_less_than_one_thread_is_refused(call: Callable[[object], object], threads: object) -> None:
    with pytest.raises(tm.ParameterError, match="threads"):
        call(threads)


def test_a_worker_uses_no_other_thread_unless_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[object] = []

    def work() -> None:
        tm.kernels.use_one_thread()
        found.extend((on_threads(None), on_threads(3)))
        with tm.kernels.use_all_cores():
            monkeypatch.setattr(_spread, "cores", lambda: 3)
            found.append(on_threads(None))
        found.append(on_threads(None))

    worker = threading.Thread(target=work)
    worker.start()
    worker.join()

    one, three, all_cores, after = found
    assert one is after is tm.kernels.at_once
    assert three is not tm.kernels.at_once
    assert all_cores is not tm.kernels.at_once


def test_a_kernel_that_is_not_ready_is_made_ready_once_the_compiler_is_free(
    compiler: Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(KERNELS, "compiling", Key("levinson", 4, "f"))
    assert not tm.kernels.ready("likelihood", 4)
    assert compiler.finish() == []

    monkeypatch.setattr(KERNELS, "compiling", None)
    assert not tm.kernels.ready("likelihood", 4)
    assert not tm.kernels.ready("likelihood", 9), "no kernel of this order is offered"
    assert compiler.finish() == [Key("likelihood", 8, "f")]
