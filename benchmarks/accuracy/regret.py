"""How much quicker than a plan one could have been.

Every set of frequencies and every estimator that could be quicker than the plan is captured and
compared with the truth, the longest capture first and then by bisection over exposures and takes:
brute force that knows the truth, against a plan that does not. Families are searched in a random
order, and the table says how many there was time for, so that a regret is a lower bound where these
are not all.
"""

import math
import os
import random
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.accuracy.capturing import LOOK_SEED, dimmest_dn_per_s, looked, measured
from benchmarks.accuracy.promises import GOALS, all_scenes
from benchmarks.common.tables import Cell, Table, heads
from transientcam_driver import Sequence
from transientcam_experiments.tradeoff import camera_before
from transientcam_server.errors import Problem
from transientcam_server.planning import ESTIMATORS, Goal, Planner, SceneStatistics, in_words
from transientcam_server.planning._search.families import Family

SCENES = ("wall", "mirrors", "translucent", "corner")
TARGETS = ("20 mm", "5 mm", "2 mm")
CAPTURES = 10
ORDER = 1
BAR = 1.3
MORE_OUTLIERS = 0.02


@dataclass(frozen=True)
class Regret:
    """A plan, and the quickest that was found to reach its target."""

    scene: str
    goal: str
    plan: str
    plan_s: float
    quickest: str
    quickest_s: float
    searched: int
    families: int
    missed: bool
    """Whether the plan misses the target, and so does all that is quicker."""

    @property
    def factor(self) -> float:
        """Time of the plan over that of the quickest; NaN where neither reaches the target."""
        return math.nan if self.missed else self.plan_s / self.quickest_s


def regrets(
    scene: str, targets: list[str], search_s: float, *, clock: Callable[[], float] = time.monotonic
) -> list[Regret]:
    """Search each target on a scene, each for so long."""
    return list(_regrets(scene, targets, search_s, clock))


def _regrets(
    scene: str, targets: list[str], search_s: float, clock: Callable[[], float]
) -> Iterator[Regret]:
    planner, statistics = looked(scene)
    true_m = true_ranges_m(scene)
    dimmest = dimmest_dn_per_s(statistics)

    @cache
    def captured(estimator: str, sequence: Sequence) -> dict[str, float]:
        values, _, _ = measured(scene, sequence, estimator, CAPTURES, dimmest)
        return values

    for name in targets:
        goal = GOALS[name]
        assert goal.range_error_m is not None
        try:
            best = planner.plan(goal, statistics).recommended
        except Problem as problem:
            print(f"{scene}, {name}: {problem.detail}", flush=True)
            continue
        quickest_s, quickest = best.applied.capture_s, best.in_words()
        of_plan = captured(best.estimator, best.applied.sequence)
        missed = of_plan["error"] > goal.range_error_m
        most_outliers = of_plan["outliers"] + MORE_OUTLIERS
        searched, until_s = 0, clock() + search_s
        families = list(every_family(goal, planner, statistics, true_m))
        random.Random(ORDER).shuffle(families)
        for family in families:
            if clock() > until_s:
                break
            searched += 1
            members = [each for each in family.members if each.capture_s < quickest_s]
            first, last = 0, len(members)
            while first < last:
                # the longest first: where that fails, nothing shorter will do
                place = last - 1 if last == len(members) else (first + last) // 2
                sequence = family.applied(members[place]).sequence
                found = captured(family.estimator, sequence)
                if found["error"] <= goal.range_error_m and found["outliers"] <= most_outliers:
                    quickest_s = members[place].capture_s
                    quickest = in_words(sequence, family.estimator)
                    missed, last = False, place
                elif place == len(members) - 1:
                    break
                else:
                    first = place + 1
        yield Regret(
            Path(scene).stem,
            name,
            best.in_words(),
            best.applied.capture_s,
            quickest,
            quickest_s,
            searched,
            len(families),
            missed,
        )


def every_family(
    goal: Goal, planner: Planner, scene: SceneStatistics, true_m: NDArray[Any]
) -> Iterator[Family]:
    """Yield all that the camera can run without saturating or ambiguity, with any estimator.

    Ambiguity is judged by the true ranges (N) of lit pixels, and not by what the look found.
    """
    few = scene.few()
    place = (np.arange(few.direct_m.size) + 0.5) / few.direct_m.size
    known = replace(few, direct_m=np.quantile(true_m, place), share=0 * few.share)
    for estimator in ESTIMATORS:
        yield from planner.families(replace(goal, estimator=estimator), known)


def true_ranges_m(scene: str) -> NDArray[Any]:
    """Return the range of every lit pixel of a scene."""
    with camera_before(scene, seed=LOOK_SEED) as camera:
        assert camera.simulation is not None
        truth = camera.simulation.truth()
    return np.asarray(truth.range_m[truth.lit], dtype=float)


def _row(each: Regret) -> tuple[Cell, ...]:
    searched = f"{each.searched} of {each.families}"
    quickest: tuple[Cell, ...] = ("missed", None, None)
    if not each.missed:
        quickest = (each.quickest, 1e3 * each.quickest_s, each.factor)
    return (each.scene, each.goal, each.plan, 1e3 * each.plan_s, *quickest, searched)


def _within(found: list[Regret]) -> str:
    factors = [each.factor for each in found if not each.missed]
    count = sum(each <= BAR for each in factors)
    return f"{count} of {len(factors)} within {BAR:g}, {count / max(1, len(factors)):.0%}"


def tables(
    *,
    scenes: tuple[str, ...] = (),
    targets: tuple[str, ...] = TARGETS,
    minutes: float = 20.0,
    processes: int = os.cpu_count() or 1,
) -> Iterator[Table]:
    """Search the scenes named, or all there are, for so many minutes together."""
    named = scenes or (*SCENES, *(each for each in all_scenes() if each not in SCENES))
    each_s = 60 * minutes * processes / (len(named) * len(targets))
    search = partial(regrets, targets=list(targets), search_s=each_s)
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        found = [each for of_scene in pool.map(search, named) for each in of_scene]
    columns = heads("scene | target | plan | ms:.0f | quickest | ms:.0f | regret:.2f | searched")
    four = _within([each for each in found if each.scene in SCENES])
    notes = [f"{four} (bar: 90 %); of all scenes {_within(found)}."]
    title = "How much quicker could a plan have been?"
    yield Table(title, columns, [_row(each) for each in found], notes)
