"""The search: which member of which family is quickest, or finest, and what is stated of it."""

import bisect
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from transientcam_driver import Sequence
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._process.progress import Progress
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.families import Family, Member
from transientcam_server.planning._search.goal import Goal
from transientcam_server.planning._search.pareto import front

Timed = Callable[[Sequence, str], float | None]
"""Computing time in s of a frame of a sequence with an estimator, if it is known."""
HOPE: Final = 1.25
"""A family is looked at closely where few draws predict up to so many times a target."""
CONTENDERS: Final = 3
"""Families of which more draws decide."""
NEAR: Final = 1.3
"""A family stays a contender as long as it takes no longer than so many times the quickest."""
ON_FRONT: Final = 12
"""Times that the front is made of."""
LONGEST_S: Final = 5.0
"""The longest of them."""
POINTS: Final = 8
"""At most twice as many make a line."""
_STEPS: Final = 5
_LEAST_WRONG: Final = 0.1


@dataclass(frozen=True, slots=True)
class Found:
    """A member of a family and the error that few draws predict of it."""

    family: Family
    place: int
    error: float

    @property
    def member(self) -> Member:
        """The sequence."""
        return self.family.members[self.place]


@dataclass(frozen=True, slots=True)
class Point:
    """Predicted errors in m of the median pixel, of a capture of this length."""

    capture_s: float
    range_std_m: float
    range_bias_m: float
    range_error_m: float


@dataclass(frozen=True, slots=True)
class Line:
    """How the error of the same frequencies falls with time: noise falls onto the bias.

    ``sequence`` is the shortest one.
    """

    estimator: str
    sequence: Sequence
    points: tuple[Point, ...]


