"""Why a goal is out of reach: the best there is, and what limits it, in words."""

import math
from typing import Any

from transientcam_server.errors import Problem, kinds
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.goal import BUDGETS, Goal
from transientcam_server.planning._search.search import Search


def unreachable(goal: Goal, search: Search, finest: Choice) -> Problem:
    """Return the problem of the target out of reach, with the best that the budgets allow."""
    for target in goal.targets:
        best = finest if target == goal.leading else search.finest(target) or finest
        if best.error_with_margin(target) > goal.limit(target):
            value = best.separation_share if target == "separation_m" else best.error(target)
            return _refusal(goal, target, value, best, _limits(goal, search, best, target))
    # each by itself is in reach, but nothing reaches all of them
    value = finest.error(goal.leading)
    return _refusal(goal, goal.leading, value, finest, ("together", "the targets together"))


def too_small(goal: Goal, search: Search) -> Problem:
    """Return the problem of the budget that is too small, with the least that is possible."""
    unlimited = search.without_budgets()
    quickest_of = min(search.families, key=lambda family: family.members[0].capture_s)
    quickest = unlimited.choice(quickest_of, quickest_of.members[0])
    given = [name for name in BUDGETS if getattr(goal, name) is not None]
    for budget in given:
        if not Goal(**{budget: getattr(goal, budget)}).affords(quickest):
            value = _spent(quickest, budget)
            return _refusal(goal, budget, value, quickest, ("budget", f"{budget} alone"))
    value = _spent(quickest, given[0])
    return _refusal(goal, given[0], value, quickest, ("together", "the budgets together"))


def _spent(choice: Choice, budget: str) -> float:
    if budget == "computing_share":
        return math.inf if choice.computing_share is None else choice.computing_share
    return float(getattr(choice.applied, budget))


def _limits(goal: Goal, search: Search, best: Choice, target: str) -> tuple[str, str]:
    """Return what limits the error, by a word and in words."""
    if not target.startswith("range"):
        return "noise", "the longest capture there is does no better"
    noise_m = best.predicted.range_std.median
    bias_m = best.predicted.range_bias_m
    m = best.applied.sequence.harmonics
    if target == "range_error_m" and bias_m > noise_m:
        words = f"more time does not help here: bias {bias_m * 1e3:.3g} mm at m = {m}"
        kind = "bias"
    else:
        words = f"noise {noise_m * 1e3:.3g} mm in {best.applied.capture_s * 1e3:.3g} ms at m = {m}"
        kind = "noise"
    given = [name for name in BUDGETS if getattr(goal, name) is not None]
    if given:
        unlimited = search.without_budgets()
        other = unlimited.quickest({target: goal.limit(target)}) or unlimited.finest(target)
        if other is not None and other.error(target) < 0.8 * best.error(target):
            factor = other.applied.capture_s / best.applied.capture_s
            words += (
                f"; m = {other.applied.sequence.harmonics} takes {factor:.2g} x as long and is "
                f"{other.error(target) * 1e3:.3g} mm off"
            )
    return kind, words


def _refusal(
    goal: Goal, field: str, achieved: Any, best: Choice, limits: tuple[str, str]
) -> Problem:
    limit = getattr(goal, field)
    named = "share of captures that find both" if field == "separation_m" else field
    kind, words = limits
    margin = ""
    if field.startswith("range") and achieved is not None and achieved <= limit:
        margin = ", which leaves no margin"
    return Problem(
        kinds.TARGET_UNREACHABLE,
        f"This cannot be reached on this scene: {field} = {limit:g}. "
        f"The best {named} is {achieved:.4g}{margin}. What limits it: {words}.",
        field=field,
        value=limit,
        limit=achieved,
        limited_by=kind,
        best=best.to_document(),
    )
