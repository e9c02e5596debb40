"""The search: the best choice for targets, the quickest within the budgets that reaches them.

Bounds rule families out before any draw, few draws all but the contenders, and many draws decide
among these. The longer a capture, the less its noise; its bias may grow, as where the likelihood
finds more returns the less noise there is. So the errors of a family fall to a least one, and may
rise again.
"""

import bisect
import math
from typing import Final, NamedTuple

from transientcam_server.planning._search.candidates import Candidate, Curve, Targets, longest
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.finest import finest

CONTENDERS: Final = 3
"""Families of which many draws decide."""
NEAR: Final = 1.3
"""A family stays a contender as long as it takes no longer than so many times the quickest."""
TOLERANCE: Final = 1.25
"""Few draws of a contender may predict up to so many times the range error of a target."""
_PREDICTIONS: Final = 5
"""By many draws, of one family, at most."""
_LEAST_CORRECTION: Final = 0.1


class _Place(NamedTuple):
    """A candidate of a family."""

    curve: Curve
    place: int

    @property
    def capture_s(self) -> float:
        return self.curve[self.place].capture_s


def best_choice(curves: list[Curve], targets: Targets, leading: str) -> Choice | None:
    """Return the choice that reaches targets soonest, or else errs the least; None without any."""
    quick = quickest(curves, targets) if targets else None
    return quick or finest(curves, leading)


def quickest(
    curves: list[Curve], targets: Targets, *, contenders: int = CONTENDERS
) -> Choice | None:
    """Return the choice within the budgets that reaches targets soonest; None without any.

    What few draws promised may take longer by many: then those that are to take less time are next.
    """
    possible = _possible(curves, targets)
    best: Choice | None = None
    while contending := _expected(possible, targets, _time_s(best))[:contenders]:
        for each in contending:
            best = _confirmed(each, targets, _time_s(best)) or best
        tried = {id(each.curve) for each in contending}
        possible = [each for each in possible if id(each.curve) not in tried]
    return best


def _time_s(best: Choice | None) -> float:
    return math.inf if best is None else best.applied.capture_s


def _possible(curves: list[Curve], targets: Targets) -> list[_Place]:
    """Return the first candidate of each family that its bound lets reach targets, by its time."""

    def reaches(candidate: Candidate) -> bool:
        return all(candidate.least_error(name) <= limit for name, limit in targets.items())

    first = ((curve, bisect.bisect_left(curve, x=True, key=reaches)) for curve in curves)
    possible = [_Place(curve, place) for curve, place in first if place < len(curve)]
    return sorted(possible, key=lambda each: each.capture_s)


def _expected(possible: list[_Place], targets: Targets, within_s: float) -> list[_Place]:
    """Return the quickest of each family by few draws, those near the quickest, by rising time."""
    tolerated = {
        name: limit * (TOLERANCE if name.startswith("range") else 1.0)
        for name, limit in targets.items()
    }
    expected: list[_Place] = []
    near_s = math.inf
    for curve, first in possible:
        if curve[first].capture_s > min(near_s, within_s):
            break
        last = longest(curve, near_s)
        if last is None or first > last:
            continue
        if "range_error_m" in targets and curve[first].least_bias_m() > targets["range_error_m"]:
            continue
        place = _first_affordable(curve, tolerated, first, last)
        if place is not None and curve[place].capture_s < within_s:
            expected.append(_Place(curve, place))
            near_s = min(near_s, NEAR * curve[place].capture_s)
    return sorted(expected, key=lambda each: each.capture_s)


def _first_affordable(curve: Curve, limits: Targets, first: int, last: int) -> int | None:
    """Return the first place that few draws find within limits, up to one that is affordable."""
    place = first_within(curve, limits, first, last)
    if place is None:
        return None
    return next(each for each in range(place, last + 1) if curve[each].affordable)


def _confirmed(expected: _Place, targets: Targets, within_s: float) -> Choice | None:
    """Return the first choice that reaches targets by many draws, near one by few."""
    curve, place = expected
    failed, last = -1, len(curve) - 1
    best: Choice | None = None
    for _ in range(_PREDICTIONS):
        candidate = curve[place]
        if candidate.capture_s >= within_s or not candidate.affordable:
            break
        choice = candidate.choice()
        error, with_margin = choice.relative_errors(targets)
        if error <= 1 < with_margin:  # few pixels leave it undecided
            choice = candidate.choice(closely=True)
            error, with_margin = choice.relative_errors(targets)
        if with_margin <= 1:
            best, last = choice, place - 1
        else:
            failed = place
        # few draws were wrong by that factor: on to where they predict as much less, or more;
        # where even the error is too large, the margin of few pixels says nothing
        wrong = max(error if error > 1 else with_margin, _LEAST_CORRECTION)
        corrected = {name: candidate.error(name) / wrong for name in targets}
        further = first_within(curve, corrected, failed + 1, last)
        if further is None and best is None and failed < last:
            # few draws are not wrong about all by the same factor: the best by them is left
            further = last = _finest(curve, failed + 1, last)
        if further is None:
            break
        place = further
    return best


def first_within(curve: Curve, limits: Targets, first: int, last: int) -> int | None:
    """Return the first place from ``first`` to ``last`` that few draws find within limits."""

    def within(candidate: Candidate) -> bool:
        return all(candidate.error(name) <= limit for name, limit in limits.items())

    if first > last:
        return None
    if not within(curve[last]):
        if "range_error_m" not in limits:
            return None
        last = _finest(curve, first, last)
        if not within(curve[last]):
            return None
    return bisect.bisect_left(curve, x=True, lo=first, hi=last + 1, key=within)


def _finest(curve: Curve, first: int, last: int) -> int:
    """Return the place from ``first`` to ``last`` whose range is best by few draws."""
    return min(range(first, last + 1), key=lambda place: curve[place].error("range_error_m"))
