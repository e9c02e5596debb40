"""The grid of sequences that are tried, each with its prediction."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, Final, Literal

from transientcam_driver import Capabilities, Sequence, SequenceError
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.planning.choice import Choice
from transientcam_server.planning.goal import Goal
from transientcam_server.planning.prediction import Predictor

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
"""A smaller bias counts as none."""
MARGIN: Final = 0.9
"""Of the exposure that saturates bright pixels."""


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
    # noise in the scene's own ranges is no bias
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
    # a fixed number of harmonics is kept, even if it cannot resolve the returns
    return resolving if resolving and "harmonics" not in goal.fixed else chosen


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
        # the way b_0 is measured does not affect returns: the cheapest one is always on the front
        choices["zeroth"] = choices["zeroth"][:1]
    for values in itertools.product(*choices.values()):
        yield replace(base, **dict(zip(choices, values, strict=True)))
