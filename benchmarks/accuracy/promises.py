"""Plans held to what they promise: predicted against measured noise, bias and error.

Every scene is looked at once; every goal is planned, and what is recommended is captured by another
sample of noise and compared with the truth of the simulation.
"""

import os
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Final

from benchmarks.accuracy.capturing import OUTLIER_ERRORS, dimmest_dn_per_s, looked, measured
from benchmarks.accuracy.kept import PlanOutcome, Refused, expectations, table
from benchmarks.accuracy.prices import SCENES as BUILT_IN
from benchmarks.common.measured_scenes import data_folder
from benchmarks.common.tables import Table
from transientcam_server.errors import Problem
from transientcam_server.planning import Goal
from transientcam_server.planning._search.choice import Choice

OWN = Path(__file__).parent / "scenes"
GOALS: Final = {
    "20 mm": Goal(range_error_m=0.020, share=None),
    "5 mm": Goal(range_error_m=0.005, share=None),
    "2 mm": Goal(range_error_m=0.002, share=None),
    "15 Hz": Goal(frame_rate_hz=15.0, share=None),
    "0.2 s": Goal(capture_s=0.2, share=None),
}


def all_scenes() -> list[str]:
    """Return all scenes there are: built in, of the tests' data, and of this folder."""
    folders = [(data_folder() or OWN) / "scenes", OWN]
    return [*BUILT_IN, *(str(path) for each in folders for path in sorted(each.glob("*.toml")))]


def tables(
    *,
    scenes: tuple[str, ...] = (),
    quick: bool = False,
    captures: int = 30,
    processes: int = os.cpu_count() or 1,
) -> Iterator[Table]:
    """Plan and capture on all scenes, or those named; ``quick``: two goals."""
    goals = {name: GOALS[name] for name in ("5 mm", "0.2 s")} if quick else GOALS
    rows, refused = all_kept(scenes or all_scenes(), goals, captures, processes=processes)
    yield Table("What to expect", text=expectations(rows))
    yield table(rows, refused)


def kept(scene: str, goals: dict[str, Goal], captures: int) -> Iterator[PlanOutcome | Refused]:
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
        yield PlanOutcome(
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
        "outliers": 1 - predicted.share_within(OUTLIER_ERRORS * predicted.range_error.median),
    }


def all_kept(
    names: Iterable[str], goals: dict[str, Goal], captures: int, *, processes: int
) -> tuple[list[PlanOutcome], list[Refused]]:
    """Measure scenes, several at once, and print each plan as soon as its scene is done."""
    rows: list[PlanOutcome] = []
    refused: list[Refused] = []
    of_scene = partial(_listed, goals=goals, captures=captures)
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for found in pool.map(of_scene, names):
            for each in found:
                if isinstance(each, PlanOutcome):
                    rows.append(each)
                    print(*each.row(), f"{each.planned_in_s:.1f} s", flush=True)
                else:
                    refused.append(each)
                    print(f"{each.scene}, {each.goal}: {each.why}", flush=True)
    return rows, refused


def _listed(scene: str, goals: dict[str, Goal], captures: int) -> list[PlanOutcome | Refused]:
    return list(kept(scene, goals, captures))
