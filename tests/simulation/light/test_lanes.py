"""Compiled lanes against the statements in NumPy that they stand beside: the same bytes."""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_compiled import THREAD
from transientcam_driver import Sequence
from transientcam_simulation.compiled import LANES
from transientcam_simulation.compiled._lanes import (
    COMPILED,
    OF_IMAGES,
    WORTH_PIXELS,
    Lanes,
)
from transientcam_simulation.emulated import find_scene, world_of
from transientcam_simulation.light._coverage import covered, overlapped
from transientcam_simulation.light._hit_points import Ends
from transientcam_simulation.light._paths import image_lights
from transientcam_simulation.light._shares import Around, hide
from transientcam_simulation.scene import Ellipsoid, Motion, Rectangle, Scene, Surface

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
    LANES.kernels.compiled.clear()
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
    assert used >= {"points", "received", "remaining", "blended", "hide", "layered"}
    if mixed == "on":
        unused = set() if board else {"overlapped"}  # of shadows of rectangles that move
        assert used == set(LANES._ready) - unused


@pytest.mark.parametrize(
    ("count", "side"), [(1, 0), (63, 1), (64, 2), (65, 3), *((4000, side) for side in range(4))]
)
def test_light_on_points_is_the_same_whatever_is_beside_them(count: int, side: int) -> None:
    # few neighbours are far away: lanes that look only near hits must follow these on each side
    scene = find_scene("visitor").at(9.0)
    balls = {k: s.shape for k, s in enumerate(scene.surfaces) if isinstance(s.shape, Ellipsoid)}
    movers = tuple(balls)
    random = np.random.default_rng(count)
    index = np.sort(random.choice(movers, count)).astype(np.int32)
    away = random.normal(size=(count, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    away = away[np.lexsort((away[:, 2], index))]  # of each surface from below: hits are together
    centre, radii = (np.array([getattr(balls[k], of) for k in index]) for of in ("centre", "radii"))
    point = (centre + radii * away).astype(np.float32)
    distance_m = np.linalg.norm(point, axis=1).astype(np.float32)
    beside = np.clip(np.arange(count) + random.integers(-3, 4, (4, count)), 0, count)
    far = np.flatnonzero(random.random(count) < 0.02)
    beside[side, far] = random.integers(0, count + 1, len(far))
    x, y, z = np.ascontiguousarray(point.T)
    ends = Ends(
        scene,
        scene.surfaces,
        index,
        (x, y, z),
        distance_m,
        (x / distance_m, y / distance_m, z / distance_m),
        random.choice([1.0, 0.95], count),
        np.array([each.shape.box for each in scene.surfaces]),
    )
    lights = tuple(image_lights(scene))

    around = Around(beside.astype(np.int32))
    lit = ends.lit(lights, movers=movers, around=around).all()
    with numpy_alone():
        expected = ends.lit(lights, movers=movers, around=around).all()

    assert lit.weight.tobytes() == expected.weight.tobytes()
    assert lit.delay_s.tobytes() == expected.delay_s.tobytes()
    assert lit.reflectance.tobytes() == expected.reflectance.tobytes()
    assert count < 4000 or (expected.weight > 0).any(axis=1).sum() > 1


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
    shares = [covered(values, rooted=False)[0] for values in planes(shape)]
    both = overlapped(*shares)
    with numpy_alone():
        expected = overlapped(*shares)
    assert both.tobytes() == expected.tobytes()
    # parts of larger planes, as shadows overlap in
    part = overlapped(shares[0][::2, ::2], shares[1][::2, ::2])
    with numpy_alone():
        assert part.tobytes() == overlapped(shares[0][::2, ::2], shares[1][::2, ::2]).tobytes()


@pytest.mark.parametrize("shape", [(9, 11), (1, 11), (9, 1), (1, 1), (2, 2), (0, 5)])
def test_what_shapes_hide_of_each_other_is_the_same_up_to_the_edge(shape: tuple[int, int]) -> None:
    one, other = (covered(values, rooted=False)[0] for values in planes(shape))
    at, its_at = planes(shape)[::-1]

    def left() -> tuple[bytes, bytes]:
        first, second = one.copy(), other.copy()
        hide((one, at, first), (other, its_at, second), soft=True)
        return first.tobytes(), second.tobytes()

    by_lane = left()
    with numpy_alone():
        assert by_lane == left()
    assert shape != (9, 11) or by_lane != (one.tobytes(), other.tobytes())


def test_no_call_starts_the_compiler() -> None:
    with pytest.raises(TypeError):
        LANES._ready["shown_tiles"](np.ones((3, 3)), 1)  # of double precision


def finished(lanes: Lanes, modules: tuple[str, ...] = COMPILED) -> None:
    """Want lanes, and wait until their thread has ended."""
    lanes.want(modules)
    for thread in threading.enumerate():
        if thread.name == THREAD:
            thread.join()


def test_lanes_are_made_ready_once_in_the_background() -> None:
    lanes = Lanes({})
    assert lanes.find("seen") is None

    finished(lanes)

    assert lanes.find("seen") is LANES.find("seen") is not None
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

    # a scene that moves wants the others, too, and none twice
    finished(lanes)
    lanes.want_for_images(1)
    finished(lanes, OF_IMAGES)
    assert made == list(COMPILED)


@pytest.mark.parametrize("setting", ["off", "0", "no", "false", "manual", " OFF "])
def test_a_setting_leaves_everything_to_numpy(setting: str) -> None:
    lanes = Lanes({"TRANSIENTCAM_KERNELS": setting})

    finished(lanes)

    assert lanes.find("seen") is None


def test_without_a_compiler_numpy_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*COMPILED, "compiled._compiling"):
        monkeypatch.delitem(sys.modules, f"transientcam_simulation.{name}")
    monkeypatch.setitem(sys.modules, "numba", None)
    lanes = Lanes({})

    finished(lanes)

    assert lanes.find("seen") is None
    assert lanes.kernels.failed.keys() == set(COMPILED)


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
