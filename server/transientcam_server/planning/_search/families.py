"""What is searched: goals, and families of sequences for them."""

import itertools
import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from operator import attrgetter
from typing import Any, Final, NamedTuple

from transientcam_driver import Capabilities, Sequence, SequenceError
from transientcam_moments.comparisons import PLUGINS, technique_of
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import listed
from transientcam_server.planning._prediction.prediction import OUTVOTED, Predictor
from transientcam_server.planning._scene.estimation import ESTIMATORS, MOST_HARMONICS, SEARCHED
from transientcam_server.planning._scene.scene import Region
from transientcam_server.planning._search.pareto import front

TARGETS: Final = ("range_error_m", "range_std_m", "separation_m", "bound_width")
"""Accuracies that a goal may limit; choices are compared by the first by default."""
SHARE: Final = 0.9
"""Of the pixels that are to be within a target; a capture has two of three within the error of the
median pixel."""
BUDGETS: Final = ("capture_s", "frame_rate_hz", "computing_share")


@dataclass(frozen=True, slots=True)
class Goal:
    """Targets and budgets of a sequence.

    ``range_error_m``: How far the range is off, noise and bias together, at most.
    ``share``: Of the pixels of a capture whose ranges are to be within it; None for the error of
    the median pixel, over many captures.
    ``region``: Whose lit pixels count; None for all of the picture.
    ``range_std_m``: Standard deviation of the range of a typical pixel, at most.
    ``separation_m``: Distance at which two equal returns are both to be found in `separation_share`
    of all captures.
    ``bound_width``: Width of the bounds on the density over the mean density, at most.
    ``capture_s``: Time of one capture, at most.
    ``frame_rate_hz``: Frames a second back to back, at least.
    ``computing_share``: Share of the time between two frames that reconstruction may take on this
    machine.
    ``base``: Sequence whose base frequency, half of it or a multiple, is used, and its sub-phases.
    ``fixed``: Names of further fields of it that must stay.
    ``estimator``: The only one that is planned with, ours or another package's; None for any of
    ours. Raises Problem ``invalid-request`` where there is none of that name.
    """

    range_error_m: float | None = None
    share: float | None = SHARE
    region: Region | None = None
    range_std_m: float | None = None
    separation_m: float | None = None
    separation_share: float = 0.9
    bound_width: float | None = None
    capture_s: float | None = None
    frame_rate_hz: float | None = None
    computing_share: float | None = None
    base: Sequence = field(default_factory=Sequence)
    fixed: frozenset[str] = frozenset()
    estimator: str | None = None

    def __post_init__(self) -> None:
        """Refuse an estimator that nothing is predicted with."""
        known = None, *ESTIMATORS, *PLUGINS.names()
        if self.estimator not in known:
            limit = f"one of {', '.join(map(str, known[1:]))}"
            told = {"field": "estimator", "value": self.estimator, "limit": limit}
            raise Problem(kinds.INVALID_REQUEST, f"estimator must be {limit}.", **told)

    @property
    def leading(self) -> str:
        """The target that neighbours are compared by."""
        return next(iter(self.targets), TARGETS[0])

    @property
    def limits(self) -> dict[str, float]:
        """The largest error that each target allows."""
        limits = {name: float(getattr(self, name)) for name in self.targets}
        if "separation_m" in limits:
            limits["separation_m"] = 1.0 - self.separation_share
        return limits

    @property
    def targets(self) -> tuple[str, ...]:
        """The targets that are given."""
        return tuple(name for name in TARGETS if getattr(self, name) is not None)

    @property
    def budgets(self) -> tuple[str, ...]:
        """The budgets that are given."""
        return tuple(name for name in BUDGETS if getattr(self, name) is not None)

    def without_budgets(self) -> "Goal":
        """Return the goal of the same targets, whatever they cost."""
        return replace(self, capture_s=None, frame_rate_hz=None, computing_share=None)

    def affords(self, capture_s: float, computing_s: Callable[[], float | None]) -> bool:
        """Return whether captures of this length, back to back, are within the budgets.

        ``computing_s`` returns the computing time of a frame, if it is known; it is called where
        that is limited.
        """
        if self.capture_s is not None and capture_s > self.capture_s:
            return False
        if self.frame_rate_hz is not None and capture_s * self.frame_rate_hz > 1 + 1e-9:
            return False
        if self.computing_share is None:
            return True
        reconstruct_s = computing_s()
        return reconstruct_s is not None and reconstruct_s / capture_s <= self.computing_share

    def require_sensible(self) -> None:
        """Refuse a goal without target or budget, or with a value out of bounds.

        Raises Problem: ``invalid-request``.
        """
        if not (*self.targets, *self.budgets):
            raise Problem(
                kinds.INVALID_REQUEST,
                "Give a target or a budget.",
                field="target",
                value=None,
                limit=f"at least one of {', '.join((*TARGETS, *BUDGETS))}",
            )
        positive = [(name, math.inf, "a number above 0") for name in (*TARGETS, *BUDGETS)]
        shares = [(name, 1.0, "between 0 and 1") for name in ("share", "separation_share")]
        for name, most, limit in [*positive, *shares]:
            value = getattr(self, name)
            if value is not None and not 0 < value < most:
                detail = f"{name} = {value!r} must be {limit}."
                raise Problem(kinds.INVALID_REQUEST, detail, field=name, value=value, limit=limit)


