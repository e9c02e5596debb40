"""From a target accuracy or a budget of time to a sequence and an estimator.

The stages, each from a value to a value: a goal becomes families of sequences; these become
candidates, which are predicted as far as the search asks; what it recommends becomes a plan, and
what falls short of the goal a refusal.
"""

import math
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from transientcam_driver import Capabilities
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning._prediction.measures import DISAGREEING
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._process.queue import Progress
from transientcam_server.planning._scene.estimation import SEARCHED
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.planning._search.families import BUDGETS, Goal, families, flat_from
from transientcam_server.planning._search.search import (
    Choice,
    ComputingTime,
    Curve,
    best_choice,
    curves,
    finest,
    first_within,
    longest,
    quickest,
    shortened,
)


@dataclass(frozen=True, slots=True)
class Shortfall:
    """Why nothing suits a goal."""

    field: str
    """The target or budget that is out of reach, by itself or ``together`` with the others."""
    best: Choice
    """Of a target, the most accurate within the budgets; of a budget, the shortest of all."""
    together: bool = False
    dearer: Choice | None = None
    """The one for the target whatever it costs, where there are budgets."""


def shortfall(
    goal: Goal, best: Choice | None, curves: list[Curve], unlimited: list[Curve]
) -> Shortfall:
    """Return what falls short where no choice reaches the targets within the budgets.

    ``best``: by the leading target, within the budgets; None where nothing is.
    ``curves``, ``unlimited``: all candidates, by the goal and without its budgets.
    """
    if best is None:
        return _of_budgets(goal, unlimited)
    for target, limit in goal.limits.items():
        finest_by_it = best if target == goal.leading else finest(curves, target) or best
        if finest_by_it.error_with_margin(target) > limit:
            dearer = None
            if target.startswith("range") and goal.budgets:
                dearer = best_choice(unlimited, {target: limit}, target)
            return Shortfall(target, finest_by_it, dearer=dearer)
    # each by itself is in reach, but nothing reaches all of them
    return Shortfall(goal.leading, best, together=True)


def _of_budgets(goal: Goal, unlimited: list[Curve]) -> Shortfall:
    """Return the first budget that the shortest capture exceeds, or all together."""
    shortest = min((curve[0] for curve in unlimited), key=lambda each: each.capture_s)
    for name in goal.budgets:
        alone = Goal(**{name: getattr(goal, name)})
        if not alone.affords(shortest.capture_s, shortest.reconstruct_s):
            return Shortfall(name, shortest.choice())
    return Shortfall(goal.budgets[0], shortest.choice(), together=True)


_CLEARLY_LESS: Final = 0.8
"""Share of the best error that what is dearer has to stay below to be named."""


def refusal(
    goal: Goal, shortfall: Shortfall, *, of_one_frame: bool = False, calibrated: bool = True
) -> Problem:
    """Return the problem ``target-unreachable`` of what falls short of a goal.

    A frame of another purpose, or a look without a calibration, decides nothing: a capture may do
    better.
    """
    field, best = shortfall.field, shortfall.best
    limit, achieved = getattr(goal, field), _achieved(best, field)
    limited_by, words = _limits(shortfall)
    named = "share of captures that find both" if field == "separation_m" else field
    margin, of_share = "", ""
    if field == "range_error_m" and goal.share is not None:
        of_share = f" in {goal.share:.0%} of the pixels"
    if field.startswith("range") and achieved <= limit:
        margin = ", which leaves no margin"
    decided = (calibrated and not of_one_frame) or not field.startswith("range")
    witness, better = "a look without a calibration", "a calibrated camera"
    if of_one_frame:
        witness, better = "one frame", "a look at all frequencies"
    verdict = (
        f"This cannot be reached on this scene: {field} = {limit:g}{of_share}. "
        f"The best {named} is {achieved:.4g}{margin}."
        if decided
        else f"Whether this can be reached {witness} does not tell: {field} = {limit:g}{of_share}. "
        f"By it the best {named} is {achieved:.4g}; {better} may find less."
    )
    return Problem(
        kinds.TARGET_UNREACHABLE,
        f"{verdict} What limits it: {words}.",
        decided=decided,
        field=field,
        value=limit,
        limit=achieved,
        limited_by=limited_by,
        best=best.to_document(),
    )


