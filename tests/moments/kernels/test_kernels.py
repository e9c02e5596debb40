"""When kernels are there and when they aren't; nothing may wait for a compiler."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import compiled_kernels
from tests.moments.compiled_kernels import find, kernels, without_kernels
from transientcam_compiled import Kernels
from transientcam_moments._dispatch import CACHE, KERNELS, LEAST_PIXELS, Key, accelerated


@pytest.fixture(autouse=True)
def nothing_compiled() -> Iterator[None]:
    with without_kernels():
        yield


def in_fresh_process(code: str, **environ: str) -> str:
    """Run code with the environment changed, and return what it prints; its warnings are errors."""
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env={**os.environ, **environ},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


def test_importing_the_package_imports_no_compiler() -> None:
    code = "import sys, transientcam_moments; print('numba' in sys.modules)"

    assert in_fresh_process(code) == "False"


def test_using_the_package_imports_no_compiler() -> None:
    code = (
        "import sys, numpy as np, transientcam_moments as tm\n"
        "b = np.ones((4, 100), np.complex64); b[0] = 3\n"
        "tm.density(tm.levinson(b), [0.0]); tm.pisarenko(b); tm.kernels.state()\n"
        "print('numba' in sys.modules)"
    )

    assert in_fresh_process(code) == "False"


def test_kernels_can_be_turned_off() -> None:
    code = (
        "import sys, transientcam_moments as tm\n"
        "tm.kernels.compile(harmonics=[3]); tm.kernels.prepare(['levinson'], 3)\n"
        "state = tm.kernels.state()\n"
        "print(state['enabled'], state['compiled'], 'numba' in sys.modules)"
    )

    assert in_fresh_process(code, TRANSIENTCAM_KERNELS="off") == "False [] False"


@pytest.mark.parametrize("setting", ["off", "OFF", " 0 ", "no", "false"])
def test_several_words_turn_kernels_off(setting: str) -> None:
    assert not Kernels[Key]({"TRANSIENTCAM_KERNELS": setting}, CACHE).enabled


@pytest.mark.parametrize("environ", [{}, {"TRANSIENTCAM_KERNELS": "on"}])
def test_kernels_are_on_otherwise(environ: dict[str, str]) -> None:
    assert Kernels[Key](environ, CACHE).enabled


def test_a_kernel_is_compiled_where_nothing_can_be_written() -> None:
    code = (
        "import transientcam_moments as tm\n"
        "from transientcam_moments._kernels.compiler import compile_kernel\n"
        "from transientcam_moments._dispatch import Key\n"
        "import numpy as np\n"
        "kernel = compile_kernel(Key('smallest_eigenvalue', 1, 'f'))\n"
        "print(kernel(np.full((2, 64), 3 + 0j, np.complex64))[0])"
    )
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null", "NUMBA_CACHE_DIR": ""}

    assert float(in_fresh_process(code, **nowhere)) == pytest.approx(0, abs=1e-5)


def test_the_second_process_loads_what_the_first_compiled(tmp_path: Path) -> None:
    code = (
        "from transientcam_moments._kernels.eigenvalue import smallest_eigenvalue as kernel\n"
        "from transientcam_moments._kernels.compiler import compile_kernel\n"
        "from transientcam_moments._dispatch import Key\n"
        "compile_kernel(Key('smallest_eigenvalue', 1, 'f'))\n"
        "print(sum(kernel.stats.cache_hits.values()), sum(kernel.stats.cache_misses.values()))"
    )
    environ = {"NUMBA_CACHE_DIR": str(tmp_path)}

    assert in_fresh_process(code, **environ) == "0 1"
    assert in_fresh_process(code, **environ) == "1 0"


def test_progress_names_every_kernel_and_ends_at_the_total() -> None:
    seen: list[tuple[int, int, str]] = []
    with kernels(3, precisions=("float32",)):
        tm.kernels.compile(
            harmonics=[3],
            precisions=["float32"],
            names=compiled_kernels.FEW,
            progress=lambda *step: seen.append(step),
        )

        names = [str(Key(name, 3, "f")) for name in compiled_kernels.FEW]
        assert seen == [(i, len(names), name) for i, name in enumerate([*names, ""])]
        assert set(tm.kernels.state()["compiled"]) == set(names)


def test_compiling_in_the_background_ends_with_the_kernels_in_use(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(KERNELS, "automatic", True)
    with kernels():  # the cache of the tests
        thread = tm.kernels.prepare(["levinson"], 3)
        assert thread is not None
        assert thread.name == "transientcam-compile"
        thread.join()

        assert find("levinson", np.ones((4, 64), np.complex64)) is not None
        state = tm.kernels.state()
        assert (state["compiling"], state["failed"]) == (None, [])


def test_a_kernel_that_cannot_be_compiled_leaves_numpy_and_the_other_kernels(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from transientcam_moments._kernels import compiler

    def broken(m: int, precision: str) -> None:
        raise RuntimeError("no such processor\nand a long story")

    monkeypatch.setattr(KERNELS, "failed", {})
    with kernels():
        monkeypatch.setitem(compiler.COMPILERS, "levinson", broken)
        tm.kernels.compile(
            harmonics=[3], precisions=["float32"], names=["levinson", "smallest_eigenvalue"]
        )

        state = tm.kernels.state()
        assert state["failed"] == ["levinson m=3 float32: RuntimeError: no such processor"]
        assert state["compiled"] == ["smallest_eigenvalue m=3 float32"]
        assert tm.levinson(np.ones((4, 64), np.complex64)).error.shape == (64,)


def test_background_compiling_stops_when_the_program_ends() -> None:
    code = (
        "import transientcam_moments as tm\n"
        "from transientcam_moments._kernels import compiler\n"
        "import threading, time\n"
        "slow = lambda m, precision: print(m, flush=True) or time.sleep(0.2)\n"
        "compiler.COMPILERS.update(dict.fromkeys(compiler.COMPILERS, slow))\n"
        "tm.kernels.prepare(list(tm.kernels.LANES), 3)\n"
    )

    lines = in_fresh_process(code, TRANSIENTCAM_KERNELS="on").splitlines()

    assert len(lines) <= 2, "it went on after the main thread had ended"


def test_several_threads_compile_each_kernel_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from transientcam_moments._kernels import compiler

    made: list[tuple[str, int, str]] = []
    for name in compiler.COMPILERS:

        def make(m: int, precision: str, name: str = name) -> object:
            made.append((name, m, precision))
            return lambda: None

        monkeypatch.setitem(compiler.COMPILERS, name, make)

    names = tuple(compiler.COMPILERS)
    threads = [
        threading.Thread(target=tm.kernels.compile, args=([3, 5],), kwargs={"names": names})
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    assert len(made) == len(set(made))
    expected = {(name, m) for name in names for m in (3, 5)}
    expected = expected - {("likelihood", 3), ("likelihood", 5)} | {("likelihood", 8)}
    assert {(name, m) for name, m, _ in made} == expected


@pytest.mark.parametrize(
    ("arguments", "field"),
    [({"harmonics": [0]}, "harmonics"), ({"harmonics": [33]}, "harmonics"),
     ({"precisions": ["float16"]}, "precisions")],
)  # fmt: skip
def test_orders_and_precisions_out_of_range_are_refused(
    arguments: dict[str, list[int]], field: str
) -> None:
    with pytest.raises(tm.ParameterError) as caught:
        tm.kernels.compile(**arguments)  # type: ignore[arg-type]  # what is refused

    assert caught.value.field == field


@pytest.mark.parametrize("function", [tm.kernels.prepare, tm.kernels.settled])
def test_what_there_is_no_kernel_of_is_refused(function: Callable[..., object]) -> None:
    with pytest.raises(tm.ParameterError, match="names"):
        function(["range"], 3)
    with pytest.raises(tm.ParameterError, match="harmonics"):
        function(["levinson"], 33)


def test_every_public_kernel_has_its_compiler() -> None:
    from transientcam_moments._kernels import compiler

    assert set(compiler.COMPILERS) == set(tm.kernels.LANES)


def test_kernels_are_found_by_name_order_and_precision() -> None:
    KERNELS.compiled[Key("levinson", 3, "f")] = found = lambda b: b

    assert find("levinson", np.ones((4, 64), np.complex64)) is found
    assert find("levinson", np.ones((4, 8, 8), np.complex64)) is found
    assert find("levinson", np.ones((4, 64), np.complex128)) is None
    assert find("levinson", np.ones((5, 64), np.complex64)) is None
    assert find("density", np.ones((4, 64), np.complex64)) is None


@pytest.mark.parametrize(
    "planes",
    [
        np.ones((4, LEAST_PIXELS - 1), np.complex64),
        np.ones((4, 0), np.complex64),
        np.ones((4, 64), np.int32),
        np.ones((), np.complex64),
        [[1.0] * 64] * 4,
        None,
    ],
)
def test_what_no_kernel_takes_is_left_to_numpy(planes: object) -> None:
    KERNELS.compiled[Key("levinson", 3, "f")] = lambda b: "of the kernel"

    @accelerated("levinson")
    def planar(planes: object) -> str:
        return "of NumPy"

    assert planar(np.ones((4, LEAST_PIXELS), np.complex64)) == "of the kernel"
    assert planar(planes) == "of NumPy"


def test_a_kernel_is_ready_once_it_is_compiled() -> None:
    assert not tm.kernels.ready("likelihood", 4)
    KERNELS.compiled[Key("likelihood", 8, "f")] = lambda b: b
    assert tm.kernels.ready("likelihood", 4), "one kernel serves all orders up to 8"
    assert not tm.kernels.ready("likelihood", 9)


@pytest.mark.parametrize(
    ("name", "harmonics"), [("likelihood", 33), ("likelihood", 0), ("range", 3)]
)
def test_what_no_kernel_is_offered_for_is_never_asked_for(name: str, harmonics: int) -> None:
    with pytest.raises(tm.ParameterError):
        tm.kernels.ready(name, harmonics)
