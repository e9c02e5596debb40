"""Compiled lanes of images: made ready in the background, and NumPy until then."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from transientcam_compiled import THREAD
from transientcam_simulation.compiled._lanes import (
    OF_IMAGES,
    WORTH_PIXELS,
    Lanes,
)
from transientcam_simulation.light import _compiled_tiles as compiled_tiles


def test_no_call_starts_the_compiler() -> None:
    with pytest.raises(TypeError):
        compiled_tiles.shown_tiles(np.ones((3, 3)), 1)  # type: ignore[arg-type]  # of double precision


def finished(lanes: Lanes, modules: tuple[str, ...] = OF_IMAGES) -> None:
    """Want lanes, and wait until their thread has ended."""
    lanes.want(modules)
    for thread in threading.enumerate():
        if thread.name == THREAD:
            thread.join()


def test_lanes_are_made_ready_once_in_the_background() -> None:
    lanes = Lanes({})
    assert lanes.find("coded") is None

    finished(lanes)

    assert lanes.find("coded") is not None
    ready = lanes._ready
    finished(lanes)
    assert lanes._ready is ready


def test_lanes_of_images_are_made_ready_once_numpy_has_computed_many(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lanes, made = Lanes({}), list[str]()
    monkeypatch.setattr(lanes.kernels, "make_ready", lambda name, **_: made.append(name))

    lanes.want_for_images(WORTH_PIXELS - 1)
    assert not made

    lanes.want_for_images(1)
    finished(lanes, OF_IMAGES)
    assert made == list(OF_IMAGES)

    # once
    lanes.want_for_images(1)
    finished(lanes)
    assert made == list(OF_IMAGES)


@pytest.mark.parametrize("setting", ["off", "0", "no", "false", "manual", " OFF "])
def test_a_setting_leaves_everything_to_numpy(setting: str) -> None:
    lanes = Lanes({"TRANSIENTCAM_KERNELS": setting})

    finished(lanes)

    assert lanes.find("coded") is None


def test_without_a_compiler_numpy_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*OF_IMAGES, "compiled._compiling"):
        monkeypatch.delitem(sys.modules, f"transientcam_simulation.{name}")
    monkeypatch.setitem(sys.modules, "numba", None)
    lanes = Lanes({})

    finished(lanes)

    assert lanes.find("coded") is None
    assert lanes.kernels.failed.keys() == set(OF_IMAGES)


def test_lanes_are_compiled_by_another_process_and_loaded_by_this_one(tmp_path: Path) -> None:
    code = (
        "import threading\n"
        "from transientcam_compiled import THREAD\n"
        "from transientcam_simulation.compiled._lanes import LANES, OF_IMAGES\n"
        "LANES.want(OF_IMAGES)\n"
        "[each.join() for each in threading.enumerate() if each.name == THREAD]\n"
        "stats = LANES.find('at_phase').stats\n"
        "print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))\n"
    )
    environ = {"NUMBA_CACHE_DIR": str(tmp_path), "TRANSIENTCAM_KERNELS": "on"}
    command = [sys.executable, "-W", "error", "-c", code]

    printed = subprocess.check_output(command, env=os.environ | environ, text=True)

    assert printed == "1 0\n"