def _achieved(best: Choice, field: str) -> float:
    """Return what a choice achieves of a target, or needs of a budget."""
    if field == "separation_m":
        return 0.0 if best.separation_share is None else best.separation_share
    if field == "computing_share":
        return math.inf if best.computing_share is None else best.computing_share
    return float(getattr(best.applied, field)) if field in BUDGETS else best.error(field)


def _limits(shortfall: Shortfall) -> tuple[str, str]:
    """Return what limits a choice, by a word and in words."""
    field, best = shortfall.field, shortfall.best
    budget = field in BUDGETS
    if shortfall.together:
        return "together", f"the {'budgets' if budget else 'targets'} together"
    if budget:
        return "budget", f"{field} alone"
    if not field.startswith("range"):
        return "noise", "the longest capture there is does no better"
    noise_m, bias_m = best.predicted.range_std.median, best.predicted.range_bias_m
    m = best.applied.sequence.harmonics
    dearer = _dearer(shortfall)
    if field == "range_error_m" and bias_m > noise_m:
        return (
            "bias",
            f"more time does not help here: bias {bias_m * 1e3:.3g} mm at m = {m}{dearer}",
        )
    capture_ms = best.applied.capture_s * 1e3
    return "noise", f"noise {noise_m * 1e3:.3g} mm in {capture_ms:.3g} ms at m = {m}{dearer}"


def _dearer(shortfall: Shortfall) -> str:
    """Say what more than the budgets would give, after a semicolon; or nothing."""
    field, best, dearer = shortfall.field, shortfall.best, shortfall.dearer
    if dearer is None or dearer.error(field) >= _CLEARLY_LESS * best.error(field):
        return ""
    factor = dearer.applied.capture_s / best.applied.capture_s
    return (
        f"; m = {dearer.applied.sequence.harmonics} takes {factor:.2g} x as long and is "
        f"{dearer.error(field) * 1e3:.3g} mm off"
    )


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


def summary(best: Choice, twice: Choice | None, scene: SceneStatistics) -> str:
    """State noise and bias of a choice, and what half its error costs; and any doubt."""
    predicted = best.predicted
    noise_m, bias_m = predicted.range_std.median, predicted.range_bias_m
    first = f"{noise_m * 1e3:.3g} mm noise, {bias_m * 1e3:.3g} mm off"
    if best.share is not None:  # more than what noise and bias of the median pixel are together
        first = f"{_error_in_words(best)}, the median one with {first}"
    doubt = _doubt(best, scene)
    if twice is None:
        what = "more frequencies or another estimator" if bias_m > noise_m else "a longer capture"
        return (
            f"{first}: nothing that this camera can capture halves the error, not even {what}."
            + doubt
        )
    factor = twice.applied.capture_s / best.applied.capture_s
    error = _error_in_words(twice)
    return f"{first}: {twice.in_words()} takes {factor:.2g} x as long for {error}." + doubt


def summary_of_front(front: list[Choice], scene: SceneStatistics) -> str:
    """State from where on more time buys little, of choices by rising time; and any doubt."""
    if not front:
        return "Nothing reaches any accuracy on this scene."
    finest = front[-1]
    best = (
        f"the best is {_error_in_words(finest)} in "
        f"{_time_in_words(finest.applied.capture_s)} ({finest.in_words()})"
    )
    doubt = _doubt(finest, scene)
    flat = flat_from(
        [
            (each.predicted.range_std.median, each.predicted.range_bias_m, each.range_error.median)
            for each in front
        ]
    )
    if flat is None:
        return f"Noise rules everywhere: more time buys accuracy; {best}." + doubt
    since = _time_in_words(front[flat].applied.capture_s)
    return f"From {since} on bias rules and more time buys little; {best}." + doubt


