"""From a target accuracy or a budget of time to a sequence.

Every sequence of a grid is predicted; of those within the budgets that reach the targets the one
with the shortest capture is recommended, or, without a target, the most accurate one. Beside it
stand its two neighbours on the Pareto front: what half the time gives, and what twice the accuracy
costs.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final, Literal

from transientcam_driver import AppliedSequence, Capabilities, Sequence, SequenceError
from transientcam_server import problem_kinds as kinds
from transientcam_server.errors import Problem
from transientcam_server.prediction import Deviation, Predictor
from transientcam_server.tradeoff.pareto import front

HARMONICS: Final = (1, 2, 3, 4, 5, 6, 8)
TAKES: Final = (1, 2, 3, 4, 6, 8, 12, 16, 20, 30, 40, 64, 100)
ZEROTHS: Final[tuple[Literal["estimated", "on-off", "low-frequency"], ...]] = (
    "estimated",
    "on-off",
    "low-frequency",
)
EXPOSURES: Final = 12
"""How many exposures are tried between the shortest and the longest sensible one."""
SHORTEST_EXPOSURE_S: Final = 2e-4
"""Shorter ones save nothing beside a read-out of 4 ms."""
RESOLVED_M: Final = 1e-3
"""Less bias than that is none."""
MARGIN: Final = 0.9
"""Of the exposure that saturates bright pixels."""


@dataclass(frozen=True, slots=True)
class Goal:
    """What is wanted.

    Attributes
    ----------
    range_std_m
        Standard deviation of the range of a typical pixel, at most.
    separation_m
        Distance at which two equal returns are both to be found in `separation_share` of all
        captures.
    bound_width
        Width of the bounds on the density over the mean density, at most.
    capture_s
        Time of one capture, at most.
    frame_rate_hz
        Frames a second back to back, at least.
    computing_share
        Share of the time between two frames that reconstruction may take on this machine.
    base
        Sequence whose base frequency, or half of it, is used, and its sub-phases.
    fixed
        Names of its fields that are not to be chosen either.
    """

    range_std_m: float | None = None
    separation_m: float | None = None
    separation_share: float = 0.9
    bound_width: float | None = None
    capture_s: float | None = None
    frame_rate_hz: float | None = None
    computing_share: float | None = None
    base: Sequence = field(default_factory=Sequence)
    fixed: frozenset[str] = frozenset()

    @property
    def empty(self) -> bool:
        """Whether neither a target nor a budget is given."""
        return all(getattr(self, name) is None for name in (*TARGETS, *BUDGETS))

    @property
    def leading(self) -> str:
        """The target that neighbours are compared by."""
        return next((name for name in TARGETS if getattr(self, name) is not None), TARGETS[0])


TARGETS: Final = ("range_std_m", "separation_m", "bound_width")
BUDGETS: Final = ("capture_s", "frame_rate_hz", "computing_share")


@dataclass(frozen=True, slots=True)
class Choice:
    """A sequence and what is predicted of it.

    Attributes
    ----------
    applied
        As the camera would set it.
    reconstruct_s
        Computing time of one frame.
    range_std
        Predicted deviation of the range.
    range_bias_m
        How far the range of the median pixel is off without any noise.
    resolves
        Whether noise is what limits the range, and not returns that are taken for one.
    beyond_scene
        Whether it sees more than what the scene was judged by, so that the prediction is a bound
        on how good it can be.
    range_std_interval
        Gives where that of a typical pixel lies with 95 %; computed when it is asked for.
    bound_width, separation_share
        Predicted where they were asked for.
    """

    applied: AppliedSequence
    reconstruct_s: float
    range_std: Deviation
    range_bias_m: float
    resolves: bool
    beyond_scene: bool
    range_std_interval: Callable[[], tuple[float, float]] = field(compare=False)
    bound_width: float | None = None
    separation_share: float | None = None

    @property
    def computing_share(self) -> float:
        """Share of the time between two frames that goes into reconstruction."""
        return self.reconstruct_s * self.applied.frame_rate_hz

    def error(self, target: str) -> float:
        """Return the error that a target limits, the less the better."""
        if target == "bound_width":
            return math.inf if self.bound_width is None else self.bound_width
        if target == "separation_m":
            return 1.0 if self.separation_share is None else 1.0 - self.separation_share
        return self.range_std.median_m

    def to_document(self) -> dict[str, Any]:
        """Return the choice as JSON has it; ``sequence`` is the body of a PUT."""
        document = self.applied.to_document()
        del document["sequence_id"]
        std = self.range_std
        low_m, high_m = self.range_std_interval()
        return {
            "sequence": self.applied.sequence.to_document(),
            "applied": document,
            "capture_s": self.applied.capture_s,
            "frame_rate_hz": self.applied.frame_rate_hz,
            "reconstruct_s": self.reconstruct_s,
            "computing_share": self.computing_share,
            "predicted": {
                "range_std_m": {
                    "median": std.median_m,
                    "low": low_m,
                    "high": high_m,
                    "p90": std.p90_m,
                },
                "range_bias_m": self.range_bias_m,
                "beyond_scene": self.beyond_scene,
                "first_order_share": std.first_order_share,
                "bound_width": self.bound_width,
                "separation_share": self.separation_share,
            },
        }


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
    _check(goal)
    choices = candidates(goal, predictor, capabilities, reconstruct_s=reconstruct_s)
    affordable = [choice for choice in choices if _within(goal, choice)]
    if not affordable:
        raise _unaffordable(goal, choices)
    reached = [choice for choice in affordable if _reaches(goal, choice)]
    if not reached:
        raise _unreachable(goal, affordable)
    leading = goal.leading
    if any(getattr(goal, name) is not None for name in TARGETS):
        best = min(reached, key=lambda each: (each.applied.capture_s, each.error(leading)))
    else:
        best = min(reached, key=lambda each: (each.error(leading), each.applied.capture_s))
    return Plan(best, *_neighbours(best, choices, leading), leading)


def candidates(
    goal: Goal,
    predictor: Predictor,
    capabilities: Capabilities,
    *,
    reconstruct_s: Callable[[Sequence], float],
) -> list[Choice]:
    """Predict every sequence of the grid that the camera can run and that saturates nothing.

    Those that would take several returns of the scene for one are left out, as long as others
    are there.
    """
    longest_s = predictor.longest_exposure_s() * MARGIN
    # what noise made of the scene's own ranges is no bias
    known_m = 2 * predictor.scene.range_std_m
    chosen = []
    for sequence in _grid(goal, capabilities, longest_s):
        try:
            applied = capabilities.apply(sequence)
        except SequenceError:
            continue
        if predictor.scene.furthest_m >= applied.unambiguous_range_m:
            continue
        if sequence.harmonics < predictor.least_harmonics:
            continue
        separation = goal.separation_m
        range_std, bias_m = predictor.range_std(sequence), predictor.range_bias_m(sequence)
        chosen.append(
            Choice(
                applied,
                reconstruct_s(sequence),
                range_std,
                bias_m,
                bias_m <= max(range_std.median_m / 2, known_m, RESOLVED_M),
                predictor.beyond_scene(sequence),
                partial(predictor.range_std_interval, sequence),
                predictor.bound_width(sequence) if goal.bound_width is not None else None,
                None if separation is None else predictor.separation(sequence, separation),
            )
        )
    if not chosen:
        raise Problem(
            kinds.TARGET_UNREACHABLE,
            "No sequence that this camera can run suits the scene: it is too bright for the "
            "shortest exposure, further than the unambiguous range, or the fixed fields exclude "
            "all.",
            field="fixed",
            value=sorted(goal.fixed),
            best=None,
        )
    resolving = [choice for choice in chosen if choice.resolves]
    # a fixed number of harmonics is what the caller wants, whatever it cannot tell apart
    return resolving if resolving and "harmonics" not in goal.fixed else chosen


def choices_on_front(choices: list[Choice], leading: str = TARGETS[0]) -> list[Choice]:
    """Return those that no other beats in both time and accuracy."""
    return front(
        choices,
        cost=lambda choice: choice.applied.capture_s,
        error=lambda choice: choice.error(leading),
    )


def _grid(goal: Goal, capabilities: Capabilities, longest_s: float) -> Iterator[Sequence]:
    base = goal.base
    longest_s = min(longest_s, capabilities.max_exposure_s)
    if longest_s < capabilities.min_exposure_s:
        return
    shortest_s = min(longest_s, max(SHORTEST_EXPOSURE_S, capabilities.min_exposure_s))
    ratio = (longest_s / shortest_s) ** (1 / (EXPOSURES - 1))
    exposures_s = sorted({round(shortest_s * ratio**k, 9) for k in range(EXPOSURES)})
    choices: dict[str, tuple[Any, ...]] = {
        "harmonics": HARMONICS,
        "zeroth": ZEROTHS,
        "takes": TAKES,
        "exposure_s": tuple(exposures_s),
        "base_frequency_hz": (base.base_frequency_hz, base.base_frequency_hz / 2),
    }
    for name in goal.fixed & choices.keys():
        choices[name] = (getattr(base, name),)
    if goal.bound_width is None:
        # how b_0 is measured tells nothing of returns: the cheapest way is always on the front
        choices["zeroth"] = choices["zeroth"][:1]
    for values in itertools.product(*choices.values()):
        yield replace(base, **dict(zip(choices, values, strict=True)))


def _within(goal: Goal, choice: Choice) -> bool:
    return (
        (goal.capture_s is None or choice.applied.capture_s <= goal.capture_s)
        and (goal.frame_rate_hz is None or choice.applied.frame_rate_hz >= goal.frame_rate_hz)
        and (goal.computing_share is None or choice.computing_share <= goal.computing_share)
    )


def _limit(goal: Goal, target: str) -> float:
    """Largest error that a target allows."""
    if target == "separation_m":
        return 1.0 - goal.separation_share
    return float(getattr(goal, target))


def _reaches(goal: Goal, choice: Choice) -> bool:
    return all(
        choice.error(target) <= _limit(goal, target)
        for target in TARGETS
        if getattr(goal, target) is not None
    )


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


def _check(goal: Goal) -> None:
    if goal.empty:
        raise Problem(
            kinds.INVALID_REQUEST,
            "Give a target or a budget.",
            field="target",
            value=None,
            limit=f"at least one of {', '.join((*TARGETS, *BUDGETS))}",
        )
    for name in (*TARGETS, *BUDGETS):
        value = getattr(goal, name)
        if value is not None and not 0 < value < math.inf:
            raise Problem(
                kinds.INVALID_REQUEST,
                f"{name} = {value!r} must be a number above 0.",
                field=name,
                value=value,
                limit="a number above 0",
            )
    if not 0 < goal.separation_share < 1:
        raise Problem(
            kinds.INVALID_REQUEST,
            f"separation_share = {goal.separation_share!r} must be between 0 and 1.",
            field="separation_share",
            value=goal.separation_share,
            limit="between 0 and 1",
        )


def _unaffordable(goal: Goal, choices: list[Choice]) -> Problem:
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
        if wanted is not None and not _within(Goal(**{budget: wanted}), best):
            return _refusal(budget, wanted, value, best)
    # each by itself is enough, but no sequence keeps all of them
    budget = next(name for name in BUDGETS if getattr(goal, name) is not None)
    best, value = least[budget]
    return _refusal(budget, getattr(goal, budget), value, best, together=True)


def _unreachable(goal: Goal, affordable: list[Choice]) -> Problem:
    """Say which target is out of reach, and the best that the budgets allow."""
    for target in TARGETS:
        wanted = getattr(goal, target)
        if wanted is None:
            continue
        best = min(affordable, key=lambda each, target=target: each.error(target))  # type: ignore[misc] # mypy cannot infer a lambda with a default
        if best.error(target) > _limit(goal, target):
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
