"""The search for the choice that reaches a goal soonest, or comes nearest to it.

A candidate is a sequence and an estimator. A bound on the error of one costs nothing; few draws
serve all that have its frequencies and its estimator; many draws are its own, and predict its
`Choice`. Bounds rule families out before any draw, few draws all but the contenders, and many draws
decide among these. The longer a capture, the less its noise; its bias may grow, as where the
likelihood finds more returns the less noise there is. So the errors of a family fall to a least
one, and may rise again.
"""

import bisect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final, NamedTuple

from transientcam_driver import AppliedSequence, Capabilities, Sequence
from transientcam_server.planning._prediction.measures import TOLERANCES_M, Figure
from transientcam_server.planning._prediction.prediction import Prediction, Predictor
from transientcam_server.planning._search.families import ComputingTime, Family, Goal, Member


def in_words(sequence: Sequence, estimator: str) -> str:
    """State a sequence and an estimator: frequencies, exposure, takes."""
    takes = f" x {sequence.takes}" if sequence.takes > 1 else ""
    return (
        f"m = {sequence.harmonics} at {sequence.base_frequency_hz / 1e6:g} MHz, "
        f"{sequence.exposure_s * 1e3:.3g} ms{takes}, {estimator}"
    )


@dataclass(frozen=True, slots=True)
class Choice:
    """A sequence, an estimator, and their predicted accuracy and cost.

    ``applied``: As the camera would set it.
    ``estimator``: What its range is taken from.
    ``predicted``: Errors of the range.
    ``beyond_scene``: Whether it sees more than the look that describes the scene, so that the
    prediction is a lower bound of the error.
    ``timed``: Returns the computing time of one frame in s, measured on demand; None where its
    kernels are not compiled yet.
    ``bound_width``, ``separation_share``: Predicted where the goal has them.
    ``settling_s``: Part of the capture in which the modulation settles.
    ``share``, ``target_m``: Of the pixels, and the error that so many are to be within; None where
    the goal has none.
    """

    applied: AppliedSequence
    estimator: str
    predicted: Prediction
    beyond_scene: bool
    timed: Callable[[], float | None] = field(compare=False)
    bound_width: float | None = None
    separation_share: float | None = None
    settling_s: float = 0.0
    share: float | None = None
    target_m: float | None = None

    @property
    def range_error(self) -> Figure:
        """The error that a target limits: of the share of the goal, or of the median pixel."""
        return self.predicted.within or self.predicted.range_error

    @property
    def computing_share(self) -> float | None:
        """Share of a core's time between two frames that goes into reconstruction, if known."""
        reconstruct_s = self.timed()
        return None if reconstruct_s is None else reconstruct_s * self.applied.frame_rate_hz

    @property
    def price(self) -> dict[str, float | None]:
        """What a capture takes and leaves, item by item, as JSON; transport is told by frames."""
        applied, computing_s = self.applied, self.timed()
        light_s = applied.images * applied.sequence.exposure_s
        return {
            "light_s": light_s,
            "readout_s": applied.capture_s - light_s - self.settling_s,
            "settling_s": self.settling_s,
            "transport_s": None,
            "computing_s": computing_s,
            "sum_s": applied.capture_s + (computing_s or 0.0),
            "light_share": light_s / applied.capture_s,
            "data_bytes": round(applied.data_rate_bytes_s * applied.capture_s),
        }

    def error(self, target: str) -> float:
        """Return the error that a target limits, as it is expected."""
        if target == "bound_width":
            return math.inf if self.bound_width is None else self.bound_width
        if target == "separation_m":
            return 1.0 if self.separation_share is None else 1.0 - self.separation_share
        figure = self.predicted.range_std if target == "range_std_m" else self.range_error
        return figure.median

    def error_with_margin(self, target: str) -> float:
        """Return what most of the captures stay below."""
        if target == "range_error_m":
            return self.range_error.with_margin
        if target == "range_std_m":
            return self.predicted.range_std.with_margin
        return self.error(target)

    def relative_errors(self, targets: Mapping[str, float]) -> tuple[float, float]:
        """Return the worst error, and the worst with margin, over the largest that targets allow.

        Targets are reached where the latter is 1 at most.
        """
        error, with_margin = (
            max((of(name) / max(limit, 1e-12) for name, limit in targets.items()), default=0.0)
            for of in (self.error, self.error_with_margin)
        )
        return error, with_margin

    def to_document(self) -> dict[str, Any]:
        """Return the choice as JSON; ``sequence`` is the body of a PUT."""
        document = self.applied.to_document()
        del document["sequence_id"]
        figure, target_m = self.predicted.within, self.target_m
        return {
            "sequence": self.applied.sequence.to_document(),
            "estimator": self.estimator,
            "applied": document,
            "capture_s": self.applied.capture_s,
            "frame_rate_hz": self.applied.frame_rate_hz,
            "reconstruct_s": self.timed(),
            "computing_share": self.computing_share,
            "price": self.price,
            "predicted": {
                "range_error_m": self.predicted.range_error.to_document(),
                "range_std_m": self.predicted.range_std.to_document(),
                "range_bias_m": self.predicted.range_bias_m,
                "range_bias_most_m": self.predicted.most_bias_m,
                "bias_known": self.predicted.bias_known,
                "within": figure
                and {
                    "share": self.share,
                    "error_m": figure.median,
                    **{end: figure.to_document()[end] for end in ("low", "high")},
                    "target_m": target_m,
                    "target_share": target_m and self.predicted.share_within(target_m),
                },
                "beyond": {
                    f"{each:g}": 1 - self.predicted.share_within(each)
                    for each in TOLERANCES_M
                    if self.predicted.off_m
                },
                "beyond_scene": self.beyond_scene,
                "bound_width": self.bound_width,
                "separation_share": self.separation_share,
            },
        }

    def in_words(self) -> str:
        """State the sequence and the estimator."""
        return in_words(self.applied.sequence, self.estimator)


