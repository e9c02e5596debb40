"""Compiled lanes of images: made ready in the background, and NumPy until then."""

import sys
import threading

import numpy as np
import pytest

from transientcam_driver.simulation.light import compiled_tiles
from transientcam_driver.simulation.light.lanes import (
    OF_IMAGES,
    THREAD,
    WORTH_PIXELS,
    Lanes,
)


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
    lanes, made = Lanes({}), list[tuple[str, ...]]()
    monkeypatch.setattr(lanes, "compile_now", made.append)

    lanes.want_for_images(WORTH_PIXELS - 1)
    assert not made

    lanes.want_for_images(1)
    finished(lanes, OF_IMAGES)
    assert made == [OF_IMAGES]

    # once
    lanes.want_for_images(1)
    finished(lanes)
    assert made == [OF_IMAGES]


@pytest.mark.parametrize("setting", ["off", "0", "no", "false", "manual", " OFF "])
def test_a_setting_leaves_everything_to_numpy(setting: str) -> None:
    lanes = Lanes({"TRANSIENTCAM_KERNELS": setting})

    finished(lanes)

    assert lanes.find("coded") is None


def test_without_a_compiler_numpy_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*OF_IMAGES, "light.compiling"):
        monkeypatch.delitem(sys.modules, f"transientcam_driver.simulation.{name}")
    monkeypatch.setitem(sys.modules, "numba", None)
    lanes = Lanes({})

    finished(lanes)

    assert lanes.find("coded") is None
    with pytest.raises(ImportError):
        lanes.compile_now()
