"""Compiled kernels of images: made ready in the background, and NumPy until then."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from transientcam_compiled import THREAD
from transientcam_simulation.compiled._image_kernels import OF_IMAGES, WORTH_PIXELS, ImageKernels
from transientcam_simulation.light import _compiled_tiles as compiled_tiles


def test_no_call_starts_the_compiler() -> None:
    with pytest.raises(TypeError):
        compiled_tiles.shown_tiles(np.ones((3, 3)), 1)  # type: ignore[arg-type]  # of double precision


def finished(kernels: ImageKernels, modules: tuple[str, ...] = OF_IMAGES) -> None:
    """Want kernels, and wait until their thread has ended."""
    kernels.want(modules)
    for thread in threading.enumerate():
        if thread.name == THREAD:
            thread.join()


def test_kernels_are_made_ready_once_in_the_background() -> None:
    kernels = ImageKernels({})
    assert kernels.find("coded") is None

    finished(kernels)

    assert kernels.find("coded") is not None
    ready = kernels._ready
    finished(kernels)
    assert kernels._ready is ready


def test_kernels_of_images_are_made_ready_once_numpy_has_computed_many(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kernels, made = ImageKernels({}), list[str]()
    monkeypatch.setattr(kernels.kernels, "make_ready", lambda name, **_: made.append(name))

    kernels.want_for_images(WORTH_PIXELS - 1)
    assert not made

    kernels.want_for_images(1)
    finished(kernels, OF_IMAGES)
    assert made == list(OF_IMAGES)

    # once
    kernels.want_for_images(1)
    finished(kernels)
    assert made == list(OF_IMAGES)


@pytest.mark.parametrize("setting", ["off", "0", "no", "false", "manual", " OFF "])
def test_a_setting_leaves_everything_to_numpy(setting: str) -> None:
    kernels = ImageKernels({"TRANSIENTCAM_KERNELS": setting})

    finished(kernels)

    assert kernels.find("coded") is None


def test_without_a_compiler_numpy_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*OF_IMAGES, "compiled._compiling"):
        monkeypatch.delitem(sys.modules, f"transientcam_simulation.{name}")
    monkeypatch.setitem(sys.modules, "numba", None)
    kernels = ImageKernels({})

    finished(kernels)

    assert kernels.find("coded") is None
    assert kernels.kernels.failed.keys() == set(OF_IMAGES)


def test_kernels_are_compiled_by_another_process_and_loaded_by_this_one(tmp_path: Path) -> None:
    code = (
        "import threading\n"
        "from transientcam_compiled import THREAD\n"
        "from transientcam_simulation.compiled._image_kernels import IMAGE_KERNELS, OF_IMAGES\n"
        "IMAGE_KERNELS.want(OF_IMAGES)\n"
        "[each.join() for each in threading.enumerate() if each.name == THREAD]\n"
        "stats = IMAGE_KERNELS.find('at_phase').stats\n"
        "print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))\n"
    )
    environ = {"NUMBA_CACHE_DIR": str(tmp_path), "TRANSIENTCAM_KERNELS": "on"}
    command = [sys.executable, "-W", "error", "-c", code]

    printed = subprocess.check_output(command, env=os.environ | environ, text=True)

    assert printed == "1 0\n"