FREQUENCY_FACTORS: Final = (1.0, 2.0, 3.0, 0.5)
"""Base frequencies that are tried, over the one wanted."""
HARMONICS: Final = (1, 2, 3, 4, 6, 8, 12)
TAKES: Final = (1, 2, 3, 4, 6, 8, 12, 16, 20, 30, 40, 64, 100)
EXPOSURES: Final = 20
"""How many exposures are tried between the shortest and the longest sensible one."""
SHORTEST_EXPOSURE_S: Final = 2e-4
"""Shorter ones save nothing beside a read-out of 4 ms."""
FILLED: Final = 0.9
"""Of the exposure that saturates bright pixels."""


@dataclass(frozen=True, slots=True)
class Member:
    """One sequence of a family: the longer it takes, the less noise it has."""

    exposure_s: float
    takes: int
    """``exposure_s``, ``takes``: in what it differs from the others of its family."""
    capture_s: float
    """Time of one capture."""
    affordable: bool
    """Whether it is within the budgets of the goal."""
    scale: float
    """Its noise over that of the predictor's nominal sequence."""
    least_noise_m: float
    """Which its noise does not fall below."""


@dataclass(frozen=True, slots=True)
class Family:
    """Sequences of the same frequencies, by rising time, and the estimator of their range."""

    estimator: str
    first: Sequence
    members: tuple[Member, ...]
    least_bias_m: float
    """Which the range error of none hardly falls below; 0 of a goal that does not limit that."""


ComputingTime = Callable[[Sequence, str], float | None]
"""Computing time in s of a frame of a sequence with an estimator, if it is known."""


def require_plannable(capabilities: Capabilities) -> None:
    """Refuse a camera whose captures are not predicted.

    Raises Problem ``target-unreachable``, for other multiples than 1 to m or another number of
    phases than 4.
    """
    sampling = capabilities.sampling
    if sampling.consecutive and len(sampling.phases_rad) == 4:
        return
    multiples = "1 to m" if sampling.consecutive else listed(sampling.multiples)
    raise Problem(
        kinds.TARGET_UNREACHABLE,
        "Plans are made for the multiples 1 to m of one frequency at 4 phases, and this camera "
        f"measures the multiples {multiples} at {len(sampling.phases_rad)}. What an exposure and "
        "takes give is in the product range_std of its frames.",
        field="sampling",
        value=sampling.to_document(),
        best=None,
    )


def families(
    goal: Goal,
    predictor: Predictor,
    capabilities: Capabilities,
    computing_s: ComputingTime = lambda *_: None,
) -> list[Family]:
    """Return what the camera can run that saturates nothing and is not ambiguous.

    It is plain data, with all that is known of it without a draw. ``computing_s`` is asked where
    the goal limits it.
    Raises Problem ``target-unreachable`` where there is nothing, with the reason.
    """
    require_plannable(capabilities)
    scene = predictor.scene
    longest_s = min(predictor.longest_exposure_s * FILLED, capabilities.max_exposure_s)
    exposures_s = _exposures(goal, capabilities, longest_s)
    if not exposures_s:
        raise _nothing(
            goal, f"it saturates at more than {longest_s:.3g} s of exposure", "exposure_s"
        )
    steady = _steady_takes(goal, scene.lost_share)
    least_takes = goal.base.takes if "takes" in goal.fixed else 1
    grids = []
    for sequence, estimator in _frequencies(goal):
        with suppress(SequenceError):
            tried = replace(sequence, exposure_s=exposures_s[0], takes=least_takes)
            range_m = capabilities.apply(tried).unambiguous_range_m
            how = estimator, exposures_s, capabilities, steady, computing_s
            grids.append((sequence, estimator, range_m, _grid(goal, sequence, *how)))
    if not grids:
        raise _nothing(goal, "the fixed fields exclude all", "fixed")
    # short captures first: what they reach rules out most of the longer ones
    grids.sort(key=lambda each: min(setting.capture_s for setting in each[-1]))
    clear = [each for each in grids if not scene.ambiguous(each[2])]
    if not clear:
        far_m, most_m = float(scene.direct_m.max()), max(each[2] for each in grids)
        reason = f"it is up to {far_m:.1f} m away, and ranges are unambiguous to {most_m:.1f} m"
        raise _nothing(goal, reason, "base_frequency_hz")
    found, biased = [], goal.leading == "range_error_m"
    for sequence, estimator, _, grid in clear:
        columns = tuple(zip(*grid, strict=True))
        of = estimator, sequence, (columns[0], columns[1])
        scales, noise_m, bias_m = predictor.bounds(*of, biased=biased)
        members = map(Member, *columns, scales, noise_m)
        best = front(members, cost=attrgetter("capture_s"), error=attrgetter("scale"))
        found.append(Family(estimator, sequence, tuple(best), bias_m))
    return found


