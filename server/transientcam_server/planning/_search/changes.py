"""Which change to the camera would save most of what a choice costs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from transientcam_driver import Capabilities
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._scene.estimation import SEARCHED
from transientcam_server.planning._search.candidates import ComputingTime, Curve, curves, longest
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.families import families
from transientcam_server.planning._search.goal import Goal
from transientcam_server.planning._search.search import first_within

TWICE: Final = 2.0
"""How many times faster, or brighter, a changed camera is."""
_SAME: Final = frozenset({"harmonics", "base_frequency_hz", "zeroth"})
"""What stays of a sequence that is planned anew for a changed camera."""


@dataclass(frozen=True, slots=True)
class Change:
    """What a changed camera would make of the same goal, with the same frequencies and estimator.

    Attributes
    ----------
    what
        ``readout``, twice as fast, or ``light``, twice as much.
    capture_s, error
        Of the best sequence then; the error is of the target that leads.
    time_factor, error_factor
        How many times less they are.
    """

    what: str
    capture_s: float
    error: float
    time_factor: float
    error_factor: float

    def in_words(self, *, by_time: bool) -> str:
        """State what it gives: less time, or, where the time is given, less error."""
        times = (
            f"{self.time_factor:.2g} x" if by_time else f"{self.error_factor:.2g} x the accuracy"
        )
        subject = {"readout": "a read-out twice as fast", "light": "twice the light"}[self.what]
        return f"{subject} gives {times}"


def changes(
    best: Choice, goal: Goal, predictor: Predictor, capabilities: Capabilities
) -> list[Change]:
    """Plan anew for cameras of which one thing is better, and return what that gives, best first.

    Few draws find the quickest sequence that is as safely within the targets as the best choice is,
    or without targets the longest within the budgets; many draws predict it. A camera that the
    frequencies do not suit is left out.
    """
    sequence = best.applied.sequence
    same = replace(goal, base=sequence, fixed=goal.fixed | _SAME, estimator=best.estimator)
    same = replace(same, computing_share=None)  # that is not of the capture
    cameras = {
        "readout": (predictor, _faster(capabilities)),
        "light": (predictor.brighter(TWICE), capabilities),
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
        if place is None:
            continue
        choice = curve[place].choice()
        time_s, error = choice.applied.capture_s, choice.error(goal.leading)
        factors = best.applied.capture_s / time_s, best.error(goal.leading) / max(error, 1e-12)
        found.append(Change(what, time_s, error, *factors))
    by = "time_factor" if limits else "error_factor"
    return sorted(found, key=lambda change: -float(getattr(change, by)))


def _curve(goal: Goal, predictor: Predictor, capabilities: Capabilities) -> Curve:
    (curve,) = curves(families(goal, predictor, capabilities), goal, predictor, lambda *_: None)
    return curve


def computing_s(best: Choice, timed: ComputingTime) -> dict[str, float | None]:
    """Return the computing time in s of a frame of a choice's sequence, by estimator."""
    names = dict.fromkeys((best.estimator, *SEARCHED))
    return {name: timed(best.applied.sequence, name) for name in names}


def in_words(items: Mapping[str, Any], found: list[Change], goal: Goal) -> str:
    """Name what the time of a capture goes into, and what would buy most."""
    whole_s = items["light_s"] + items["readout_s"] + items["settling_s"]
    names = {"light_s": "light", "readout_s": "read-out", "settling_s": "settling"}
    most = max(names, key=lambda name: float(items[name]))
    share = f"{items[most] / whole_s:.0%} of the capture is {names[most]}"
    if not found:
        return f"{share}."
    by_time = bool(goal.targets)
    return f"{share}: " + "; ".join(each.in_words(by_time=by_time) for each in found) + "."


def _faster(capabilities: Capabilities) -> Capabilities:
    return replace(
        capabilities,
        readout_s=capabilities.readout_s / TWICE,
        streaming_readout_s=capabilities.streaming_readout_s / TWICE,
    )