def _doubt(choice: Choice, scene: SceneStatistics) -> str:
    """Return a sentence, after a space, on why the bias of a choice is not known; or nothing."""
    if choice.predicted.bias_known:
        return ""
    if scene.lit_in_part:
        return (
            f" Bias unknown: {scene.dim_share:.0%} of the lit pixels are so dim that other "
            "surfaces may light them alone, and by how much that light is late does not show."
        )
    apart_m = scene.disagreement_m
    if apart_m > DISAGREEING * choice.predicted.range_error.median:
        return (
            f" Bias unknown: two ways to tell direct from later light differ by {apart_m * 1e3:.2g}"
            " mm even at all frequencies, and both may be further off."
        )
    return (
        " Bias unknown: light that goes on coming, as out of wax or from other walls, would look "
        f"the same, and put the range {choice.predicted.most_bias_m * 1e3:.2g} mm off."
    )


def _error_in_words(choice: Choice) -> str:
    """State the error that targets limit: of the median pixel, or of a share of a capture's."""
    of_share = "" if choice.share is None else f" for {choice.share:.0%} of the pixels"
    return f"{choice.range_error.median * 1e3:.3g} mm{of_share}"


def _time_in_words(time_s: float) -> str:
    return f"{time_s:.3g} s" if time_s >= 1 else f"{time_s * 1e3:.3g} ms"


@dataclass(frozen=True, slots=True)
class Plan:
    """A recommendation and its neighbours; None where there is none.

    ``half_time``: The most accurate one that takes at most half the time.
    ``twice_accuracy``: The quickest one with at most half the error.
    ``leading``: The target by which they are compared.
    ``summary``: A sentence about noise, bias and what half the error costs, and one where the bias
    is not known.
    ``scene``: What it was planned for.
    ``goal``: What it was planned for, too.
    ``changes``: What better cameras would give, best first.
    ``computing_s``: Computing time of a frame by estimator; None where it is not known yet.
    """

    recommended: Choice
    half_time: Choice | None
    twice_accuracy: Choice | None
    leading: str
    summary: str
    scene: SceneStatistics
    goal: Goal
    changes: list[Change]
    computing_s: dict[str, float | None]

    def to_document(self) -> dict[str, Any]:
        """Return the plan as JSON has it."""
        region = self.goal.region
        return {
            **self.recommended.to_document(),
            "region": None if region is None else region.to_document(),
            "computing_s": self.computing_s,
            "changes": [asdict(each) for each in self.changes],
            "price_summary": in_words(self.recommended, self.changes, self.goal),
            "compared_by": self.leading,
            "summary": self.summary,
            "scene": self.scene.to_document(),
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
    timed: ComputingTime,
    progress: Progress | None = None,
) -> Plan:
    """Recommend a sequence and an estimator.

    ``goal``: Targets and budgets.
    ``predictor``: Of the scene.
    ``capabilities``: Of the camera.
    ``timed``: Computing time in s of a frame of a sequence with an estimator on this machine.
    ``progress``: Receives the steps.
    Raises Problem: ``invalid-request`` where the goal is empty or a value is out of bounds;
    ``target-unreachable`` with the best that can be achieved and what limits it.
    """
    goal.require_sensible()
    progress = progress or Progress()
    progress.at(0.0, "sequences for the goal")
    found = families(goal, predictor, capabilities)
    candidates = curves(found, goal, predictor, timed)
    unlimited = curves(found, goal.without_budgets(), predictor, timed)
    targets, leading, scene = goal.limits, goal.leading, predictor.scene
    best = best_choice(candidates, targets, leading)
    if best is None or best.relative_errors(targets)[1] > 1:
        missed = shortfall(goal, best, candidates, unlimited)
        seen = {name: getattr(scene, name) for name in ("of_one_frame", "calibrated")}
        raise refusal(goal, missed, **seen)
    progress.at(0.7, "half the time")
    best, half_time = shortened(best, candidates, targets, leading)
    progress.at(0.8, "twice the accuracy")
    half = best.error(leading) / 2  # of nothing there is none
    twice = quickest(unlimited, {leading: half}, contenders=1) if half else None
    progress.at(0.9, "what would buy most")
    better = changes(best, goal, predictor, capabilities)
    words, sequence = summary(best, twice, scene) + scene.conditions, best.applied.sequence
    times_s = {name: timed(sequence, name) for name in dict.fromkeys((best.estimator, *SEARCHED))}
    return Plan(best, half_time, twice, leading, words, scene, goal, better, times_s)
