"""Why a goal is out of reach: the best there is, and what limits it, in words."""

import math
from typing import Final

from transientcam_server.errors import Problem, kinds
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.goal import BUDGETS, Goal
from transientcam_server.planning._search.shortfall import Shortfall

_CLEARLY_LESS: Final = 0.8
"""Share of the best error that what is dearer has to stay below to be named."""


def refusal(goal: Goal, shortfall: Shortfall, *, of_one_frame: bool = False) -> Problem:
    """Return the problem ``target-unreachable`` of what falls short of a goal.

    A frame of another purpose, in the place of a look, decides nothing: a capture may do better.
    """
    field, best = shortfall.field, shortfall.best
    limit, achieved = getattr(goal, field), _achieved(best, field)
    limited_by, words = _limits(shortfall)
    named = "share of captures that find both" if field == "separation_m" else field
    margin, of_share = "", ""
    if field == "range_error_m" and goal.share is not None:
        of_share = f" in {goal.share:.0%} of the pixels"
    if field.startswith("range") and achieved <= limit:
        margin = ", which leaves no margin"
    decided = not (of_one_frame and field.startswith("range"))
    verdict = (
        f"This cannot be reached on this scene: {field} = {limit:g}{of_share}. "
        f"The best {named} is {achieved:.4g}{margin}."
        if decided
        else f"Whether this can be reached one frame does not tell: {field} = {limit:g}{of_share}. "
        f"By it the best {named} is {achieved:.4g}; a look at all frequencies may find less."
    )
    return Problem(
        kinds.TARGET_UNREACHABLE,
        f"{verdict} What limits it: {words}.",
        decided=decided,
        field=field,
        value=limit,
        limit=achieved,
        limited_by=limited_by,
        best=best.to_document(),
    )


def _achieved(best: Choice, field: str) -> float:
    """Return what a choice achieves of a target, or needs of a budget."""
    if field == "separation_m":
        return 0.0 if best.separation_share is None else best.separation_share
    if field == "computing_share":
        return math.inf if best.computing_share is None else best.computing_share
    return float(getattr(best.applied, field)) if field in BUDGETS else best.error(field)


def _limits(shortfall: Shortfall) -> tuple[str, str]:
    """Return what limits a choice, by a word and in words."""
    field, best = shortfall.field, shortfall.best
    budget = field in BUDGETS
    if shortfall.together:
        return "together", f"the {'budgets' if budget else 'targets'} together"
    if budget:
        return "budget", f"{field} alone"
    if not field.startswith("range"):
        return "noise", "the longest capture there is does no better"
    noise_m, bias_m = best.predicted.range_std.median, best.predicted.range_bias_m
    m = best.applied.sequence.harmonics
    dearer = _dearer(shortfall)
    if field == "range_error_m" and bias_m > noise_m:
        return (
            "bias",
            f"more time does not help here: bias {bias_m * 1e3:.3g} mm at m = {m}{dearer}",
        )
    capture_ms = best.applied.capture_s * 1e3
    return "noise", f"noise {noise_m * 1e3:.3g} mm in {capture_ms:.3g} ms at m = {m}{dearer}"


def _dearer(shortfall: Shortfall) -> str:
    """Say what more than the budgets would give, after a semicolon; or nothing."""
    field, best, dearer = shortfall.field, shortfall.best, shortfall.dearer
    if dearer is None or dearer.error(field) >= _CLEARLY_LESS * best.error(field):
        return ""
    factor = dearer.applied.capture_s / best.applied.capture_s
    return (
        f"; m = {dearer.applied.sequence.harmonics} takes {factor:.2g} x as long and is "
        f"{dearer.error(field) * 1e3:.3g} mm off"
    )
