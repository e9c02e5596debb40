"""From a target accuracy or a budget of time to a sequence and an estimator.

Of all that the camera can run within the budgets the quickest that reaches the targets with margin
is recommended, or, without a target, the most accurate. Where bias rules, time that buys nothing is
not spent: half of it will do as long as the error hardly grows, and stays below its target without
the margin. Beside the recommended one stand what half the time gives, and what twice the accuracy
costs.
"""

from dataclasses import dataclass
from typing import Any, Final

from transientcam.notebook import table_html
from transientcam_driver import Capabilities
from transientcam_server.planning._prediction.intervals import DISAGREEING
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._process.progress import Progress
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.families import families
from transientcam_server.planning._search.goal import Goal
from transientcam_server.planning._search.pareto import flat_from
from transientcam_server.planning._search.refusal import too_small, unreachable
from transientcam_server.planning._search.search import Search, Timed

HARDLY_MORE: Final = 1.05
"""Growth of an error that half the time is taken for, where bias rules (decision 12)."""


@dataclass(frozen=True, slots=True, repr=False)
class Plan:
    """A recommendation and its neighbours; None where there is none.

    Attributes
    ----------
    half_time
        The most accurate one that takes at most half the time.
    twice_accuracy
        The quickest one with at most half the error.
    leading
        The target by which they are compared.
    summary
        A sentence about noise, bias and what half the error costs, and one where the bias is not
        known.
    scene
        What it was planned for.
    """

    recommended: Choice
    half_time: Choice | None
    twice_accuracy: Choice | None
    leading: str
    summary: str
    scene: SceneStatistics

    def to_document(self) -> dict[str, Any]:
        """Return the plan as JSON has it."""
        return {
            **self.recommended.to_document(),
            "compared_by": self.leading,
            "summary": self.summary,
            "scene": self.scene.to_document(),
            "half_time": self._neighbour(self.half_time),
            "twice_accuracy": self._neighbour(self.twice_accuracy),
        }

    def __repr__(self) -> str:
        """State the recommended sequence, and what it takes and gives."""
        return f"<Plan {_in_words(self.recommended)}>"

    def _repr_html_(self) -> str:
        """Return the recommendation and its neighbours as a table, for notebooks."""
        rows = {
            "recommended": self.recommended,
            "half the time": self.half_time,
            "twice the accuracy": self.twice_accuracy,
        }
        words = {
            name: "no sequence does" if each is None else _in_words(each)
            for name, each in rows.items()
        }
        return table_html(f"Plan, compared by {self.leading}", words)

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
    timed: Timed,
    progress: Progress | None = None,
) -> Plan:
    """Recommend a sequence and an estimator.

    Parameters
    ----------
    goal
        Targets and budgets.
    predictor
        Of the scene.
    capabilities
        Of the camera.
    timed
        Computing time in s of a frame of a sequence with an estimator on this machine.
    progress
        Receives the steps.

    Raises
    ------
    Problem
        ``invalid-request`` where the goal is empty or a value is out of bounds;
        ``target-unreachable`` with the best that can be achieved and what limits it.
    """
    goal.require_sensible()
    progress = progress or Progress()
    progress.at(0.0, "sequences for the goal")
    search = Search(goal, families(goal, predictor, capabilities), predictor, timed)
    targets = {name: goal.limit(name) for name in goal.targets}
    leading = goal.leading
    best = search.quickest(targets) if targets else search.finest(leading)
    if best is None:
        best = search.finest(leading)
        if best is None:
            raise too_small(goal, search)
        if not goal.reached_by(best):
            raise unreachable(goal, search, best)
    progress.at(0.7, "half the time")
    half_time = search.finest(leading, best.applied.capture_s / 2)
    while targets and half_time is not None and _as_good(half_time, best, goal):
        best = half_time
        half_time = search.finest(leading, best.applied.capture_s / 2)
    progress.at(0.8, "twice the accuracy")
    half = {leading: best.error(leading) / 2}
    twice = search.without_budgets().quickest(half, contenders=1)
    summary = _summary(best, twice) + doubt(best, predictor.scene)
    return Plan(best, half_time, twice, leading, summary, predictor.scene)


