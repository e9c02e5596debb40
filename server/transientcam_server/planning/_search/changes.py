"""Which change to the camera would save most of what a choice costs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from transientcam_driver import Capabilities
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._scene.estimation import SEARCHED
from transientcam_server.planning._search.candidates import ComputingTime, curves
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.families import families
from transientcam_server.planning._search.goal import Goal
from transientcam_server.planning._search.search import best_choice

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
        times = f"{self.time_factor:.2g} x" if by_time else f"{self.error_factor:.2g} x the accuracy"
        subject = {"readout": "a read-out twice as fast", "light": "twice the light"}[self.what]
        return f"{subject} gives {times}"


def changes(best: Choice, goal: Goal, predictor: Predictor, capabilities: Capabilities) -> list[Change]:
    """Plan anew for cameras of which one thing is better, and return what that gives, best first.

    Each is predicted as any plan is; one that the same frequencies cannot use is left out.
    """
    same = replace(goal, base=best.applied.sequence, fixed=goal.fixed | _SAME, estimator=best.estimator)
    cameras = {
        "readout": (predictor, _faster(capabilities)),
        "light": (predictor.brighter(TWICE), capabilities),
    }
    found = []
    for what, (of_scene, camera) in cameras.items():
        # the time of computing changes in neither, and a budget of it is not of the capture
        curve = curves(
            families(same, of_scene, camera), replace(same, computing_share=None), of_scene, _unknown
        )
        choice = best_choice(curve, goal.limits, goal.leading)
        if choice is None or choice.relative_errors(goal.limits)[1] > 1:
            continue
        time_s, error = choice.applied.capture_s, choice.error(goal.leading)
        factors = best.applied.capture_s / time_s, best.error(goal.leading) / max(error, 1e-12)
        found.append(Change(what, time_s, error, *factors))
    by = "time_factor" if goal.targets else "error_factor"
    return sorted(found, key=lambda change: -float(getattr(change, by)))


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


def _unknown(*_: object) -> None:
    return None
