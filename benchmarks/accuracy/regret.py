"""How much quicker than a plan could one have been? ``python -m benchmarks.accuracy.regret``.

Every set of frequencies and every estimator that could be quicker than the plan is captured and
compared with the truth, the longest capture first and then by bisection over exposures and takes:
brute force that knows the truth, against a plan that does not. Scenes are the four of `SCENES`, and
all others of `promises.scenes`. Each search has a share of ``--minutes``; families are searched in
a random order, and the table says how many there was time for, so that a regret is a lower bound
where these are not all. ``--write`` keeps the table.
"""

import argparse
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

from benchmarks.accuracy import evidence
from benchmarks.accuracy.promises import (
    GOALS,
    LOOK_SEED,
    dimmest_dn_per_s,
    looked,
    measured,
    opened,
    scenes,
)
from transientcam_driver import Sequence
from transientcam_server.errors import Problem
from transientcam_server.planning import ESTIMATORS, Goal, Planner, SceneStatistics, in_words
from transientcam_server.planning._scene.scene import AMBIGUOUS_SHARE
from transientcam_server.planning._search.families import Family

SCENES = ("wall", "mirrors", "translucent", "corner")
TARGETS = ("20 mm", "5 mm", "2 mm")
CAPTURES = 10
ORDER = 1
BAR = 1.3
MORE_OUTLIERS = 0.02
FAIR = (
    "The search knows the true ranges and judges by them. A sequence is no candidate where more "
    f"than {AMBIGUOUS_SHARE:.0%} of the lit pixels are beyond its unambiguous range: that is the "
    "rule of plans, too, which go by the ranges that the look found, and also by later returns. "
    "Nor is one whose share of outliers is larger than that of the captured plan by more than "
    f"{MORE_OUTLIERS:.0%}: the error is that of the median pixel, which says nothing of them. "
    "Missed is a target that neither the plan nor anything quicker reaches; it does not count."
)


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
    with opened(scene, LOOK_SEED) as camera:
        assert camera.simulation is not None
        truth = camera.simulation.truth()
    lit = np.isfinite(truth.range_m) & (truth.brightness > 0)
    return np.asarray(truth.range_m[lit], dtype=float)


def table(found: list[Regret]) -> str:
    """Return all searches, and the shares that are within the bar."""
    lines = [
        "| scene | target | plan | ms | quickest | ms | regret | searched |\n" + "|---" * 8 + "|"
    ]
    lines += [
        f"| {each.scene} | {each.goal} | {each.plan} | {each.plan_s * 1e3:.0f} "
        + ("| missed | – | – " if each.missed else _of_quickest(each))
        + f"| {each.searched} of {each.families} |"
        for each in found
    ]
    four = [each for each in found if each.scene in SCENES]
    return "\n".join(
        [*lines, "", f"{_within(four)} (bar: 90 %); of all scenes {_within(found)}.", "", FAIR]
    )


def _of_quickest(each: Regret) -> str:
    return f"| {each.quickest} | {each.quickest_s * 1e3:.0f} | {each.factor:.2f} "


def _within(found: list[Regret]) -> str:
    factors = [each.factor for each in found if not each.missed]
    count = sum(each <= BAR for each in factors)
    return f"{count} of {len(factors)} within {BAR:g}, {count / max(1, len(factors)):.0%}"


def main() -> None:
    """Search the scenes named, or all there are; print a table, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    others = [each for each in scenes() if each not in SCENES]
    parser.add_argument("scenes", nargs="*", default=[*SCENES, *others])
    parser.add_argument("--targets", nargs="+", choices=TARGETS, default=list(TARGETS))
    parser.add_argument("--minutes", type=float, default=20.0, help="for all searches together")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--write", action="store_true", help="write to docs/plans.md")
    arguments = parser.parse_args()
    searches = len(arguments.scenes) * len(arguments.targets)
    each_s = 60 * arguments.minutes * arguments.processes / searches
    search = partial(regrets, targets=arguments.targets, search_s=each_s)
    with ProcessPoolExecutor(arguments.processes, mp_context=get_context("spawn")) as pool:
        found = [each for of_scene in pool.map(search, arguments.scenes) for each in of_scene]
    print(table(found))
    if arguments.write:
        evidence.write("regret", table(found), "python -m benchmarks.accuracy.regret --write")


if __name__ == "__main__":
    main()
