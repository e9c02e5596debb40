"""The candidates of a plan: a sequence and an estimator each, predicted when that is asked for.

A bound on the error of one costs nothing; few draws serve all that have its frequencies and its
estimator; many draws are its own, and predict its `Choice`.
"""

import bisect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from transientcam_driver import Sequence
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.families import Family, Member
from transientcam_server.planning._search.goal import Goal

Targets = Mapping[str, float]
"""The largest error that each target allows."""
ComputingTime = Callable[[Sequence, str], float | None]
"""Computing time in s of a frame of a sequence with an estimator, if it is known."""


@dataclass(slots=True, eq=False)
class Candidate:
    """One member of a family, with what is predicted of it for a goal."""

    family: Family
    member: Member
    """``family``, ``member``: frequencies and estimator; exposure and takes."""
    affordable: bool
    """Whether it is within the budgets of the goal."""
    goal: Goal
    """Whose targets are predicted."""
    predictor: Predictor
    """Of the scene."""
    reconstruct_s: Callable[[], float | None]
    """Returns the computing time of a frame in s, if it is known."""
    _choice: Choice | None = None

    @property
    def capture_s(self) -> float:
        """Time of one capture."""
        return self.member.capture_s

    @property
    def sequence(self) -> Sequence:
        """As the camera would set it."""
        return self.family.applied(self.member).sequence

    def least_bias_m(self) -> float:
        """Return what the bias of its family hardly falls below."""
        return self.predictor.least_bias_m(self.family.estimator, self.family.first)

    def least_error(self, target: str) -> float:
        """Return a lower bound of the error that a target limits; 0 where none is known."""
        if not target.startswith("range"):
            return 0.0
        family = self.family
        return self.predictor.least_noise_m(family.estimator, family.first, self.member.scale)

    def range_errors_m(self) -> tuple[float, float, float]:
        """Return deviation, bias and error of the range, by few draws."""
        family = self.family
        return self.predictor.quick(family.estimator, family.first, self.member.scale)

    def error(self, target: str) -> float:
        """Return the error that a target limits, by few draws."""
        if target == "bound_width":
            return self.predictor.bound_width(self.sequence)
        if target == "separation_m":
            assert self.goal.separation_m is not None  # noqa: S101 - it is a target
            return 1.0 - self.predictor.separation(self.sequence, self.goal.separation_m)
        std_m, _, error_m = self.range_errors_m()
        return std_m if target == "range_std_m" else error_m

    def choice(self, *, closely: bool = False) -> Choice:
        """Predict it by many draws, and ``closely`` for many pixels, too."""
        if closely or self._choice is None:
            self._choice = self._predicted(closely=closely)
        return self._choice

    def _predicted(self, *, closely: bool) -> Choice:
        applied = self.family.applied(self.member)
        sequence, estimator = applied.sequence, self.family.estimator
        bounded, distance_m = self.goal.bound_width is not None, self.goal.separation_m
        return Choice(
            applied,
            estimator,
            self.predictor.predict(
                estimator, sequence, closely=closely, capture_s=applied.capture_s
            ),
            self.predictor.beyond_scene(sequence),
            self.reconstruct_s,
            self.predictor.bound_width(sequence) if bounded else None,
            None if distance_m is None else self.predictor.separation(sequence, distance_m),
            self.family.capabilities.settle_s * sequence.frequency_changes,
            self.goal.share,
            self.goal.range_error_m,
        )


Curve = tuple[Candidate, ...]
"""The candidates of one family by rising time: noise falls along it, onto the bias."""


def curves(
    families: list[Family], goal: Goal, predictor: Predictor, computing_s: ComputingTime
) -> list[Curve]:
    """Return the candidates of each family; nothing is predicted yet."""

    def candidate(family: Family, member: Member) -> Candidate:
        def reconstruct_s() -> float | None:
            return computing_s(family.applied(member).sequence, family.estimator)

        affordable = goal.affords(member.capture_s, reconstruct_s)
        return Candidate(family, member, affordable, goal, predictor, reconstruct_s)

    return [tuple(candidate(family, each) for each in family.members) for family in families]


def longest(curve: Curve, within_s: float = math.inf) -> int | None:
    """Return the place of the longest candidate that the budgets and a time allow."""
    end = bisect.bisect_right(curve, within_s, key=lambda each: each.capture_s)
    return next((place for place in range(end - 1, -1, -1) if curve[place].affordable), None)
