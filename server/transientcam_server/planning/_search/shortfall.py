"""What falls short of a goal: which target or budget is out of reach, and the best there is."""

from dataclasses import dataclass

from transientcam_server.planning._search.candidates import Curve
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.finest import finest
from transientcam_server.planning._search.goal import Goal
from transientcam_server.planning._search.search import best_choice


@dataclass(frozen=True, slots=True)
class Shortfall:
    """Why nothing suits a goal."""

    field: str
    """The target or budget that is out of reach, by itself or ``together`` with the others."""
    best: Choice
    """Of a target, the most accurate within the budgets; of a budget, the shortest of all."""
    together: bool = False
    dearer: Choice | None = None
    """The one for the target whatever it costs, where there are budgets."""


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
    for name in goal.budgets:
        alone = Goal(**{name: getattr(goal, name)})
        if not alone.affords(shortest.capture_s, shortest.reconstruct_s):
            return Shortfall(name, shortest.choice())
    return Shortfall(goal.budgets[0], shortest.choice(), together=True)
