"""A process that compiles: what it leaves, how it fails, and that it ends with its parent."""

import logging
import os
import select
import subprocess
import sys
from pathlib import Path

import pytest

from transientcam_moments._lanes.helper import Helper, program
from transientcam_moments._lanes.registry import REGISTRY, Key

LANE = Key("smallest_eigenvalue", 1, "f")
FAILING = (sys.executable, "-c", "raise SystemExit(3)")
IDLE = (sys.executable, "-c", "import signal; signal.pause()")


def python(code: str, cache: Path, *, setting: str = "on") -> "subprocess.Popen[str]":
    environ = {"NUMBA_CACHE_DIR": str(cache), "TRANSIENTCAM_KERNELS": setting}
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", code],
        env=os.environ | environ,
        stdout=subprocess.PIPE,
        text=True,
    )


def printed(code: str, cache: Path, *, setting: str = "on") -> str:
    with python(code, cache, setting=setting) as process:
        out, _ = process.communicate(timeout=600)
    assert process.returncode == 0
    return out.strip()


def test_a_lane_is_compiled_by_another_process_and_loaded_by_this_one(tmp_path: Path) -> None:
    code = (
        "import numpy as np, transientcam_moments as tm\n"
        "tm.smallest_eigenvalue(np.ones((2, 4096), np.complex64))\n"
        "import threading\n"
        "[each.join() for each in threading.enumerate() if each.name == tm.kernels.THREAD]\n"
        "from transientcam_moments._kernels.eigenvalue import smallest_eigenvalue as kernel\n"
        "print(tm.kernels.state()['compiled'], sum(kernel.stats.cache_hits.values()))\n"
    )

    assert printed(code, tmp_path) == f"['{LANE}'] 1", "the cache of a new directory was not filled"


def test_what_is_not_kept_is_not_compiled_by_loading(tmp_path: Path) -> None:
    code = (
        "from transientcam_moments._kernels.compiler import compile_lane, load_lane\n"
        "from transientcam_moments._lanes.registry import Key\n"
        f"key = Key(*{tuple(LANE)})\n"
        "print(load_lane(key), compile_lane(key) is None, load_lane(key) is None)\n"
    )

    assert printed(code, tmp_path, setting="manual") == "None False False"


@pytest.mark.parametrize("command", [FAILING, ("/nowhere/python",)])
def test_a_process_that_fails_is_reported_once_and_lanes_are_compiled_here(
    command: tuple[str, ...], caplog: pytest.LogCaptureFixture
) -> None:
    with Helper(command) as helper, caplog.at_level(logging.WARNING, "transientcam_moments"):
        tried = [helper.compile(*LANE), helper.compile("levinson", 3, "f")]

    assert tried == [True, True], "the caller goes on, and compiles by itself"
    assert len(caplog.records) == 1
    assert "they are compiled on a thread" in caplog.text


def test_a_process_that_is_killed_meanwhile_is_reported(caplog: pytest.LogCaptureFixture) -> None:
    killing_itself = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    with Helper((sys.executable, "-c", killing_itself)) as helper:
        assert helper.compile(*LANE)

    assert len(caplog.records) == 1


def test_without_a_process_nothing_is_started() -> None:
    with Helper(None) as helper:
        assert helper.compile(*LANE)


@pytest.mark.parametrize("executable", ["", "/opt/matlab/bin/matlab", None])
def test_a_program_that_embeds_python_is_not_started_again(
    executable: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", executable)

    assert program() is None


def test_a_packed_program_is_not_started_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "frozen", True, raising=False)

    assert program() is None


def test_where_nothing_is_kept_no_process_compiles(monkeypatch: pytest.MonkeyPatch) -> None:
    from transientcam_moments._kernels import compiler

    monkeypatch.setattr(compiler, "is_kept", lambda: False)
    monkeypatch.setitem(compiler.LANES, LANE.name, lambda m, precision: max)
    with Helper(("/nowhere/python",)) as helper:
        monkeypatch.setattr(helper, "compile", None)  # a call would raise

        assert REGISTRY.make(LANE, helper) is max


def test_a_program_that_ends_does_not_wait_for_what_is_compiled(tmp_path: Path) -> None:
    code = (
        "import transientcam_moments as tm\n"
        f"tm.kernels.program = lambda: {IDLE}\n"
        "tm.kernels.compile_in_background([1], ['float32'])\n"
        "print('the end')\n"
    )

    assert printed(code, tmp_path) == "the end"


def test_the_process_ends_with_one_that_is_killed(tmp_path: Path) -> None:
    code = (
        "import threading\n"
        "from transientcam_moments._lanes.helper import Helper, program\n"
        "helper = Helper(program())\n"
        "threading.Thread(target=helper.compile, args=('levinson', 8, 'f')).start()\n"
        "while helper._process is None: threading.Event().wait(0.01)\n"
        "print(helper._process.pid, flush=True)\n"
        "threading.Event().wait()\n"
    )
    parent = python(code, tmp_path)
    assert parent.stdout is not None
    child = os.pidfd_open(int(parent.stdout.readline()))
    try:
        parent.kill()
        parent.communicate()

        ended, _, _ = select.select([child], [], [], 600)
        assert ended, "it goes on compiling without a parent"
    finally:
        os.close(child)


def test_kernels_that_are_off_start_no_process(tmp_path: Path) -> None:
    code = (
        "import sys, transientcam_moments as tm\n"
        "tm.kernels.program = lambda: (sys.executable, '-c', 'raise SystemExit')\n"
        "tm.kernels.compile_in_background([1], ['float32']).join()\n"
        "print(tm.kernels.state()['enabled'])\n"
    )

    assert printed(code, tmp_path, setting="off") == "False"
    assert list(tmp_path.iterdir()) == []