Targets = Mapping[str, float]
"""The largest error that each target allows."""


@dataclass(slots=True, eq=False)
class Candidate:
    """One member of a family, with what is predicted of it for a goal."""

    family: Family
    member: Member
    """``family``, ``member``: frequencies and estimator; exposure and takes."""
    affordable: bool
    """Whether it is within the budgets of the search."""
    goal: Goal
    """Whose targets are predicted."""
    predictor: Predictor
    """Of the scene."""
    capabilities: Capabilities
    """Of the camera."""
    computing_s: ComputingTime
    _choice: Choice | None = None

    @property
    def capture_s(self) -> float:
        """Time of one capture."""
        return self.member.capture_s

    @property
    def applied(self) -> AppliedSequence:
        """As the camera would set it."""
        exposure_s, takes = self.member.exposure_s, self.member.takes
        return self.capabilities.apply(
            replace(self.family.first, exposure_s=exposure_s, takes=takes)
        )

    def least_error(self, target: str) -> float:
        """Return a lower bound of the error that a target limits; 0 where none is known."""
        return self.member.least_noise_m if target.startswith("range") else 0.0

    def range_errors_m(self) -> tuple[float, float, float]:
        """Return deviation, bias and error of the range, by few draws."""
        family = self.family
        return self.predictor.quick(family.estimator, family.first, self.member.scale)

    def error(self, target: str) -> float:
        """Return the error that a target limits, by few draws."""
        if target == "bound_width":
            return self.predictor.bound_width(self.applied.sequence)
        if target == "separation_m":
            assert self.goal.separation_m is not None  # noqa: S101 - it is a target
            distance_m = self.goal.separation_m
            return 1.0 - self.predictor.separation(self.applied.sequence, distance_m)
        std_m, _, error_m = self.range_errors_m()
        return std_m if target == "range_std_m" else error_m

    def choice(self, *, closely: bool = False) -> Choice:
        """Predict it by many draws, and ``closely`` for many pixels, too."""
        if self._choice is None or closely:
            applied, estimator, predictor = self.applied, self.family.estimator, self.predictor
            sequence, goal, width, share = applied.sequence, self.goal, None, None
            if goal.bound_width is not None:
                width = predictor.bound_width(sequence)
            if goal.separation_m is not None:
                share = predictor.separation(sequence, goal.separation_m)
            self._choice = Choice(
                applied,
                estimator,
                beyond_scene=predictor.beyond_scene(sequence),
                predicted=predictor.predict(
                    estimator, sequence, closely=closely, capture_s=applied.capture_s
                ),
                timed=partial(self.computing_s, sequence, estimator),
                bound_width=width,
                separation_share=share,
                settling_s=self.capabilities.settle_s * sequence.frequency_changes,
                share=goal.share,
                target_m=goal.range_error_m,
            )
        return self._choice


Curve = tuple[Candidate, ...]
"""The candidates of one family by rising time: noise falls along it, onto the bias."""


def curves(
    families: list[Family],
    goal: Goal,
    predictor: Predictor,
    capabilities: Capabilities,
    computing_s: ComputingTime,
) -> list[Curve]:
    """Return the candidates of each family; nothing is drawn yet.

    ``goal``: That of the families, or the one without its budgets.
    ``computing_s``: Returns the computing time of a frame in s, if it is known.
    """
    anyhow, of = not goal.budgets, (goal, predictor, capabilities, computing_s)
    return [
        tuple(Candidate(each, one, one.affordable or anyhow, *of) for one in each.members)
        for each in families
    ]


def longest(curve: Curve, within_s: float = math.inf) -> int | None:
    """Return the place of the longest candidate that the budgets and a time allow."""
    end = bisect.bisect_right(curve, within_s, key=lambda each: each.capture_s)
    return next((place for place in range(end - 1, -1, -1) if curve[place].affordable), None)


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
        if target == "range_error_m" and candidate.family.least_bias_m > worst:
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
        if curve[first].family.least_bias_m > targets.get("range_error_m", math.inf):
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