def _as_good(quicker: Choice, best: Choice, goal: Goal) -> bool:
    """Return whether a quicker choice errs hardly more than one whose bias rules.

    It has to reach the targets, too, but by what is expected of it: with margin it just misses one.
    """
    return (
        "range_error_m" in goal.targets
        and best.predicted.range_bias_m > best.predicted.range_std.median
        and all(
            quicker.error(target) <= goal.limit(target)
            and quicker.error_with_margin(target) <= HARDLY_MORE * best.error_with_margin(target)
            for target in goal.targets
        )
    )


def doubt(choice: Choice, scene: SceneStatistics) -> str:
    """Return a sentence, after a space, on why the bias of a choice is not known; or nothing."""
    if choice.predicted.bias_known:
        return ""
    if scene.lit_in_part:
        return (
            f" Bias unknown: {scene.dim_share:.0%} of the lit pixels are so dim that other "
            "surfaces may light them alone, and by how much that light is late does not show."
        )
    apart_m = scene.disagreement_m
    if apart_m > DISAGREEING * choice.predicted.range_error.median:
        return (
            f" Bias unknown: two ways to tell direct from later light differ by {apart_m * 1e3:.2g}"
            " mm even at all frequencies, and both may be further off."
        )
    return (
        " Bias unknown: light that goes on coming, as out of wax or from other walls, would look "
        f"the same, and put the range {choice.predicted.most_bias_m * 1e3:.2g} mm off."
    )


def in_a_sentence(front: list[Choice], scene: SceneStatistics) -> str:
    """State from where on more time buys little, of choices by rising time; and any doubt."""
    if not front:
        return "Nothing reaches any accuracy on this scene."
    finest = front[-1]
    best = (
        f"the best is {finest.predicted.range_error.median * 1e3:.3g} mm in "
        f"{_time_in_words(finest.applied.capture_s)} ({finest.in_words()})"
    )
    flat = flat_from(
        [
            (
                each.predicted.range_std.median,
                each.predicted.range_bias_m,
                each.predicted.range_error.median,
            )
            for each in front
        ]
    )
    if flat is None:
        return f"Noise rules everywhere: more time buys accuracy; {best}." + doubt(finest, scene)
    since = _time_in_words(front[flat].applied.capture_s)
    rules = f"From {since} on bias rules and more time buys little; {best}."
    return rules + doubt(finest, scene)


def _time_in_words(time_s: float) -> str:
    return f"{time_s:.3g} s" if time_s >= 1 else f"{time_s * 1e3:.3g} ms"


def _summary(best: Choice, twice: Choice | None) -> str:
    predicted = best.predicted
    noise_m, bias_m = predicted.range_std.median, predicted.range_bias_m
    first = f"{noise_m * 1e3:.3g} mm noise, {bias_m * 1e3:.3g} mm off"
    if twice is None:
        what = "more frequencies or another estimator" if bias_m > noise_m else "a longer capture"
        return f"{first}: nothing that this camera can capture halves the error, not even {what}."
    factor = twice.applied.capture_s / best.applied.capture_s
    error_m = twice.predicted.range_error.median
    return f"{first}: {twice.in_words()} takes {factor:.2g} x as long for {error_m * 1e3:.3g} mm."


def _in_words(choice: Choice) -> str:
    predicted = choice.predicted
    return (
        f"{choice.in_words()}: captures in {choice.applied.capture_s * 1e3:.1f} ms, "
        f"range to {predicted.range_error.median * 1e3:.2f} mm "
        f"({predicted.range_std.median * 1e3:.2f} noise, "
        f"{predicted.range_bias_m * 1e3:.2f} bias)"
    )
