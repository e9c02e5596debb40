"""From a target accuracy or a budget of time to a sequence and an estimator.

The stages, each from a value to a value: a goal becomes families of sequences; these become
candidates, which are predicted as far as the search asks; what it recommends becomes a plan, and
what falls short of the goal a refusal.
"""

from dataclasses import asdict, dataclass
from typing import Any

from transientcam_driver import Capabilities
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._process.progress import Progress
from transientcam_server.planning._scene.estimation import SEARCHED
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.planning._search.candidates import ComputingTime, curves
from transientcam_server.planning._search.changes import Change, changes, in_words
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.families import families
from transientcam_server.planning._search.finest import shortened
from transientcam_server.planning._search.goal import Goal
from transientcam_server.planning._search.refusal import refusal
from transientcam_server.planning._search.search import best_choice, quickest
from transientcam_server.planning._search.shortfall import shortfall
from transientcam_server.planning._search.summary import summary


@dataclass(frozen=True, slots=True, repr=False)
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
            "price_summary": in_words(self.recommended, self.changes, self.goal),
            "compared_by": self.leading,
            "summary": self.summary,
            "scene": self.scene.to_document(),
            "half_time": self._neighbour(self.half_time),
            "twice_accuracy": self._neighbour(self.twice_accuracy),
        }

    def __repr__(self) -> str:
        """State the recommended sequence, and what it takes and gives."""
        return f"<Plan {_in_words(self.recommended)}>"

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
    progress: Progress | None = None,
) -> Plan:
    """Recommend a sequence and an estimator.

    ``goal``: Targets and budgets.
    ``predictor``: Of the scene.
    ``capabilities``: Of the camera.
    ``timed``: Computing time in s of a frame of a sequence with an estimator on this machine.
    ``progress``: Receives the steps.
    Raises Problem: ``invalid-request`` where the goal is empty or a value is out of bounds;
    ``target-unreachable`` with the best that can be achieved and what limits it.
    """
    goal.require_sensible()
    progress = progress or Progress()
    progress.at(0.0, "sequences for the goal")
    found = families(goal, predictor, capabilities)
    candidates = curves(found, goal, predictor, timed)
    unlimited = curves(found, goal.without_budgets(), predictor, timed)
    targets, leading = goal.limits, goal.leading
    best = best_choice(candidates, targets, leading)
    if best is None or best.relative_errors(targets)[1] > 1:
        missed = shortfall(goal, best, candidates, unlimited)
        raise refusal(goal, missed, of_one_frame=predictor.scene.of_one_frame)
    progress.at(0.7, "half the time")
    best, half_time = shortened(best, candidates, targets, leading)
    progress.at(0.8, "twice the accuracy")
    twice = quickest(unlimited, {leading: best.error(leading) / 2}, contenders=1)
    scene = predictor.scene
    progress.at(0.9, "what would buy most")
    better = changes(best, goal, predictor, capabilities)
    words, sequence = summary(best, twice, scene) + scene.conditions, best.applied.sequence
    times_s = {name: timed(sequence, name) for name in dict.fromkeys((best.estimator, *SEARCHED))}
    return Plan(best, half_time, twice, leading, words, scene, goal, better, times_s)


def _in_words(choice: Choice) -> str:
    predicted = choice.predicted
    return (
        f"{choice.in_words()}: captures in {choice.applied.capture_s * 1e3:.1f} ms, "
        f"range to {choice.range_error.median * 1e3:.2f} mm "
        f"({predicted.range_std.median * 1e3:.2f} noise, "
        f"{predicted.range_bias_m * 1e3:.2f} bias)"
    )