def _exposures(goal: Goal, capabilities: Capabilities, longest_s: float) -> list[float]:
    if "exposure_s" in goal.fixed:
        return [goal.base.exposure_s]
    if longest_s < capabilities.min_exposure_s:
        return []
    shortest_s = min(longest_s, max(SHORTEST_EXPOSURE_S, capabilities.min_exposure_s))
    ratio = (longest_s / shortest_s) ** (1 / (EXPOSURES - 1))
    least_s, most_s = capabilities.min_exposure_s, capabilities.max_exposure_s
    rounded_s = (round(shortest_s * ratio**k, 9) for k in range(EXPOSURES))
    return sorted({min(max(each_s, least_s), most_s) for each_s in rounded_s})


def _zeroths(goal: Goal) -> tuple[Any, ...]:
    if "zeroth" in goal.fixed:
        return (goal.base.zeroth,)
    # how b_0 is measured matters to the bounds alone: else the cheapest way
    if goal.bound_width is None:
        return ("estimated",)
    return ("estimated", "on-off", "low-frequency")


def _frequencies(goal: Goal) -> Iterator[tuple[Sequence, str]]:
    base = goal.base
    fixed = goal.fixed
    frequencies_hz = [factor * base.base_frequency_hz for factor in FREQUENCY_FACTORS]
    if "base_frequency_hz" in fixed:
        frequencies_hz = [base.base_frequency_hz]
    harmonics = (base.harmonics,) if "harmonics" in fixed else HARMONICS
    estimators = SEARCHED if goal.estimator is None else (goal.estimator,)
    for estimator, m, frequency_hz, zeroth in itertools.product(
        estimators, harmonics, frequencies_hz, _zeroths(goal)
    ):
        most = MOST_HARMONICS.get(estimator, m)
        # with one harmonic all estimators take its phase
        plain = m == 1 and estimator != "single-frequency" and goal.estimator is None
        least = technique_of(estimator).least_harmonics
        if m < least or plain or (m > most and "harmonics" not in fixed):
            continue
        yield replace(base, harmonics=m, base_frequency_hz=frequency_hz, zeroth=zeroth), estimator


def _steady_takes(goal: Goal, lost_share: float) -> tuple[int, ...]:
    """Return how many takes of one frequency suit a camera that loses so many of its images.

    Fewer than `OUTVOTED` are spoilt by each: not where more captures hold one than may miss a goal.
    """
    whole = [(1 - lost_share) ** (4 * each) for each in TAKES]
    least = 0.5 if goal.share is None else goal.share
    return tuple(
        each for each, of in zip(TAKES, whole, strict=True) if each >= OUTVOTED or of >= least
    )


class _Setting(NamedTuple):
    exposure_s: float
    takes: int
    capture_s: float
    affordable: bool


def _grid(
    goal: Goal,
    sequence: Sequence,
    estimator: str,
    exposures_s: list[float],
    capabilities: Capabilities,
    steady: tuple[int, ...],
    computing_s: ComputingTime,
) -> list[_Setting]:
    images = sequence.images_per_take
    most_takes = min(capabilities.max_takes, capabilities.max_images // images)
    takes = steady if sequence.harmonics == 1 and steady[0] <= most_takes else TAKES
    takes = (goal.base.takes,) if "takes" in goal.fixed else takes
    several = [replace(sequence, takes=each) for each in takes if each <= most_takes]
    settling_s = [capabilities.settle_s * each.frequency_changes for each in several]
    found = []
    for exposure_s in exposures_s:
        image_s = exposure_s + capabilities.streaming_readout_s
        for each, settle_s in zip(several, settling_s, strict=True):
            capture_s = each.takes * images * image_s + settle_s
            affordable = goal.affords(capture_s, partial(computing_s, each, estimator))
            found.append(_Setting(exposure_s, each.takes, capture_s, affordable))
    return found


def _nothing(goal: Goal, reason: str, field: str) -> Problem:
    return Problem(
        kinds.TARGET_UNREACHABLE,
        f"No sequence that this camera can run suits the scene: {reason}.",
        field=field,
        value=sorted(goal.fixed),
        best=None,
    )
