"""How much quicker than a plan could one have been? ``python -m benchmarks.accuracy.regret``.

Every set of frequencies and every estimator that could be quicker than the plan is captured and
compared with the truth, the longest capture first and then by bisection over exposures and takes:
brute force that knows the truth, against a plan that does not. Ten minutes a scene.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.accuracy.promises import GOALS, looked, measured
from transientcam_driver import Sequence
from transientcam_server.errors.exceptions import Problem
from transientcam_server.planning import Goal, Planner, SceneStatistics
from transientcam_server.planning.estimation import ESTIMATORS
from transientcam_server.planning.families import Family

SCENES = ("wall", "mirrors", "translucent", "corner")
TARGETS = ("20 mm", "5 mm", "2 mm")
CAPTURES = 10
LEAST_M = 1e-9


@dataclass(frozen=True)
class Regret:
    """A plan, and the quickest that was found to reach its target."""

    scene: str
    goal: str
    plan: str
    plan_s: float
    quickest: str
    quickest_s: float

    @property
    def factor(self) -> float:
        """Time of the plan over that of the quickest."""
        return self.plan_s / self.quickest_s


def regrets(scene: str) -> Iterator[Regret]:
    """Search each target on a scene."""
    planner, statistics = looked(scene)

    @cache
    def error_m(estimator: str, sequence: Sequence) -> float:
        values, _, _ = measured(scene, sequence, estimator, CAPTURES)
        return values["error"]

    for name in TARGETS:
        goal = GOALS[name]
        assert goal.range_error_m is not None
        try:
            best = planner.plan(goal, statistics).recommended
        except Problem as problem:
            print(f"{scene}, {name}: {problem.detail}", flush=True)
            continue
        quickest_s, quickest = best.applied.capture_s, best.in_words()
        for family in every_family(goal, planner, statistics):
            members = [each for each in family.members if each.capture_s < quickest_s]
            first, last = 0, len(members)
            while first < last:
                # the longest first: where that fails, nothing shorter will do
                place = last - 1 if last == len(members) else (first + last) // 2
                sequence = family.applied(members[place]).sequence
                if error_m(family.estimator, sequence) <= goal.range_error_m:
                    quickest_s = members[place].capture_s
                    quickest = f"{family.estimator} {sequence.to_document()}"
                    last = place
                elif place == len(members) - 1:
                    break
                else:
                    first = place + 1
        yield Regret(
            Path(scene).stem, name, best.in_words(), best.applied.capture_s, quickest, quickest_s
        )


def every_family(goal: Goal, planner: Planner, scene: SceneStatistics) -> Iterator[Family]:
    """Yield all that the camera can run without saturating, with any estimator, also ambiguous."""
    near = replace(scene, direct_m=np.full_like(scene.direct_m, LEAST_M), share=0 * scene.share)
    for estimator in ESTIMATORS:
        yield from planner.families(replace(goal, estimator=estimator), near)


def main() -> None:
    """Search the scenes named, or four built-in ones, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    arguments = parser.parse_args()
    print("| scene | target | plan | ms | quickest | ms | regret |\n" + "|---" * 7 + "|")
    found = []
    for scene in arguments.scenes:
        for each in regrets(scene):
            found.append(each)
            print(
                f"| {each.scene} | {each.goal} | {each.plan} | {each.plan_s * 1e3:.0f} "
                f"| {each.quickest} | {each.quickest_s * 1e3:.0f} | {each.factor:.2f} |",
                flush=True,
            )
    within = np.mean([each.factor <= 1.3 for each in found])
    print(f"\n{within:.0%} of {len(found)} within 1.3")


if __name__ == "__main__":
    main()
