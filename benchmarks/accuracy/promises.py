"""Plans held to what they promise: predicted against measured noise, bias and error.

Every scene is looked at once; every goal is planned, and what is recommended is captured by another
specimen of noise and compared with the truth of the simulation. ::

    python -m benchmarks.accuracy.promises --write      # 30 captures a plan, to docs/plans.md
    python -m benchmarks.accuracy.promises --quick      # 10, and two goals

Scenes are the built-in ones, those of this folder, and those of an audit where
TRANSIENTCAM_TEST_DATA has them in scenes/.
"""

import argparse
import json
import os
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.accuracy.kept import Kept, Refused, expectations, page, table
from transientcam_driver import Camera, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera import sensor_of
from transientcam_server.errors import Problem
from transientcam_server.imaging import Recipe, ranges_m
from transientcam_server.imaging._errors_of_range.noise import moment_noise
from transientcam_server.planning import Goal, Planner, SceneStatistics
from transientcam_server.planning._prediction.measures import pixel_errors
from transientcam_server.planning._search.choice import Choice
from transientcam_server.settings import ReconstructionSettings, SensorSettings

ROOT = Path(__file__).parents[2]
OWN = Path(__file__).parent / "scenes"
BUILT_IN = ("wall", "corner", "corner-left", "mirrors", "translucent")
BEGINS_S: Final = 5.0
LOOK_SEED, CAPTURE_SEED = 7, 11
PIXELS: Final = 2000
_NO_LIGHT: Final = 1e-12
SETTINGS = ReconstructionSettings()
GOALS: Final = {
    "20 mm": Goal(range_error_m=0.020),
    "5 mm": Goal(range_error_m=0.005),
    "2 mm": Goal(range_error_m=0.002),
    "15 Hz": Goal(frame_rate_hz=15.0),
    "0.2 s": Goal(capture_s=0.2),
}
_Array = NDArray[Any]


def scenes() -> Iterator[str]:
    """Yield all scenes there are: built in, of the tests' data, and of this folder."""
    yield from BUILT_IN
    data = Path(os.environ.get("TRANSIENTCAM_TEST_DATA", ROOT.parent / "shared" / "data"))
    yield from sorted(str(path) for path in (data / "scenes").glob("*.toml"))
    yield from sorted(str(path) for path in OWN.glob("*.toml"))


def opened(scene: str, seed: int) -> Camera:
    """Open a simulated camera some seconds after power-up."""
    clock = VirtualClock()
    camera = open_camera(f"sim:{scene}?seed={seed}", clock=clock)
    clock.sleep(BEGINS_S)
    return camera


def looked(scene: str) -> tuple[Planner, SceneStatistics]:
    """Look at a scene."""
    with opened(scene, LOOK_SEED) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        return planner, planner.look(camera, Sequence())


def dimmest_dn_per_s(statistics: SceneStatistics) -> float:
    """Return how much light the dimmest pixel has that a plan is for: the others are not lit."""
    return float(statistics.brightness_dn_per_s.min())


def measured(
    scene: str, sequence: Sequence, estimator: str, captures: int, dimmest: float = 0.0
) -> tuple[dict[str, float], float, float]:
    """Capture, and return noise, bias, error and outliers, the device's time, and saturation.

    Each range is held against the truth in the middle of its own capture: scenes may move. Pixels
    with less light than the dimmest are left out, in DN for each second of exposure.
    """
    with opened(scene, CAPTURE_SEED) as camera:
        return measured_by(camera, sequence, estimator, captures, dimmest)


