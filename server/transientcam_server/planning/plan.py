"""From a target accuracy or a budget of time to a sequence.

Every sequence of a grid is predicted; of those within the budgets that reach the targets the one
with the shortest capture is recommended, or, without a target, the most accurate one. Beside it
stand its two neighbours on the Pareto front: what half the time gives, and what twice the accuracy
costs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from transientcam.notebook import table_html
from transientcam_driver import Capabilities, Sequence
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.planning.candidates import candidates
from transientcam_server.planning.choice import TARGETS, Choice
from transientcam_server.planning.goal import BUDGETS, Goal
from transientcam_server.planning.prediction import Predictor


@dataclass(frozen=True, slots=True, repr=False)
class Plan:
    """A recommendation and its neighbours on the front; None where there is none.

    Attributes
    ----------
    half_time
        The most accurate one that takes at most half the time.
    twice_accuracy
        The quickest one with at most half the error.
    leading
        The target by which they are compared.
    """

    recommended: Choice
    half_time: Choice | None
    twice_accuracy: Choice | None
    leading: str

    def to_document(self) -> dict[str, Any]:
        """Return the plan as JSON has it."""
        return {
            **self.recommended.to_document(),
            "compared_by": self.leading,
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
    reconstruct_s: Callable[[Sequence], float],
) -> Plan:
    """Recommend a sequence.

    Parameters
    ----------
    goal
        Targets and budgets.
    predictor
        Of the scene.
    capabilities
        Of the camera.
    reconstruct_s
        Computing time of a frame of a sequence on this machine.

    Raises
    ------
    Problem
        ``invalid-request`` where the goal is empty or a value is out of bounds;
        ``target-unreachable`` with the best that can be achieved.
    """
    goal.require_sensible()
    choices = candidates(goal, predictor, capabilities, reconstruct_s=reconstruct_s)
    affordable = [choice for choice in choices if goal.affords(choice)]
    if not affordable:
        raise _unaffordable(goal, choices)
    reached = [choice for choice in affordable if goal.reached_by(choice)]
    if not reached:
        raise _unreachable(goal, affordable)
    leading = goal.leading
    if any(getattr(goal, name) is not None for name in TARGETS):
        best = min(reached, key=lambda each: (each.applied.capture_s, each.error(leading)))
    else:
        best = min(reached, key=lambda each: (each.error(leading), each.applied.capture_s))
    return Plan(best, *_neighbours(best, choices, leading), leading)


def _in_words(choice: Choice) -> str:
    sequence = choice.applied.sequence
    return (
        f"m = {sequence.harmonics} at {sequence.base_frequency_hz / 1e6:g} MHz, "
        f"zeroth {sequence.zeroth}, {sequence.exposure_s * 1e3:g} ms, takes {sequence.takes}: "
        f"captures in {choice.applied.capture_s * 1e3:.1f} ms, "
        f"range to {choice.range_std.median_m * 1e3:.2f} mm"
    )


def _neighbours(
    best: Choice, choices: list[Choice], leading: str
) -> tuple[Choice | None, Choice | None]:
    half_s, half_error = best.applied.capture_s / 2, best.error(leading) / 2
    quick = [choice for choice in choices if choice.applied.capture_s <= half_s]
    fine = [choice for choice in choices if choice.error(leading) <= half_error]
    return (
        min(quick, key=lambda choice: (choice.error(leading), choice.applied.capture_s))
        if quick
        else None,
        min(fine, key=lambda choice: (choice.applied.capture_s, choice.error(leading)))
        if fine
        else None,
    )


def _unaffordable(goal: Goal, choices: list[Choice]) -> Problem:
    """Return the problem of the budget that is too small, with the least that is possible."""
    quickest = min(choices, key=lambda choice: choice.applied.capture_s)
    lightest = min(choices, key=lambda choice: choice.computing_share)
    least = {
        "capture_s": (quickest, quickest.applied.capture_s),
        "frame_rate_hz": (quickest, quickest.applied.frame_rate_hz),
        "computing_share": (lightest, lightest.computing_share),
    }
    for budget, (best, value) in least.items():
        limit = getattr(goal, budget)
        if limit is not None and not Goal(**{budget: limit}).affords(best):
            return _refusal(budget, limit, value, best)
    # each by itself is enough, but no sequence keeps all of them
    budget = next(name for name in BUDGETS if getattr(goal, name) is not None)
    best, value = least[budget]
    return _refusal(budget, getattr(goal, budget), value, best, together=True)


def _unreachable(goal: Goal, affordable: list[Choice]) -> Problem:
    """Return the problem of the target out of reach, with the best that the budgets allow."""
    for target in TARGETS:
        limit = getattr(goal, target)
        if limit is None:
            continue
        best = min(affordable, key=lambda each, target=target: each.error(target))  # type: ignore[misc] # mypy cannot infer a lambda with a default
        if best.error(target) > goal.limit(target):
            value = best.separation_share if target == "separation_m" else best.error(target)
            return _refusal(target, limit, value, best)
    # each by itself is in reach, but none reaches all of them
    best = min(affordable, key=lambda each: each.error(goal.leading))
    return _refusal(
        goal.leading, getattr(goal, goal.leading), best.error(goal.leading), best, together=True
    )


def _refusal(
    field: str, limit: Any, achieved: Any, best: Choice, *, together: bool = False
) -> Problem:
    what = "Together with the others this" if together else "This"
    named = "share of captures that find both" if field == "separation_m" else field
    return Problem(
        kinds.TARGET_UNREACHABLE,
        f"{what} cannot be reached on this scene: {field} = {limit:g}. "
        f"The best {named} is {achieved:.4g}.",
        field=field,
        value=limit,
        limit=achieved,
        best=best.to_document(),
    )
