"""The finest choice within the budgets and a time, and whether half that time would do."""

import math
from typing import Final

from transientcam_server.planning._search.candidates import Candidate, Curve, Targets, longest
from transientcam_server.planning._search.choice import Choice

CONTENDERS: Final = 3
"""Families of which many draws decide."""
NEAR: Final = 1.3
"""A family stays a contender as long as it errs no more than so many times the finest."""
HARDLY_MORE: Final = 1.05
"""Growth of an error that half the time is taken for, where bias rules (decision 12)."""


def finest(
    curves: list[Curve], target: str, within_s: float = math.inf, *, contenders: int = CONTENDERS
) -> Choice | None:
    """Return the choice within the budgets, and a time, with the least error.

    The longest candidate of each family stands for it. Bounds rule most of them out, few draws all
    but the contenders, and many draws decide among these.
    """
    affordable = [
        curve[place] for curve in curves if (place := longest(curve, within_s)) is not None
    ]
    bounded = [(each.least_error(target), each) for each in affordable]
    drawn: list[tuple[float, Candidate]] = []
    worst = math.inf
    for least, candidate in sorted(bounded, key=lambda each: each[0]):
        if least > worst:
            break
        if target == "range_error_m" and candidate.least_bias_m() > worst:
            continue
        error = candidate.error(target)
        drawn.append((error, candidate))
        worst = min(worst, NEAR * error)
    drawn.sort(key=lambda each: (each[0], each[1].capture_s))
    choices = [candidate.choice() for _, candidate in drawn[:contenders]]
    return min(choices, key=lambda choice: choice.error(target), default=None)


def shortened(
    best: Choice, curves: list[Curve], targets: Targets, leading: str
) -> tuple[Choice, Choice | None]:
    """Return a choice without the time that buys nothing, and the finest in half its time.

    Where bias rules, half the time will do as long as the error hardly grows, and stays below its
    target without the margin.
    """
    while True:
        half_time = finest(curves, leading, best.applied.capture_s / 2)
        if half_time is None or not _as_good(half_time, best, targets):
            return best, half_time
        best = half_time


def _as_good(quicker: Choice, best: Choice, targets: Targets) -> bool:
    """Return whether a quicker choice errs hardly more than one whose bias rules.

    It has to reach the targets, too, but by what is expected of it: with margin it just misses one.
    """
    return (
        "range_error_m" in targets
        and best.predicted.range_bias_m > best.predicted.range_std.median
        and quicker.relative_errors(targets)[0] <= 1
        and all(
            quicker.error_with_margin(target) <= HARDLY_MORE * best.error_with_margin(target)
            for target in targets
        )
    )