class Search:
    """Finds choices for a goal among families.

    Parameters
    ----------
    goal
        Targets and budgets.
    families
        Those of shorter captures first.
    predictor
        Of the scene.
    timed
        Of the machine.
    """

    def __init__(
        self, goal: Goal, families: list[Family], predictor: Predictor, timed: Timed
    ) -> None:
        self.families = families
        self._goal = goal
        self.predictor = predictor
        self.timed = timed
        self._choices: dict[tuple[str, Sequence], Choice] = {}

    def without_budgets(self) -> "Search":
        """Return the search for the same targets, whatever they cost."""
        goal = replace(self._goal, capture_s=None, frame_rate_hz=None, computing_share=None)
        return Search(goal, self.families, self.predictor, self.timed)

    def choice(self, family: Family, member: Member, *, closely: bool = False) -> Choice:
        """Predict a member with many draws, and closely with many pixels, too."""
        applied = family.applied(member)
        key = (family.estimator, applied.sequence)
        if closely or key not in self._choices:
            sequence, goal, predictor = applied.sequence, self._goal, self.predictor
            distance_m = goal.separation_m
            self._choices[key] = Choice(
                applied,
                family.estimator,
                predictor.predict(family.estimator, sequence, closely=closely),
                predictor.beyond_scene(sequence),
                lambda: self.timed(sequence, family.estimator),
                predictor.bound_width(sequence) if goal.bound_width is not None else None,
                None if distance_m is None else predictor.separation(sequence, distance_m),
            )
        return self._choices[key]

    def quickest(self, targets: dict[str, float], *, contenders: int = CONTENDERS) -> Choice | None:
        """Return the choice within the budgets that reaches targets soonest; None without any.

        The families are searched with few draws, the best of them again with many. What few draws
        promised may take longer with many: then those that are to take less time are next.
        """
        seen: set[tuple[str, Sequence]] = set()
        best: Choice | None = None
        while True:
            limit_s = math.inf if best is None else best.applied.capture_s
            contending = self._contending(targets, seen, limit_s)[:contenders]
            if not contending:
                return best
            for each in contending:
                limit_s = math.inf if best is None else best.applied.capture_s
                best = self._borne_out(each, targets, limit_s) or best
            seen |= {(each.family.estimator, each.family.first) for each in contending}

    def _contending(
        self, targets: dict[str, float], seen: set[tuple[str, Sequence]], limit_s: float
    ) -> list[Found]:
        """Return the quickest member of each family by few draws, those near the quickest.

        None of families that were ``seen``, nor any that takes as long as a limit.
        """
        found: list[Found] = []
        best_s = math.inf
        for family, place in self._hopeful(targets):
            if family.members[place].capture_s > min(NEAR * best_s, limit_s):
                break
            if (family.estimator, family.first) in seen:
                continue
            if self._least_bias(family) > targets.get("range_error_m", math.inf):
                continue
            soonest = self._soonest(family, place, targets, NEAR * best_s)
            if soonest is not None and family.members[soonest].capture_s < limit_s:
                found.append(Found(family, soonest, 0.0))
                best_s = min(best_s, found[-1].member.capture_s)
        return sorted(found, key=lambda each: each.member.capture_s)

    def finest(
        self, leading: str, within_s: float = math.inf, *, contenders: int = CONTENDERS
    ) -> Choice | None:
        """Return the choice within the budgets, and a time, with the least error."""
        bounded = []
        for family in self.families:
            place = self._longest(family, within_s)
            if place is not None:
                bounded.append((self._least(family, place, leading), family, place))
        found: list[Found] = []
        worst = math.inf
        for least, family, place in sorted(bounded, key=lambda each: each[0]):
            if least > worst:
                break
            if leading == "range_error_m" and self._least_bias(family) > worst:
                continue
            found.append(Found(family, place, self._quick(family, place, leading)))
            worst = min(worst, NEAR * found[-1].error)
        found.sort(key=lambda each: (each.error, each.member.capture_s))
        choices = [self.choice(each.family, each.member) for each in found[:contenders]]
        return min(choices, key=lambda choice: choice.error(leading), default=None)

    def fronts(self, leading: str, progress: Progress | None = None) -> Iterator[list[Choice]]:
        """Yield the finest choices within rising times, without those that others beat.

        After each time the front so far, the last time the whole; the ends come first and then what
        is between, so that early ones show all of it coarsely.
        """
        progress = progress or Progress()
        shortest_s = self.families[0].members[0].capture_s
        longest_s = max(family.members[-1].capture_s for family in self.families)
        longest_s = min(max(LONGEST_S, shortest_s), longest_s)
        ratio = (longest_s / shortest_s) ** (1 / (ON_FRONT - 1))
        times_s = [shortest_s * ratio**k * (1 + 1e-9) for k in range(ON_FRONT)]
        choices = []
        for done, k in enumerate(_coarse_to_fine(ON_FRONT)):
            progress.at(done / ON_FRONT, f"captures of {times_s[k] * 1e3:.0f} ms")
            choice = self.finest(leading, times_s[k], contenders=1)
            if choice is not None:
                choices.append(choice)
            yield front(
                choices,
                cost=lambda choice: choice.applied.capture_s,
                error=lambda choice: choice.error(leading),
            )

    def lines(self, choices: list[Choice]) -> list[Line]:
        """Return noise and bias over time of every family that choices come from."""
        wanted = {_frequencies_of(choice.estimator, choice.applied.sequence) for choice in choices}
        lines = []
        for family in self.families:
            sequence = family.applied(family.members[0]).sequence
            if _frequencies_of(family.estimator, sequence) not in wanted:
                continue
            members = [each for each in family.members if each.capture_s <= LONGEST_S]
            points = [
                Point(
                    each.capture_s,
                    *self.predictor.quick(family.estimator, family.first, each.scale),
                )
                for each in members[:: max(1, len(members) // POINTS)]
            ]
            lines.append(Line(family.estimator, sequence, tuple(points)))
        return lines

    def _longest(self, family: Family, within_s: float = math.inf) -> int | None:
        """Return the place of the longest capture that the budgets and a time allow."""
        end = bisect.bisect_right(family.members, within_s, key=lambda each: each.capture_s)
        for place in range(end - 1, -1, -1):
            if self._affords(family, family.members[place]):
                return place
        return None

    def _affords(self, family: Family, member: Member) -> bool:
        goal = self._goal
        if not goal.affords_time(member.capture_s):
            return False
        if goal.computing_share is None:
            return True
        sequence = family.applied(member).sequence
        reconstruct_s = self.timed(sequence, family.estimator)
        share = None if reconstruct_s is None else reconstruct_s / member.capture_s
        return goal.affords_computing(share)

    def _hopeful(self, targets: dict[str, float]) -> list[tuple[Family, int]]:
        """Return families and the first member that may reach the targets, by its time."""
        hopeful = []
        for family in self.families:
            last = self._longest(family)
            if last is None:
                continue
            first = bisect.bisect_left(
                range(last + 1),
                x=True,
                key=partial(self._may_reach, family, targets),
            )
            if first <= last:
                hopeful.append((family, first))
        return sorted(hopeful, key=lambda each: each[0].members[each[1]].capture_s)

    def _may_reach(self, family: Family, targets: dict[str, float], place: int) -> bool:
        return all(self._least(family, place, name) <= limit for name, limit in targets.items())

    def _soonest(
        self, family: Family, first: int, targets: dict[str, float], within_s: float
    ) -> int | None:
        last = self._longest(family, within_s)
        if last is None:
            return None
        place = self._first_within(family, self._hoped(targets), first, last)
        if place is None or self._goal.computing_share is None:
            return place
        affords = (k for k in range(place, last + 1) if self._affords(family, family.members[k]))
        return next(affords, None)

    def _first_within(
        self, family: Family, limits: dict[str, float], first: int, last: int
    ) -> int | None:
        """Return the first place of these that few draws find within limits.

        The longer a capture, the less its noise; its bias may grow, as where the likelihood finds
        more returns the less noise there is. So errors fall to a least one, and may rise again.
        """
        if first > last:
            return None
        if not self._within(family, limits, last):
            if "range_error_m" not in limits:
                return None
            last = self._place_of_least_error(family, first, last)
            if not self._within(family, limits, last):
                return None
        places = range(first, last + 1)
        return first + bisect.bisect_left(places, x=True, key=partial(self._within, family, limits))

    def _place_of_least_error(self, family: Family, first: int, last: int) -> int:
        return min(
            range(first, last + 1), key=lambda place: self._quick(family, place, "range_error_m")
        )

    def _reaches(self, family: Family, place: int, targets: dict[str, float]) -> bool:
        return self._within(family, self._hoped(targets), place)

    @staticmethod
    def _hoped(targets: dict[str, float]) -> dict[str, float]:
        return {
            name: limit * (HOPE if name.startswith("range") else 1.0)
            for name, limit in targets.items()
        }

    def _least(self, family: Family, place: int, target: str) -> float:
        """Return what the noise of a member is at least; 0 where no bound is known."""
        if not target.startswith("range"):
            return 0.0
        scale = family.members[place].scale
        return self.predictor.least_noise_m(family.estimator, family.first, scale)

    def _least_bias(self, family: Family) -> float:
        return self.predictor.least_bias_m(family.estimator, family.first)

    def _quick(self, family: Family, place: int, target: str) -> float:
        member, predictor = family.members[place], self.predictor
        if target == "bound_width":
            return predictor.bound_width(family.applied(member).sequence)
        if target == "separation_m":
            assert self._goal.separation_m is not None  # noqa: S101 - it is a target
            sequence = family.applied(member).sequence
            return 1.0 - predictor.separation(sequence, self._goal.separation_m)
        std_m, _, error_m = predictor.quick(family.estimator, family.first, member.scale)
        return std_m if target == "range_std_m" else error_m

    def _borne_out(self, found: Found, targets: dict[str, float], limit_s: float) -> Choice | None:
        """Return the first member that many draws find to reach the targets, near one by few."""
        family, place = found.family, found.place
        failed, last = -1, len(family.members) - 1
        best: Choice | None = None
        for _ in range(_STEPS):
            member = family.members[place]
            if member.capture_s >= limit_s or not self._affords(family, member):
                break
            choice = self.choice(family, member)
            if _hangs_on_the_margin(choice, targets):
                choice = self.choice(family, member, closely=True)
            over = max(choice.error_with_margin(name) / limit for name, limit in targets.items())
            missed = max(choice.error(name) / limit for name, limit in targets.items())
            # few draws were wrong by that factor: on to where they predict as much less, or more;
            # where even the error is too large, the margin of few pixels says nothing
            wrong = max(missed if missed > 1 else over, _LEAST_WRONG)
            wanted = {name: self._quick(family, place, name) / wrong for name in targets}
            if over <= 1:
                best, last = choice, place - 1
            else:
                failed = place
            further = self._first_within(family, wanted, failed + 1, last)
            if further is None and best is None and failed < last:
                # few draws are not wrong about all by the same factor: the best by them is left
                further = last = self._place_of_least_error(family, failed + 1, last)
            if further is None:
                break
            place = further
        return best

    def _within(self, family: Family, limits: dict[str, float], place: int) -> bool:
        return all(self._quick(family, place, name) <= limit for name, limit in limits.items())


def _hangs_on_the_margin(choice: Choice, targets: dict[str, float]) -> bool:
    """Return whether a choice reaches all targets, but for the margin."""
    return all(choice.error(name) <= limit for name, limit in targets.items()) and any(
        choice.error_with_margin(name) > limit for name, limit in targets.items()
    )


def _coarse_to_fine(count: int) -> list[int]:
    """Return the places 0 to ``count`` - 1: the ends, then each time the middle of a widest gap."""
    order = [0, count - 1]
    while len(order) < count:
        gaps = itertools.pairwise(sorted(order))
        before, after = max(gaps, key=lambda gap: gap[1] - gap[0])
        order.append((before + after) // 2)
    return order


def _frequencies_of(estimator: str, sequence: Sequence) -> tuple[str, int, float, str]:
    return estimator, sequence.harmonics, sequence.base_frequency_hz, sequence.zeroth
