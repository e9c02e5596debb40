"""Compiled lanes against the statements in NumPy that they stand beside: the same bytes."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import Sequence
from transientcam_driver.simulation.build import find_scene, world_of
from transientcam_driver.simulation.light.coverage import covered, overlapped
from transientcam_driver.simulation.light.lanes import LANES, THREAD, Lanes
from transientcam_driver.simulation.light.shares import above
from transientcam_driver.simulation.scene.geometry import Rectangle
from transientcam_driver.simulation.scene.motion import Motion
from transientcam_driver.simulation.scene.scene import Scene, Surface

SIZE = 82, 60
CHOSEN = {
    "mirror-paths": "on",
    "motion": "on",
    **dict.fromkeys(("distortion", "gloss", "interreflection", "scattering"), "off"),
}
VIDEO = Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005)


@pytest.fixture(autouse=True, scope="module")
def compiled() -> Iterator[None]:
    LANES.compile_now()
    yield
    LANES._ready = {}


@contextmanager
def numpy_alone() -> Iterator[None]:
    ready, LANES._ready = LANES._ready, {}
    try:
        yield
    finally:
        LANES._ready = ready


def images(scene: Scene, times_s: tuple[float, ...]) -> list[bytes]:
    """Mean electrons, and images, one after the other."""
    world = world_of(scene, width=SIZE[0], height=SIZE[1], readout_s=3.98e-3)
    world.configure(VIDEO, VIDEO.labels)
    made: list[bytes] = []
    for k, time_s in enumerate(times_s):
        label = VIDEO.labels[k % len(VIDEO.labels)]
        made.append(world.mean_image_e(label, number=k, device_time_s=time_s).tobytes())
        made.append(world.image(label, number=k, device_time_s=time_s).tobytes())
    return made


def a_board_beside(scene: Scene) -> Scene:
    """The scene with a board that moves before all else, and close to the camera's edge."""
    board = Rectangle.facing(
        np.array([-0.2, 1.2, 0.1]), np.array([0.3, -1.0, 0.1]), size=(0.3, 0.35)
    )
    motion = Motion(np.array([[0.0, 0.0, 0.0], [0.5, 0.1, 0.0]]), 7.0, "back")
    return replace(
        scene,
        surfaces=(*scene.surfaces, Surface("board", "diffuse", board, 0.6, motions=(motion,))),
    )


@pytest.mark.parametrize(("board", "mixed"), [(False, "on"), (True, "on"), (True, "off")])
def test_images_are_the_same_with_and_without_lanes(board: bool, mixed: str) -> None:
    # all are chosen, so that no time is spent on judging them
    scene = replace(find_scene("visitor"), effects=CHOSEN | {"mixed-pixels": mixed})
    if board:
        scene = a_board_beside(scene)
    # no one there yet, walking in, a wave from image to image, and a path that starts again
    times_s = (0.0, 3.1, *(8.0 + 4.5e-3 * k for k in range(6)), 16.5, 23.99, 24.01)
    before = Lanes.find
    used: set[str] = set()

    def find(self: Lanes, name: str) -> object:
        lane = before(self, name)
        if lane is not None:
            used.add(name)
        return lane

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Lanes, "find", find)
        there = images(scene, times_s)
    with numpy_alone():
        expected = images(scene, times_s)

    assert there == expected
    assert used >= {"points", "received", "darkened", "blended", "overlapped", "layered"}
    if mixed == "on":
        assert used == set(LANES._ready)


def planes(shape: tuple[int, int]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Functions with silhouettes in all directions, extrema on pixels, and pixels without any."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    one = (3.0 - np.hypot(x - 4.2, y - 3.7) + np.sin(2 * x)).astype(np.float32)
    other = (0.3 * x - 0.7 * y + 1).astype(np.float32)
    one[(x + 2 * y) % 7 == 0] = np.nan
    other[(x - y) % 5 == 0] = 0
    return one, other


@pytest.mark.parametrize("shape", [(9, 11), (1, 11), (9, 1), (1, 1), (2, 2), (0, 5)])
def test_shares_and_overlaps_are_the_same_up_to_the_edge(shape: tuple[int, int]) -> None:
    for values in planes(shape):
        lane = above(values, soft=True)
        with numpy_alone():
            statement, _root = covered(values, rooted=False)
        assert lane.tobytes() == statement.tobytes()
    shares = [above(values, soft=True) for values in planes(shape)]
    both = overlapped(*shares)
    with numpy_alone():
        expected = overlapped(*shares)
    assert both.tobytes() == expected.tobytes()
    # parts of larger planes, as shadows overlap in
    part = overlapped(shares[0][::2, ::2], shares[1][::2, ::2])
    with numpy_alone():
        assert part.tobytes() == overlapped(shares[0][::2, ::2], shares[1][::2, ::2]).tobytes()


def test_no_call_starts_the_compiler() -> None:
    with pytest.raises(TypeError):
        LANES._ready["covered"](np.ones((3, 3)))  # of double precision


def finished(lanes: Lanes) -> None:
    """Want lanes, and wait until their thread has ended."""
    lanes.want()
    for thread in threading.enumerate():
        if thread.name == THREAD:
            thread.join()


def test_lanes_are_made_ready_once_in_the_background() -> None:
    lanes = Lanes({})
    assert lanes.find("seen") is None

    finished(lanes)

    assert lanes.find("seen") is LANES.find("seen")
    ready = lanes._ready
    finished(lanes)
    assert lanes._ready is ready


@pytest.mark.parametrize("setting", ["off", "0", "no", "false", "manual", " OFF "])
def test_a_setting_leaves_everything_to_numpy(setting: str) -> None:
    lanes = Lanes({"TRANSIENTCAM_KERNELS": setting})

    finished(lanes)

    assert lanes.find("seen") is None


def test_without_a_compiler_numpy_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("compiled_edges", "compiled_light", "compiling"):
        monkeypatch.delitem(sys.modules, f"transientcam_driver.simulation.light.{name}")
    monkeypatch.setitem(sys.modules, "numba", None)
    lanes = Lanes({})

    finished(lanes)

    assert lanes.find("seen") is None
    with pytest.raises(ImportError):
        lanes.compile_now()
