"""What plans and fronts say: what is reached and what limits it, what it costs, any doubt."""

import math
from dataclasses import dataclass
from typing import Final

from transientcam.text import figures
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning._prediction.measures import DISAGREEING
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.planning._search.families import BUDGETS, Goal
from transientcam_server.planning._search.pareto import flat_from
from transientcam_server.planning._search.search import Choice

_NOTABLE_M: Final = 5e-4
"""Range that is worth a sentence."""
_CLEARLY_LESS: Final = 0.8
"""Share of the best error that what is dearer has to stay below to be named."""
_WORDS: Final = {"readout": "a read-out twice as fast", "light": "twice the light"}


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
        return ("bias", f"more time does not help here: bias {_mm(bias_m)} at m = {m}{dearer}")
    capture = _time_in_words(best.applied.capture_s)
    return "noise", f"noise {_mm(noise_m)} in {capture} at m = {m}{dearer}"


def _dearer(shortfall: Shortfall) -> str:
    """Say what more than the budgets would give, after a semicolon; or nothing."""
    field, best, dearer = shortfall.field, shortfall.best, shortfall.dearer
    if dearer is None or dearer.error(field) >= _CLEARLY_LESS * best.error(field):
        return ""
    factor = dearer.applied.capture_s / best.applied.capture_s
    return (
        f"; m = {dearer.applied.sequence.harmonics} takes {figures(factor, 2)} x as long and is "
        f"{_mm(dearer.error(field))} off"
    )


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


def price_in_words(best: Choice, found: list[Change], goal: Goal) -> str:
    """Name what the time of a capture goes into, and what would buy most."""
    items = best.price
    names = {"light_s": "light", "readout_s": "read-out", "settling_s": "settling"}
    most = max(names, key=lambda name: float(items[name] or 0.0))
    gains = [
        f"{_WORDS[each.what]} gives "
        + (
            f"{figures(each.time_factor, 2)} x"
            if goal.targets
            else f"{figures(each.error_factor, 2)} x the accuracy"
        )
        for each in found
    ]
    share = f"{(items[most] or 0.0) / best.applied.capture_s:.0%} of the capture is {names[most]}"
    return f"{': '.join(filter(None, (share, '; '.join(gains))))}."


def summary(best: Choice, twice: Choice | None, scene: SceneStatistics) -> str:
    """State noise and bias of a choice, and what half its error costs; and any doubt."""
    predicted = best.predicted
    noise_m, bias_m = predicted.range_std.median, predicted.range_bias_m
    first = f"{_mm(noise_m)} noise, {_mm(bias_m)} off"
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
    return f"{first}: {twice.in_words()} takes {figures(factor, 2)} x as long for {error}." + doubt


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
            f" Bias unknown: two ways to tell direct from later light differ by {_mm(apart_m)}"
            " even at all frequencies, and both may be further off."
        )
    return (
        " Bias unknown: light that goes on coming, as out of wax or from other walls, would look "
        f"the same, and put the range {_mm(choice.predicted.most_bias_m)} off."
    )


def _error_in_words(choice: Choice) -> str:
    """State the error that targets limit: of the median pixel, or of a share of a capture's."""
    of_share = "" if choice.share is None else f" for {choice.share:.0%} of the pixels"
    return f"{_mm(choice.range_error.median)}{of_share}"


def _mm(length_m: float) -> str:
    return f"{figures(length_m * 1e3, 3)} mm"


def _time_in_words(time_s: float) -> str:
    return f"{figures(time_s, 3)} s" if time_s >= 1 else f"{time_s * 1e3:.3g} ms"


def conditions(scene: SceneStatistics) -> str:
    """Return sentences on what of the camera a plan rests on, each after a space; or nothing."""
    said = ""
    if not scene.calibrated:
        said = (
            " No calibration is in use: calibrate first, or ranges are off by more than this tells."
        )
    elif scene.uncalibrated_m > _NOTABLE_M:
        said = (
            f" Calibrate with this sequence: without, ranges are {_mm(scene.uncalibrated_m)} off."
        )
    if scene.drift_m > _NOTABLE_M:
        said += f" Since the calibration in use ranges may have drifted by {_mm(scene.drift_m)}."
    return said
