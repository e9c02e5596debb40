"""Which change to the camera would save most of what a choice costs."""

from dataclasses import dataclass, replace
from typing import Final

from transientcam_driver import Capabilities
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._search.candidates import Curve, curves, longest
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.families import families
from transientcam_server.planning._search.goal import Goal
from transientcam_server.planning._search.search import first_within

_SAME: Final = frozenset({"harmonics", "base_frequency_hz", "zeroth"})
_WORDS: Final = {"readout": "a read-out twice as fast", "light": "twice the light"}


@dataclass(frozen=True, slots=True)
class Change:
    """What twice the ``light``, or a ``readout`` twice as fast, would make of the same goal.

    With the same frequencies and estimator: time, error of the target that leads, and how many
    times less they are.
    """

    what: str
    capture_s: float
    error: float
    time_factor: float
    error_factor: float


def changes(
    best: Choice, goal: Goal, predictor: Predictor, capabilities: Capabilities
) -> list[Change]:
    """Plan anew for cameras of which one thing is better, and return what that gives, best first.

    Few draws find the quickest sequence that is as safely within the targets as the best choice is,
    or without targets the longest within the budgets; many draws predict it.
    """
    same = replace(goal, base=best.applied.sequence, fixed=goal.fixed | _SAME)
    same = replace(same, estimator=best.estimator, computing_share=None)
    readout_s = capabilities.streaming_readout_s / 2
    cameras = {
        "readout": (predictor, replace(capabilities, streaming_readout_s=readout_s)),
        "light": (predictor.brighter(2.0), capabilities),
    }
    present = _curve(same, predictor, capabilities)
    own = min(present, key=lambda each: abs(each.capture_s - best.applied.capture_s))
    limits = {
        name: limit * own.error(name) / max(best.error_with_margin(name), 1e-12)
        for name, limit in goal.limits.items()
    }
    found = []
    for what, (of_scene, camera) in cameras.items():
        curve = _curve(same, of_scene, camera)
        last = longest(curve)
        place = last if last is None or not limits else first_within(curve, limits, 0, last)
        if place is not None:
            choice = curve[place].choice()
            time_s, error = choice.applied.capture_s, choice.error(goal.leading)
            factors = best.applied.capture_s / time_s, best.error(goal.leading) / max(error, 1e-12)
            found.append(Change(what, time_s, error, *factors))
    return sorted(found, key=lambda each: each.time_factor if limits else each.error_factor)[::-1]


def in_words(best: Choice, found: list[Change], goal: Goal) -> str:
    """Name what the time of a capture goes into, and what would buy most."""
    items = best.price
    names = {"light_s": "light", "readout_s": "read-out", "settling_s": "settling"}
    most = max(names, key=lambda name: float(items[name] or 0.0))
    gains = [
        f"{_WORDS[each.what]} gives "
        + (
            f"{each.time_factor:.2g} x"
            if goal.targets
            else f"{each.error_factor:.2g} x the accuracy"
        )
        for each in found
    ]
    share = f"{(items[most] or 0.0) / best.applied.capture_s:.0%} of the capture is {names[most]}"
    return f"{': '.join(filter(None, (share, '; '.join(gains))))}."


def _curve(goal: Goal, predictor: Predictor, capabilities: Capabilities) -> Curve:
    (curve,) = curves(families(goal, predictor, capabilities), goal, predictor, lambda *_: None)
    return curve
