"""The sequences that are searched: families of one set of frequencies and one estimator."""

import itertools
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

from transientcam_driver import AppliedSequence, Capabilities, Sequence, SequenceError
from transientcam_moments.comparisons import TECHNIQUES
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import listed
from transientcam_server.planning._prediction.prediction import OUTVOTED, Predictor
from transientcam_server.planning._scene.estimation import MOST_HARMONICS, SEARCHED
from transientcam_server.planning._search.goal import Goal
from transientcam_server.planning._search.pareto import front

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
    scale: float
    """Its noise over that of the predictor's nominal sequence."""


@dataclass(frozen=True, slots=True)
class Family:
    """Sequences of the same frequencies, by rising time, and the estimator of their range."""

    estimator: str
    first: Sequence
    members: tuple[Member, ...]
    capabilities: Capabilities

    def applied(self, member: Member) -> AppliedSequence:
        """Return a member as the camera would set it."""
        return self.capabilities.apply(
            replace(self.first, exposure_s=member.exposure_s, takes=member.takes)
        )


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


def families(goal: Goal, predictor: Predictor, capabilities: Capabilities) -> list[Family]:
    """Return what the camera can run that saturates nothing and is not ambiguous.

    Raises Problem ``target-unreachable`` where there is nothing, with the reason.
    """
    require_plannable(capabilities)
    longest_s = min(predictor.longest_exposure_s() * FILLED, capabilities.max_exposure_s)
    exposures_s = _exposures(goal, capabilities, longest_s)
    if not exposures_s:
        raise _nothing(
            goal, f"it saturates at more than {longest_s:.3g} s of exposure", "exposure_s"
        )
    unambiguous_m = _unambiguous_m(goal, capabilities, exposures_s[0])
    if not unambiguous_m:
        raise _nothing(goal, "the fixed fields exclude all", "fixed")
    scene = predictor.scene
    clear = [each for each, range_m in unambiguous_m.items() if not scene.ambiguous(range_m)]
    if not clear:
        far_m, most_m = float(scene.direct_m.max()), max(unambiguous_m.values())
        reason = f"it is up to {far_m:.1f} m away, and ranges are unambiguous to {most_m:.1f} m"
        raise _nothing(goal, reason, "base_frequency_hz")
    scales = {
        (each_s, zeroth): predictor.noise_scale(
            replace(goal.base, exposure_s=each_s, zeroth=zeroth, takes=1)
        )
        for each_s in exposures_s
        for zeroth in _zeroths(goal)
    }
    steady = _steady_takes(goal, scene.lost_share)
    found = [
        Family(estimator, sequence, members, capabilities)
        for sequence, estimator in clear
        if (members := _members(goal, sequence, scales, capabilities, steady))
    ]
    # short captures first: what they reach rules out most of the longer ones
    return sorted(found, key=lambda family: family.members[0].capture_s)


def _exposures(goal: Goal, capabilities: Capabilities, longest_s: float) -> list[float]:
    if "exposure_s" in goal.fixed:
        return [goal.base.exposure_s]
    if longest_s < capabilities.min_exposure_s:
        return []
    shortest_s = min(longest_s, max(SHORTEST_EXPOSURE_S, capabilities.min_exposure_s))
    ratio = (longest_s / shortest_s) ** (1 / (EXPOSURES - 1))
    return sorted({round(shortest_s * ratio**k, 9) for k in range(EXPOSURES)})


def _zeroths(goal: Goal) -> tuple[Any, ...]:
    if "zeroth" in goal.fixed:
        return (goal.base.zeroth,)
    # how b_0 is measured matters to the bounds alone: else the cheapest way
    if goal.bound_width is None:
        return ("estimated",)
    return ("estimated", "on-off", "low-frequency")


def _unambiguous_m(
    goal: Goal, capabilities: Capabilities, exposure_s: float
) -> dict[tuple[Sequence, str], float]:
    """Return the unambiguous range of all frequencies and estimators that the camera can run."""
    takes = goal.base.takes if "takes" in goal.fixed else 1
    ranges_m = {}
    for sequence, estimator in _frequencies(goal):
        with suppress(SequenceError):
            applied = capabilities.apply(replace(sequence, exposure_s=exposure_s, takes=takes))
            ranges_m[sequence, estimator] = applied.unambiguous_range_m
    return ranges_m


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
        least = TECHNIQUES[estimator].least_harmonics
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


def _members(
    goal: Goal,
    sequence: Sequence,
    scales: dict[tuple[float, str], float],
    capabilities: Capabilities,
    steady: tuple[int, ...],
) -> tuple[Member, ...]:
    images = sequence.images_per_take
    most_takes = min(capabilities.max_takes, capabilities.max_images // images)
    takes = steady if sequence.harmonics == 1 and steady[0] <= most_takes else TAKES
    takes = (goal.base.takes,) if "takes" in goal.fixed else takes
    settling_s = {
        each: capabilities.settle_s * replace(sequence, takes=each).frequency_changes
        for each in takes
    }
    members = []
    for (exposure_s, zeroth), scale in scales.items():
        if zeroth != sequence.zeroth:
            continue
        image_s = exposure_s + capabilities.streaming_readout_s
        members += [
            Member(exposure_s, each, each * images * image_s + settling_s[each], scale / each**0.5)
            for each in takes
            if each <= most_takes
        ]
    return tuple(front(members, cost=lambda each: each.capture_s, error=lambda each: each.scale))


def _nothing(goal: Goal, reason: str, field: str) -> Problem:
    return Problem(
        kinds.TARGET_UNREACHABLE,
        f"No sequence that this camera can run suits the scene: {reason}.",
        field=field,
        value=sorted(goal.fixed),
        best=None,
    )
