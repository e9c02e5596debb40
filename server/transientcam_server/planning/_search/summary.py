"""Plans and fronts in words: what noise and bias are, what more time buys, and what is in doubt."""

from transientcam_server.planning._prediction.intervals import DISAGREEING
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.planning._search.choice import Choice
from transientcam_server.planning._search.pareto import flat_from


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
            (
                each.predicted.range_std.median,
                each.predicted.range_bias_m,
                each.range_error.median,
            )
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
