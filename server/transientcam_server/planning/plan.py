"""From a target accuracy or a budget of time to a sequence.

Every sequence of a grid is predicted; of those within the budgets that reach the targets the one
with the shortest capture is recommended, or, without a target, the most accurate one. Beside it
stand its two neighbours on the Pareto front: what half the time gives, and what twice the accuracy
costs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from transientcam_driver import Capabilities, Sequence
from transientcam_server.planning.candidates import candidates
from transientcam_server.planning.choice import TARGETS, Choice
from transientcam_server.planning.goal import Goal
from transientcam_server.planning.prediction import Predictor
from transientcam_server.planning.refusals import unaffordable, unreachable


@dataclass(frozen=True, slots=True)
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
        ``invalid-request`` where nothing is asked for or a value cannot be meant;
        ``target-unreachable`` with the best that can be achieved.
    """
    goal.require_sensible()
    choices = candidates(goal, predictor, capabilities, reconstruct_s=reconstruct_s)
    affordable = [choice for choice in choices if goal.affords(choice)]
    if not affordable:
        raise unaffordable(goal, choices)
    reached = [choice for choice in affordable if goal.reached_by(choice)]
    if not reached:
        raise unreachable(goal, affordable)
    leading = goal.leading
    if any(getattr(goal, name) is not None for name in TARGETS):
        best = min(reached, key=lambda each: (each.applied.capture_s, each.error(leading)))
    else:
        best = min(reached, key=lambda each: (each.error(leading), each.applied.capture_s))
    return Plan(best, *_neighbours(best, choices, leading), leading)


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