def measured_by(
    camera: Camera, sequence: Sequence, estimator: str, captures: int, dimmest: float = 0.0
) -> tuple[dict[str, float], float, float]:
    """Do the same with a simulated camera that is open."""
    assert camera.simulation is not None
    applied = camera.configure(sequence)
    sensor = sensor_of(camera, SensorSettings())
    recipe = Recipe(applied, SETTINGS, float(sensor.highest_dn), sensor=sensor)
    camera.start()
    pixels, errors_m, device_s, full = None, [], 0.0, 0.0
    for _ in range(captures):
        raw = camera.read_frame(timeout_s=1e3)
        device_s = raw.capture_s
        truth = camera.simulation.truth(device_time_s=raw.device_time_s + device_s / 2)
        if pixels is None:
            least = max(dimmest * applied.sequence.exposure_s, _NO_LIGHT)
            lit = np.flatnonzero(np.isfinite(truth.range_m) & (truth.brightness >= least))
            random = np.random.default_rng(1)
            pixels = np.sort(random.choice(lit, min(PIXELS, lit.size), replace=False))
            full = float((raw.images.max(axis=0).ravel()[lit] >= sensor.highest_dn).mean())
        found = recipe.reconstruct(raw)
        b = tm.smooth(np.asarray(found.measured), SETTINGS.smoothing_px)
        variance = np.asarray(moment_noise(recipe, found).variance)
        part, noise = (each.reshape((len(each), -1))[:, pixels] for each in (b, variance))
        found_m = ranges_m(part, noise, estimator, recipe.base_frequency_hz, SETTINGS)
        errors_m.append(found_m - truth.range_m.ravel()[pixels])
    camera.stop()
    errors = pixel_errors(np.stack(errors_m), np.zeros_like(errors_m[0]))
    values = {
        "std": float(np.median(errors.std_m)),
        "bias": float(np.median(errors.bias_m)),
        "error": float(np.median(errors.error_m)),
        "outliers": errors.outlier_share,
    }
    return values, device_s, full


def kept(scene: str, goals: dict[str, Goal], captures: int) -> Iterator[Kept | Refused]:
    """Plan all goals on a scene, and measure what is recommended."""
    name = Path(scene).stem
    try:
        planner, statistics = looked(scene)
    except Problem as problem:
        yield Refused(name, "look", problem.detail)
        return
    for wanted, goal in goals.items():
        begin_s = time.process_time()
        try:
            best = planner.plan(goal, statistics).recommended
        except Problem as problem:
            yield Refused(name, wanted, problem.detail)
            continue
        planned_in_s = time.process_time() - begin_s
        values, device_s, full = measured(
            scene, best.applied.sequence, best.estimator, captures, dimmest_dn_per_s(statistics)
        )
        yield Kept(
            name,
            wanted,
            goal.range_error_m,
            best.in_words(),
            best.applied.capture_s,
            device_s,
            _predicted(best),
            (best.predicted.range_error.low, best.predicted.range_error.high),
            values,
            full,
            planned_in_s,
            best.predicted.bias_known,
        )


def _predicted(choice: Choice) -> dict[str, float]:
    predicted = choice.predicted
    return {
        "std": predicted.range_std.median,
        "bias": predicted.range_bias_m,
        "error": predicted.range_error.median,
        "outliers": predicted.outlier_share,
    }


def all_kept(
    names: Iterable[str], goals: dict[str, Goal], captures: int, *, processes: int
) -> tuple[list[Kept], list[Refused]]:
    """Measure scenes, several at once, and print each plan as soon as its scene is done."""
    rows: list[Kept] = []
    refused: list[Refused] = []
    of_scene = partial(_listed, goals=goals, captures=captures)
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for found in pool.map(of_scene, names):
            for each in found:
                if isinstance(each, Kept):
                    rows.append(each)
                    print(table([each]).splitlines()[-1], f"{each.planned_in_s:.1f} s", flush=True)
                else:
                    refused.append(each)
                    print(f"{each.scene}, {each.goal}: {each.why}", flush=True)
    return rows, refused


def _listed(scene: str, goals: dict[str, Goal], captures: int) -> list[Kept | Refused]:
    return list(kept(scene, goals, captures))


def main() -> None:
    """Measure all scenes, or those named; print the tables, or write them."""
    from benchmarks.accuracy import audited, evidence

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help="names or .toml; all there are by default")
    parser.add_argument("--quick", action="store_true", help="10 captures of two goals")
    parser.add_argument("--captures", type=int, help="of each plan")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--json", type=Path, help="write all numbers here")
    parser.add_argument("--write", action="store_true", help="write to docs/plans.md")
    arguments = parser.parse_args()
    goals = {name: GOALS[name] for name in ("5 mm", "0.2 s")} if arguments.quick else GOALS
    rows, refused = all_kept(
        arguments.scenes or list(scenes()),
        goals,
        arguments.captures or (10 if arguments.quick else 30),
        processes=arguments.processes,
    )
    print(page(rows, refused), audited.table(rows, refused), sep="\n\n")
    if arguments.write:
        quick = " --quick" if arguments.quick else ""
        command = f"python -m benchmarks.accuracy.promises{quick} --write"
        evidence.write("expectations", expectations(rows), command)
        evidence.write("promises", page(rows, refused), command)
        evidence.write("audit", audited.table(rows, refused), command)
    if arguments.json:
        arguments.json.write_text(json.dumps([*map(asdict, rows), *map(asdict, refused)]))


if __name__ == "__main__":
    main()
