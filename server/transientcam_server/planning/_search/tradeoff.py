"""The front of all that no other beats, and the lines that its choices lie on."""

import itertools
from collections.abc import Iterator
from typing import Any, Final

from transientcam_driver import Sequence
from transientcam_server.planning._process.queue import Progress
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.planning._search.pareto import front
from transientcam_server.planning._search.search import Choice, Curve, finest
from transientcam_server.planning._search.words import summary_of_front

ON_FRONT: Final = 12
"""Times that the front is made of."""
LONGEST_S: Final = 5.0
"""The longest of them."""
POINTS: Final = 8
"""At most twice as many make a line."""


def fronts(
    curves: list[Curve], leading: str, progress: Progress | None = None
) -> Iterator[list[Choice]]:
    """Yield the finest choices within rising times, without those that others beat.

    After each time the front so far, the last time the whole; the ends come first and then what
    is between, so that early ones show all of it coarsely.
    """
    progress = progress or Progress()
    times_s = _times_s(curves)
    choices = []
    for done, k in enumerate(_coarse_to_fine(ON_FRONT)):
        progress.at(done / ON_FRONT, f"captures of {times_s[k] * 1e3:.0f} ms")
        choice = finest(curves, leading, times_s[k], contenders=1)
        if choice is not None:
            choices.append(choice)
        yield front(
            choices,
            cost=lambda choice: choice.applied.capture_s,
            error=lambda choice: choice.error(leading),
        )


def lines(curves: list[Curve], choices: list[Choice]) -> list[dict[str, Any]]:
    """Return how noise falls onto the bias over time, as JSON, in families that choices are of."""
    chosen = {_frequencies(each.estimator, each.applied.sequence) for each in choices}
    return [
        _line(curve)
        for curve in curves
        if _frequencies(curve[0].family.estimator, curve[0].applied.sequence) in chosen
    ]


def tradeoff_document(
    choices: list[Choice], through: list[dict[str, Any]], scene: SceneStatistics
) -> dict[str, Any]:
    """Return a front, and the lines through it, as JSON."""
    return {
        "front": [choice.to_document() for choice in choices],
        "lines": through,
        "summary": summary_of_front(choices, scene),
    }


def _line(curve: Curve) -> dict[str, Any]:
    """Return the predicted errors in m of the median pixel by the length of captures."""
    names = "capture_s", "range_std_m", "range_bias_m", "range_error_m"
    shown = [each for each in curve if each.capture_s <= LONGEST_S]
    shortest = curve[0].applied.sequence
    return {
        "estimator": curve[0].family.estimator,
        "harmonics": shortest.harmonics,
        "base_frequency_hz": shortest.base_frequency_hz,
        "points": [
            dict(zip(names, (each.capture_s, *each.range_errors_m()), strict=True))
            for each in shown[:: max(1, len(shown) // POINTS)]
        ],
    }


def _times_s(curves: list[Curve]) -> list[float]:
    """Return `ON_FRONT` times at equal ratios, from the shortest capture on."""
    shortest_s = curves[0][0].capture_s
    longest_s = max(curve[-1].capture_s for curve in curves)
    longest_s = min(max(LONGEST_S, shortest_s), longest_s)
    ratio = (longest_s / shortest_s) ** (1 / (ON_FRONT - 1))
    return [shortest_s * ratio**k * (1 + 1e-9) for k in range(ON_FRONT)]


def _coarse_to_fine(count: int) -> list[int]:
    """Return the places 0 to ``count`` - 1: the ends, then each time the middle of a widest gap."""
    order = [0, count - 1]
    while len(order) < count:
        gaps = itertools.pairwise(sorted(order))
        before, after = max(gaps, key=lambda gap: gap[1] - gap[0])
        order.append((before + after) // 2)
    return order


def _frequencies(estimator: str, sequence: Sequence) -> tuple[str, int, float, str]:
    return estimator, sequence.harmonics, sequence.base_frequency_hz, sequence.zeroth
