"""What a simulated frame costs: by scene, with nothing, with what is called for, with everything.

Frames are those of the paper's video setting (Sec. 6.3: m = 3, 0.5 ms, 12 images, 18.6 Hz). Times
are processor time on one core, the median of several frames.
"""

import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from benchmarks.common.tables import Cell, Column, Table, heads
from benchmarks.simulation.scenes import READOUT_S, SIZE, scene_named, world_before
from transientcam_driver import Sequence
from transientcam_simulation.compiled import IMAGE_KERNELS
from transientcam_simulation.effects import EFFECTS
from transientcam_simulation.imaging import World
from transientcam_simulation.scene import Scene

VIDEO = Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005)
BARRED = ("wall", "corner", "mirrors", "visitor")
SCENES = (*BARRED, "ball", "corner-left", "translucent", "calibration")
SIZES = (SIZE, (640, 480))
OPTIONAL = tuple(effect.name for effect in EFFECTS if effect.optional)
_ENOUGH_S = 1.5


@dataclass(frozen=True)
class Cost:
    """Processor time in s: to open a scene, and of a frame."""

    open_s: float
    frame_s: float


@dataclass(frozen=True)
class Scenes:
    """A scene's costs with no effect, those that are called for, and all of them."""

    scene: str
    size: tuple[int, int]
    none: Cost
    called: Cost
    everything: Cost
    built: tuple[str, ...]


def measure(scene: Scene, effects: Mapping[str, str], size: tuple[int, int]) -> Cost:
    """Build a world and make frames."""
    start_s = time.process_time()
    world = world_before(scene, effects, VIDEO, size)
    open_s = time.process_time() - start_s
    frame = _frames(world)
    frame()  # what is computed once
    times_s: list[float] = []
    while not times_s or (sum(times_s) < _ENOUGH_S and len(times_s) < 15):
        start_s = time.process_time()
        frame()
        times_s.append(time.process_time() - start_s)
    return Cost(open_s, statistics.median(times_s))


def _frames(world: World) -> Callable[[], None]:
    """Return what makes one frame after the other, in the device's time."""
    period_s, labels = VIDEO.exposure_s + READOUT_S, VIDEO.labels
    made = 0

    def frame() -> None:
        nonlocal made
        for label in labels:
            # a visitor is there from the fifth second on
            world.image(label, number=made, device_time_s=5.0 + made * period_s)
            made += 1

    return frame


def measure_scenes(names: tuple[str, ...], size: tuple[int, int]) -> list[Scenes]:
    """Measure each scene with nothing, with what it calls for, and with everything."""
    results = []
    for name in names:
        scene = scene_named(name)
        off, on = dict.fromkeys(OPTIONAL, "off"), dict.fromkeys(OPTIONAL, "on")
        explained = world_before(scene, {}, VIDEO, size).explain(name, VIDEO)
        built = tuple(each.effect for each in explained.effects if each.built)
        none, called = measure(scene, off, size), measure(scene, {}, size)
        results.append(Scenes(name, size, none, called, measure(scene, on, size), built))
    return results


def measure_effects(name: str, size: tuple[int, int]) -> list[tuple[str, float]]:
    """Return what each effect alone adds to a frame without any, measured beside it, in s."""
    scene = scene_named(name)
    off = dict.fromkeys(OPTIONAL, "off")

    def added_s(effect: str) -> float:
        bare_s = measure(scene, off, size).frame_s
        return measure(scene, off | {effect: "on"}, size).frame_s - bare_s

    return [(effect, added_s(effect)) for effect in OPTIONAL]


def tables(*, small: bool = False) -> Iterator[Table]:
    """Measure each scene and each effect alone; ``small``: only 163 x 120.

    Run it with OMP_NUM_THREADS=1: times are those of one core.
    """
    IMAGE_KERNELS.compile_now()  # rather than beside what is measured
    columns = heads(
        "scene | pixels | none, ms:.1f | called for, ms:.1f | everything, ms:.1f | "
        "everything / called for:.1f | frames/s, called for:.0f | opening, called for, s:.2f | "
        "what is called for"
    )
    rows = [
        _row(each)
        for size in SIZES[: 1 if small else None]
        for each in measure_scenes(SCENES if size == SIZES[0] else BARRED, size)
    ]
    yield Table("", columns, rows)
    effects = {name: dict(measure_effects(name, SIZES[0])) for name in ("mirrors", "visitor")}
    yield Table(
        "",
        ["effect", *[Column(f"on {name}, ms", ".1f") for name in effects]],
        [
            (effect, *(max(0.0, costs[effect]) * 1e3 for costs in effects.values()))
            for effect in OPTIONAL
        ],
        text=["What one effect adds to a frame without any, at 163 x 120:"],
    )


def _row(each: Scenes) -> tuple[Cell, ...]:
    width, height = each.size
    return (
        each.scene,
        f"{width} x {height}",
        *(1e3 * cost.frame_s for cost in (each.none, each.called, each.everything)),
        each.everything.frame_s / each.called.frame_s,
        1 / each.called.frame_s,
        each.called.open_s,
        ", ".join(each.built),
    )
