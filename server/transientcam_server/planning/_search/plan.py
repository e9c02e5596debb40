"""From a target accuracy or a budget of time to a sequence and an estimator.

The stages, each from a value to a value: a goal becomes families of sequences, with what bounds
their errors; these become candidates, which are predicted as far as the search asks; what it
recommends becomes a plan, and what falls short of the goal a refusal.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from transientcam_driver import Capabilities
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._process.queue import Progress
from transientcam_server.planning._scene.estimation import SEARCHED
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.planning._search.families import ComputingTime, Goal, families
from transientcam_server.planning._search.search import (
    Choice,
    Curve,
    best_choice,
    curves,
    finest,
    first_within,
    longest,
    quickest,
    shortened,
)
from transientcam_server.planning._search.words import (
    Change,
    Shortfall,
    conditions,
    price_in_words,
    refusal,
    summary,
)


def shortfall(
    goal: Goal, best: Choice | None, curves: list[Curve], unlimited: list[Curve]
) -> Shortfall:
    """Return what falls short where no choice reaches the targets within the budgets.

    ``best``: by the leading target, within the budgets; None where nothing is.
    ``curves``, ``unlimited``: all candidates, by the goal and without its budgets.
    """
    if best is None:
        return _of_budgets(goal, unlimited)
    for target, limit in goal.limits.items():
        finest_by_it = best if target == goal.leading else finest(curves, target) or best
        if finest_by_it.error_with_margin(target) > limit:
            dearer = None
            if target.startswith("range") and goal.budgets:
                dearer = best_choice(unlimited, {target: limit}, target)
            return Shortfall(target, finest_by_it, dearer=dearer)
    # each by itself is in reach, but nothing reaches all of them
    return Shortfall(goal.leading, best, together=True)


def _of_budgets(goal: Goal, unlimited: list[Curve]) -> Shortfall:
    """Return the first budget that the shortest capture exceeds, or all together."""
    shortest = min((curve[0] for curve in unlimited), key=lambda each: each.capture_s)
    best = shortest.choice()
    for name in goal.budgets:
        alone = Goal(**{name: getattr(goal, name)})
        if not alone.affords(shortest.capture_s, best.timed):
            return Shortfall(name, best)
    return Shortfall(goal.budgets[0], best, together=True)


_SAME: Final = frozenset({"harmonics", "base_frequency_hz", "zeroth"})
Cameras = Mapping[str, tuple[Predictor, Capabilities]]
"""The present camera with one thing made better, by what that is: ``light`` or ``readout``."""


def changes(
    best: Choice, goal: Goal, predictor: Predictor, capabilities: Capabilities, better: Cameras
) -> list[Change]:
    """Plan anew for cameras of which one thing is better, and return what that gives, best first.

    Few draws find the quickest sequence that is as safely within the targets as the best choice is,
    or without targets the longest within the budgets; many draws predict it.
    """
    same = replace(goal, base=best.applied.sequence, fixed=goal.fixed | _SAME)
    same = replace(same, estimator=best.estimator, computing_share=None)
    present = _curve(same, predictor, capabilities)
    own = min(present, key=lambda each: abs(each.capture_s - best.applied.capture_s))
    limits = {
        name: limit * own.error(name) / max(best.error_with_margin(name), 1e-12)
        for name, limit in goal.limits.items()
    }
    found = []
    for what, (of_scene, camera) in better.items():
        curve = _curve(same, of_scene, camera)
        last = longest(curve)
        place = last if last is None or not limits else first_within(curve, limits, 0, last)
        if place is not None:
            choice = curve[place].choice()
            time_s, error = choice.applied.capture_s, choice.error(goal.leading)
            factors = best.applied.capture_s / time_s, best.error(goal.leading) / max(error, 1e-12)
            found.append(Change(what, time_s, error, *factors))
    return sorted(found, key=lambda each: each.time_factor if limits else each.error_factor)[::-1]


def _curve(goal: Goal, predictor: Predictor, capabilities: Capabilities) -> Curve:
    found = families(goal, predictor, capabilities)
    (curve,) = curves(found, goal, predictor, capabilities, lambda *_: None)
    return curve


@dataclass(frozen=True, slots=True)
class Plan:
    """A recommendation and its neighbours; None where there is none.

    ``half_time``: The most accurate one that takes at most half the time.
    ``twice_accuracy``: The quickest one with at most half the error.
    ``leading``: The target by which they are compared.
    ``summary``: A sentence about noise, bias and what half the error costs, and one where the bias
    is not known.
    ``scene``: What it was planned for.
    ``goal``: What it was planned for, too.
    ``changes``: What better cameras would give, best first.
    ``computing_s``: Computing time of a frame by estimator; None where it is not known yet.
    """

    recommended: Choice
    half_time: Choice | None
    twice_accuracy: Choice | None
    leading: str
    summary: str
    scene: SceneStatistics
    goal: Goal
    changes: list[Change]
    computing_s: dict[str, float | None]

    def to_document(self) -> dict[str, Any]:
        """Return the plan as JSON has it."""
        region = self.goal.region
        return {
            **self.recommended.to_document(),
            "region": None if region is None else region.to_document(),
            "computing_s": self.computing_s,
            "changes": [asdict(each) for each in self.changes],
            "price_summary": price_in_words(self.recommended, self.changes, self.goal),
            "compared_by": self.leading,
            "summary": self.summary,
            "scene": self.scene.to_document(),
            "half_time": self._neighbour(self.half_time),
            "twice_accuracy": self._neighbour(self.twice_accuracy),
        }

    def _neighbour(self, choice: Choice | None) -> dict[str, Any] | None:
        if choice is None:
            return None
        own = self.recommended.error(self.leading)
        return choice.to_document() | {
            "time_factor": choice.applied.capture_s / self.recommended.applied.capture_s,
            "error_factor": choice.error(self.leading) / own if own > 0 else None,
        }


def plan(
    goal: Goal,
    predictor: Predictor,
    capabilities: Capabilities,
    *,
    timed: ComputingTime,
    better: Cameras | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Recommend a sequence and an estimator.

    ``goal``: Targets and budgets.
    ``predictor``: Of the scene.
    ``capabilities``: Of the camera.
    ``timed``: Computing time in s of a frame of a sequence with an estimator on this machine.
    ``better``: Cameras of which it is stated what they would give.
    ``progress``: Receives the steps.
    Raises Problem: ``invalid-request`` where the goal is empty or a value is out of bounds;
    ``target-unreachable`` with the best that can be achieved and what limits it.
    """
    progress = progress or Progress()
    goal.require_sensible()
    targets, leading, anyhow = goal.limits, goal.leading, goal.without_budgets()
    scene, found = predictor.scene, families(goal, predictor, capabilities, timed)
    candidates = curves(found, goal, predictor, capabilities, timed)
    unlimited = curves(found, anyhow, predictor, capabilities, timed)
    best = best_choice(candidates, targets, leading)
    if best is None or best.relative_errors(targets)[1] > 1:
        missed = shortfall(goal, best, candidates, unlimited)
        seen = {name: getattr(scene, name) for name in ("of_one_frame", "calibrated")}
        raise refusal(goal, missed, **seen)
    progress.at(0.7, "half the time")
    best, half_time = shortened(best, candidates, targets, leading)
    progress.at(0.8, "twice the accuracy")
    half = best.error(leading) / 2  # of nothing there is none
    twice = quickest(unlimited, {leading: half}, contenders=1) if half else None
    progress.at(0.9, "what would buy most")
    gains = changes(best, goal, predictor, capabilities, better or {})
    sequence = best.applied.sequence
    times_s = {name: timed(sequence, name) for name in dict.fromkeys((best.estimator, *SEARCHED))}
    words = summary(best, twice, scene) + conditions(scene)
    return Plan(best, half_time, twice, leading, words, scene, goal, gains, times_s)
