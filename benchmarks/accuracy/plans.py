"""Plans: predicted against measured."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.capturing import SEED, SETTINGS, captured, known_scenes
from transientcam_driver import Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.tradeoff.capture import repeatability
from transientcam_experiments.tradeoff.measuring import spec_of
from transientcam_server.camera.source import sensor_of
from transientcam_server.planning import Goal, Planner, Predictor
from transientcam_server.planning.plan import plan
from transientcam_server.settings import SensorSettings


@dataclass(frozen=True)
class Planned:
    """A plan, and what its sequence was then measured to do."""

    scene: str
    wanted: str
    sequence: Sequence
    capture_s: float
    predicted_m: float
    low_m: float
    high_m: float
    measured_m: float


_PINNED = frozenset({"base_frequency_hz"})
GOALS = {
    "to 20 mm": Goal(range_std_m=0.020, fixed=_PINNED),
    "to 5 mm": Goal(range_std_m=0.005, fixed=_PINNED),
    "at 15 Hz": Goal(frame_rate_hz=15.0, fixed=_PINNED),
    "in 0.2 s": Goal(capture_s=0.2, fixed=_PINNED),
}


def planned(scene: str) -> Iterator[Planned]:
    """Plan on a scene, capture with what was recommended, and compare."""
    if scene not in known_scenes():
        return
    with open_camera(spec_of(scene, seed=SEED + 1), clock=VirtualClock()) as camera:
        sensor = sensor_of(camera, SensorSettings())
        planner = Planner(camera.capabilities, sensor, SETTINGS)
        recipe, (look,) = captured(camera, Sequence(harmonics=6, takes=16, exposure_s=0.0015), 1)
        predictor = Predictor(planner.scene_statistics(recipe, look, 0.0), sensor, SETTINGS)
        for wanted, goal in GOALS.items():
            best = plan(
                goal, predictor, camera.capabilities, reconstruct_s=lambda _: 1e-3
            ).recommended
            _, found = captured(camera, best.applied.sequence, 8)
            measured_m = repeatability(np.stack([np.asarray(each.range_m) for each in found]))
            assert measured_m is not None
            low_m, high_m = best.range_std_interval()
            yield Planned(
                scene,
                wanted,
                best.applied.sequence,
                best.applied.capture_s,
                best.range_std.median_m,
                low_m,
                high_m,
                measured_m,
            )
