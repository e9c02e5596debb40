"""Estimators of other packages: entries of the group `GROUP`, each the `Technique` of its name.

Their code is imported when it is first asked for, and what it does wrong is an `EstimatorFailed`.
"""

from collections.abc import Callable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._technique import Technique
from transientcam_moments.errors import EstimatorFailed
from transientcam_moments.moment_problem import Separation
from transientcam_moments.noise import MomentNoise

GROUP = "transientcam.estimators"
Separate = Callable[[str, Array, Array | None, Array, float], Separation]
"""As `separated`."""


@cache
def plugged() -> dict[str, tuple[EntryPoint, ...]]:
    """Return the entries of all packages by their names; several are one too many."""
    found: dict[str, dict[str, EntryPoint]] = {}
    for point in entry_points(group=GROUP):
        found.setdefault(point.name, {})[point.value] = point
    return {name: tuple(found[name].values()) for name in sorted(found)}


@cache
def loaded(name: str) -> Technique | EstimatorFailed:
    """Return the technique of another package, or why there is none."""
    points = plugged().get(name, ())
    if len(points) != 1:
        values = ", ".join(sorted(point.value for point in points))
        return EstimatorFailed(name, f"several packages offer it: {values}" if values else "gone")
    value = points[0].value
    try:
        technique = points[0].load()
    except (Exception, SystemExit) as error:
        return EstimatorFailed(name, f"{value} cannot be imported: {_in_words(error)}")
    if not isinstance(technique, Technique):
        return EstimatorFailed(name, f"{value} is a {type(technique).__name__}, not a Technique")
    if (technique.name, technique.measures) != (name, "moments"):
        stated = f"it calls itself {technique.name!r} and measures {technique.measures!r}"
        return EstimatorFailed(name, f"{stated}, not {name!r} and 'moments'")
    return technique


def load(name: str) -> Technique:
    """Return that technique, or raise the EstimatorFailed."""
    found = loaded(name)
    if isinstance(found, EstimatorFailed):
        raise EstimatorFailed(found.name, found.reason)
    return found


def separated(
    name: str, b: Array, variance: Array | None, frequencies_hz: Array, threshold: float
) -> Separation:
    """Return direct and indirect light and phase (...) by the technique of another package.

    A pixel whose phase or light is not finite has none.

    Parameters
    ----------
    name
        Of the entry.
    b, variance : array, shape (m + 1, ...)
        Moments, and the variance of their real and imaginary parts; None where it isn't known.
    frequencies_hz : array, shape (m + 1,)
        Of the moments; NaN where no base frequency is known.
    threshold
        As that of `separate`.

    Raises
    ------
    EstimatorFailed
        Where it raises, returns something else, or has no phase in any pixel that has light.
    """
    noise = None if variance is None else MomentNoise(variance)
    technique = load(name)
    try:
        with np.errstate(all="ignore"):  # of pixels without light
            parts = technique.of(b.copy(), noise, frequencies_hz).separate(threshold)
        direct, indirect, phase = (np.asarray(part, b.real.dtype) for part in parts)
    except Exception as error:
        raise EstimatorFailed(name, _in_words(error)) from error
    for field, part in zip(Separation._fields, (direct, indirect, phase), strict=True):
        if part.shape != b.shape[1:]:
            found = f"its {field} has shape {part.shape}, and the pixels have {b.shape[1:]}"
            raise EstimatorFailed(name, found)
    there = np.isfinite(direct) & np.isfinite(indirect) & np.isfinite(phase)
    if (b[0].real > 0).any() and not there.any():
        raise EstimatorFailed(name, "it has no finite phase and light in any pixel")
    direct, indirect = np.where(there, direct, 0), np.where(there, indirect, 0)
    return Separation(direct, indirect, np.remainder(np.where(there, phase, np.nan), 2 * np.pi))


SEPARATORS: list[Separate] = [separated]
"""The last one separates for reconstructions: in another process, say."""


def import_there(name: str, *_: Any) -> None:
    """Import a technique in another process; raise the EstimatorFailed."""
    load(name)


def separated_there(name: str, *arguments: Any) -> Separation:
    """Do as `separated` in another process, whose calls have one argument more."""
    return separated(name, *arguments[:-1])


def _in_words(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"
