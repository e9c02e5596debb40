"""Why a goal cannot be reached, and the best that can."""

from typing import Any

from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.planning.choice import TARGETS, Choice
from transientcam_server.planning.goal import BUDGETS, Goal


def unaffordable(goal: Goal, choices: list[Choice]) -> Problem:
    """Say which budget is too small, and the least there is."""
    quickest = min(choices, key=lambda choice: choice.applied.capture_s)
    lightest = min(choices, key=lambda choice: choice.computing_share)
    least = {
        "capture_s": (quickest, quickest.applied.capture_s),
        "frame_rate_hz": (quickest, quickest.applied.frame_rate_hz),
        "computing_share": (lightest, lightest.computing_share),
    }
    for budget, (best, value) in least.items():
        wanted = getattr(goal, budget)
        if wanted is not None and not Goal(**{budget: wanted}).affords(best):
            return _refusal(budget, wanted, value, best)
    # each by itself is enough, but no sequence keeps all of them
    budget = next(name for name in BUDGETS if getattr(goal, name) is not None)
    best, value = least[budget]
    return _refusal(budget, getattr(goal, budget), value, best, together=True)


def unreachable(goal: Goal, affordable: list[Choice]) -> Problem:
    """Say which target is out of reach, and the best that the budgets allow."""
    for target in TARGETS:
        wanted = getattr(goal, target)
        if wanted is None:
            continue
        best = min(affordable, key=lambda each, target=target: each.error(target))  # type: ignore[misc] # mypy cannot infer a lambda with a default
        if best.error(target) > goal.limit(target):
            value = best.separation_share if target == "separation_m" else best.error(target)
            return _refusal(target, wanted, value, best)
    # each by itself is in reach, but none reaches all of them
    best = min(affordable, key=lambda each: each.error(goal.leading))
    return _refusal(
        goal.leading, getattr(goal, goal.leading), best.error(goal.leading), best, together=True
    )


def _refusal(
    field: str, wanted: Any, achieved: Any, best: Choice, *, together: bool = False
) -> Problem:
    what = "Together with the others this" if together else "This"
    named = "share of captures that find both" if field == "separation_m" else field
    return Problem(
        kinds.TARGET_UNREACHABLE,
        f"{what} cannot be reached on this scene: {field} = {wanted:g}. "
        f"The best {named} is {achieved:.4g}.",
        field=field,
        value=wanted,
        limit=achieved,
        best=best.to_document(),
    )
